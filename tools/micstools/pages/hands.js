'use strict';
// What mouse, fingers and keys do to a stage. Drag turns, in a flat view it measures; with Shift or
// the right button it shifts; two fingers zoom and shift; the wheel zooms once the picture was
// clicked, so that a page scrolls by it.

class Hands {
  constructor(stage) {
    this.stage = stage;
    this.here = new Map();
    const canvas = stage.canvas;
    canvas.addEventListener('contextmenu', event => event.preventDefault());
    canvas.addEventListener('pointerdown', event => this.press(event));
    canvas.addEventListener('pointermove', event => this.move(event));
    for (const kind of ['pointerup', 'pointercancel'])
      canvas.addEventListener(kind, event => {
        this.here.delete(event.pointerId);
        if (stage.grab) stage.grab.release();
      });
    canvas.addEventListener('pointerleave', () => { stage.pointed = null; stage.draw(); });
    canvas.addEventListener('wheel', event => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      stage.zoom(Math.exp(clamp(event.deltaY, -200, 200) / 500));
    }, { passive: false });
    canvas.addEventListener('keydown', event => this.key(event));
  }

  press(event) {
    const stage = this.stage, first = this.here.size === 0;
    this.here.set(event.pointerId, [event.clientX, event.clientY]);
    stage.canvas.setPointerCapture(event.pointerId);
    if (!stage.flat || event.shiftKey || event.buttons & 2) return;
    if (first && stage.grab && stage.grab.press(event.clientX, event.clientY)) return;
    stage.measured = first ? { from: stage.under(event.clientX, event.clientY) } : null;
    stage.draw();
  }

  move(event) {
    const stage = this.stage, before = this.here.get(event.pointerId), now = [event.clientX, event.clientY];
    if (stage.flat) { stage.pointed = stage.under(...now); stage.draw(); }
    if (!before) return;
    if (stage.grab && stage.grab.move(...now)) return;
    const d = now.map((v, i) => v - before[i]);
    const other = [...this.here].find(([id]) => id !== event.pointerId);
    this.here.set(event.pointerId, now);
    if (other) {
      const far = p => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
      stage.zoom(far(before) / Math.max(far(now), 1));
      if (stage.flat) stage.pan(d[0] / 2, d[1] / 2);
    } else if (event.shiftKey || event.buttons & 2) stage.pan(...d);
    else if (!stage.flat) stage.rotate(d[0] / 160, d[1] / 160);
    else if (stage.measured) stage.measured.to = stage.pointed;
  }

  key(event) {
    const stage = this.stage;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (step && stage.flat) stage.pan(-30 * step[0], 30 * step[1]);
    else if (step) stage.rotate(0.1 * step[0], 0.1 * step[1]);
    else if (event.key === '+' || event.key === '=') stage.zoom(0.9);
    else if (event.key === '-') stage.zoom(1 / 0.9);
    else return;
    event.preventDefault();
  }
}
