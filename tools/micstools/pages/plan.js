'use strict';
// What a page draws of a case before it is computed: the faces of the cells, boxes of liquid, blocks
// to come as ghosts with the reach of their random shift, the way of crane and barge, and marks at
// the places that the warnings of the program concern.

const GHOST = 0.4; // how much of a block is seen before its time
const LIQUID = rgb('#2f86c6');
const MARK = 9; // radius [pixels]
const BLINKS = 1600; // a mark that was asked for [ms]

class PlanLayer {
  constructor(stage) {
    this.stage = stage;
    this.cells = true;
    stage.layers.push(this);
  }

  load({ plan, size }) {
    [...(this.faces || []), this.reach, this.boxes].forEach(mesh => this.stage.free(mesh));
    this.plan = plan;
    const corner = (k, box) => [0, 1, 2].map(c => box[k >> c & 1][c]);
    const edges = box => [0, 1, 2].flatMap(c => [...Array(8).keys()].filter(k => !(k >> c & 1))
      .flatMap(k => [corner(k, box), corner(k | 1 << c, box)]));
    const strips = boxes => ({ lines: this.stage.strips(boxes.flatMap(edges)) });
    const sides = box => [0, 1, 2].flatMap(c => [0, 7].flatMap(k => {
      const [d, e] = [1 << (c + 1) % 3, 1 << (c + 2) % 3];
      return [k, k ^ d, k ^ d ^ e, k, k ^ d ^ e, k ^ e].flatMap(n => [...corner(n, box), 0, 0, 1]);
    }));
    this.reach = strips(plan.reach);
    const liquid = plan.liquid.flatMap(sides);
    this.boxes = { ...strips(plan.liquid), faces: this.stage.buffer(liquid, liquid.length / 6) };
    // For each side of the tank the lines on it between two cells, and the way it faces.
    this.faces = [0, 1, 2].flatMap(d => [0, 1].map(end => {
      const at = end * size[d], ends = [];
      for (const [e, f] of [[(d + 1) % 3, (d + 2) % 3], [(d + 2) % 3, (d + 1) % 3]])
        for (const v of plan.cells[e]) for (const w of [0, size[f]]) {
          const p = [0, 0, 0];
          [p[d], p[e], p[f]] = [at, v, w];
          ends.push(p);
        }
      return { lines: this.stage.strips(ends), d, outward: 2 * end - 1 };
    }));
  }

  paint(colour) {
    const { stage, plan } = this, { gl, scene } = stage;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    stage.put([0, 0, 0], [1, 0, 0, 0]);
    if (this.cells) for (const { lines, d, outward } of this.faces)
      if (outward * stage.axes.away[d] < -1e-6) stage.draft(lines, colour('--stage-line'), 0.22);
    stage.fill(this.boxes.faces, LIQUID, 0.13);
    stage.draft(this.boxes.lines, LIQUID, 0.9);
    gl.enable(gl.CULL_FACE);
    scene.bodies.forEach((body, k) => { if (!stage.shown(k)) stage.paintBlock(k, GHOST); });
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST); // a reach is mostly within the blocks that it is of
    stage.put([0, 0, 0], [1, 0, 0, 0]);
    stage.draft(this.reach.lines, rgb(plan.colour));
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  // Ways and marks over the picture.
  write(overlay) {
    const { stage, plan } = this, pen = overlay.pen;
    for (const { way, when, name } of plan.ways) { // faint as a whole, strong so far
      const points = way.map((p, k) => ({ ...overlay.at(p), past: when[k] <= stage.time + 1e-9 })).filter(({ w }) => w > 0);
      const seen = points.map(({ x, y }) => [x, y]), past = points.filter(p => p.past).map(({ x, y }) => [x, y]);
      if (seen.length < 2) continue;
      pen.globalAlpha = 0.8;
      pen.setLineDash([5, 4]);
      overlay.line(seen, plan.colour, way.length > 100 ? 0.8 : 1.8);
      pen.setLineDash([]);
      pen.globalAlpha = 1;
      overlay.line(past, plan.colour, 2.5);
      const [[x0, y0], [x1, y1]] = seen.slice(-2), long = Math.hypot(x1 - x0, y1 - y0);
      if (long > 1) {
        const [ux, uy] = [(x1 - x0) / long, (y1 - y0) / long];
        const back = s => [x1 - 9 * ux - 4 * s * uy, y1 - 9 * uy + 4 * s * ux];
        overlay.line([back(1), [x1, y1], back(-1)], plan.colour, 2);
      }
      const place = [seen[0][0], seen[0][1] - 12], wide = pen.measureText(name).width;
      while (overlay.taken(place, wide)) place[1] -= HIGH;
      overlay.write(name, ...place, 'center', plan.colour);
    }
    this.marks = [];
    for (const mark of plan.marks) for (const k of [...mark.bodies, ...mark.at.map(p => p)]) {
      const { x, y, w } = overlay.at(typeof k === 'number' ? stage.pose(k).place : k);
      if (w > 0) this.drawMark(overlay, mark.number, x + 14, y - 14);
    }
  }

  drawMark(overlay, number, x, y) {
    const pen = overlay.pen, big = this.asked === number ? 1.7 : 1, r = big * MARK;
    const near = () => this.marks.filter(m => Math.hypot(m.x - x, m.y - y) < 1.8 * MARK);
    if (near().some(m => m.number === number)) return;
    while (near().length) x += MARK;
    this.marks.push({ number, x, y });
    pen.beginPath();
    pen.arc(x, y, r, 0, 2 * Math.PI);
    pen.fillStyle = '#b3322f';
    pen.fill();
    pen.strokeStyle = overlay.paper;
    pen.lineWidth = 1.5;
    pen.stroke();
    pen.font = `bold ${FONT}`;
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    pen.fillStyle = '#ffffff';
    pen.fillText(number, x, y + 0.5);
    pen.font = FONT;
  }

  // Makes the marks of a warning larger for a moment.
  ask(number) {
    this.asked = number;
    this.stage.draw();
    clearTimeout(this.asking);
    this.asking = setTimeout(() => { this.asked = null; this.stage.draw(); }, BLINKS);
  }
}

// Selects a line of a text, and brings it into sight.
function chooseLine(text, line) {
  const range = document.createRange(), [from, to] = ends(text.data, line);
  range.setStart(text, from);
  range.setEnd(text, to);
  getSelection().removeAllRanges();
  getSelection().addRange(range);
  scrollBy(0, range.getBoundingClientRect().top - innerHeight / 2);
}

// Where a line of a text begins and ends.
function ends(text, line) {
  const lines = text.split('\n'), from = lines.slice(0, line - 1).reduce((sum, words) => sum + words.length + 1, 0);
  return [from, from + (lines[line - 1] || '').length];
}

// A player of a set-up, with the buttons of its page.
function startPlan(root) {
  const player = startPlayer(root);
  if (!player) return null;
  player.plan = new PlanLayer(player.stage);
  const cells = root.querySelector('.cells');
  cells.addEventListener('change', () => { player.plan.cells = cells.checked; player.stage.draw(); });
  document.addEventListener('click', event => {
    const asked = event.target.closest('[data-mark]');
    if (asked) player.plan.ask(+asked.dataset.mark);
    const line = event.target.closest('[data-line]'), text = document.querySelector('#case pre');
    if (line && text) chooseLine(text.firstChild, +line.dataset.line);
  });
  return player;
}
