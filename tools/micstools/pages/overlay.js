'use strict';
// What is written over the picture: numbers on the blocks, paths, axes, north, a length, and in the
// flat views rulers and a length that was measured.

const AXES = [['x', '#d1495b'], ['y', '#3f9b5b'], ['z', '#4a8fd9']];
const LEAST = 12; // squares of the map of blocks that a number needs
const MOST = 20000; // points of all paths
const HIGH = 13; // room of a label [pixels]
const FONT = '12px system-ui, "Liberation Sans", sans-serif';

class Overlay {
  constructor(stage, canvas) {
    this.stage = stage;
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
    this.numbers = true;
    this.paths = false;
  }

  load(scene) {
    this.scene = scene;
    const turn = (scene.north || 0) * Math.PI / 180;
    this.north = [Math.sin(turn), Math.cos(turn), 0];
  }

  // `scale`: pixels of the canvas in one of the page, in which all lengths here are.
  paint(camera, wide, high, scale, style) {
    const { canvas, pen, stage } = this;
    if (canvas.width !== stage.canvas.width || canvas.height !== stage.canvas.height)
      [canvas.width, canvas.height] = [stage.canvas.width, stage.canvas.height];
    Object.assign(this, { camera, wide, high, ink: style.color,
      paper: style.getPropertyValue('--stage').trim() });
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, wide, high);
    pen.font = FONT;
    pen.lineCap = pen.lineJoin = 'round';
    this.labels = []; // text, middle and width of each
    if (this.paths) this.drawPaths();
    if (stage.flat) this.drawRulers();
    if (stage.seen) this.drawNumbers();
    this.drawAxes();
    this.drawNorth();
    this.drawBar();
    if (stage.flat) this.drawMeasured();
    stage.layers.forEach(layer => layer.write(this));
  }

  at(point) {
    const seen = seenAt(this.camera, point);
    return { x: (1 + seen.x) / 2 * this.wide, y: (1 - seen.y) / 2 * this.high, w: seen.w };
  }

  write(text, x, y, align = 'center', colour = this.ink) {
    const pen = this.pen;
    pen.textAlign = align;
    pen.textBaseline = 'middle';
    pen.lineWidth = 3;
    pen.strokeStyle = this.paper;
    pen.strokeText(text, x, y);
    pen.fillStyle = colour;
    pen.fillText(text, x, y);
  }

  line(points, colour, width = 1.5) {
    const pen = this.pen;
    pen.beginPath();
    points.forEach(([x, y], k) => k ? pen.lineTo(x, y) : pen.moveTo(x, y));
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  }

  // Each block has its number where it is seen, those of which most is seen first; none where that
  // is far wider than the block or meets another one. Of a few each has its long label.
  drawNumbers() {
    const { seen, scene } = this.stage, sums = new Map(), pen = this.pen;
    for (let y = 0; y < seen.h; y++) for (let x = 0; x < seen.w; x++) {
      const k = seen.at(x, y);
      if (!k) continue;
      const sum = sums.get(k) || sums.set(k, { k, n: 0, x: 0, y: 0, low: x, high: x, first: y }).get(k);
      sum.n++; sum.x += x; sum.y += y;
      [sum.low, sum.high, sum.last] = [Math.min(sum.low, x), Math.max(sum.high, x), y];
    }
    pen.font = `bold ${FONT}`;
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    for (const sum of [...sums.values()].sort((p, q) => q.n - p.n)) {
      const { number, label } = scene.bodies[sum.k - 1], text = label || number;
      const wide = pen.measureText(text).width;
      if (sum.n < LEAST || !label && wide > 1.5 * (sum.high - sum.low + 1) / seen.w * this.wide) continue;
      let x = sum.x / sum.n, y = sum.y / sum.n;
      if (seen.at(Math.round(x), Math.round(y)) !== sum.k) [x, y] = this.nearest(sum.k, sum);
      const place = [(x + 0.5) / seen.w * this.wide, (y + 0.5) / seen.h * this.high];
      if (label) this.giveRoom(place, wide);
      if (this.taken(place, wide)) continue;
      this.labels.push([text, ...place, wide]);
      pen.lineWidth = 3;
      pen.strokeStyle = '#ffffff';
      pen.strokeText(text, ...place);
      pen.fillStyle = '#14181c';
      pen.fillText(text, ...place);
    }
    pen.font = FONT;
  }

  // Is there a label already where one so wide would stand?
  taken(place, wide) {
    return this.labels.some(([, x, y, w]) =>
      Math.abs(x - place[0]) < (w + wide) / 2 + 2 && Math.abs(y - place[1]) < HIGH);
  }

  // Moves a long label down until it stands on no other; a line leads to a distant one.
  giveRoom(place, wide) {
    const [x, y] = place;
    for (let tries = 0; tries < 12 && this.taken(place, wide); tries++) place[1] += HIGH;
    if (place[1] > y + HIGH) this.line([[x, y], [x, place[1] - HIGH / 2]], this.ink, 0.7);
  }

  // The place at which a block is seen that is nearest to the middle of all of them.
  nearest(k, { n, x, y, low, high, first, last }) {
    const { seen } = this.stage;
    let found, least = Infinity;
    for (let j = first; j <= last; j++) for (let i = low; i <= high; i++) {
      const far = (i - x / n) ** 2 + (j - y / n) ** 2;
      if (far < least && seen.at(i, j) === k) [found, least] = [[i, j], far];
    }
    return found;
  }

  // Of the block that is followed, else of all that are free: faint as a whole, strong so far.
  drawPaths() {
    const { stage } = this, { bodies, period } = this.scene;
    const chosen = stage.followed !== null ? [stage.followed]
      : bodies.flatMap((body, k) => body.fixed || body.release === null ? [] : [k]);
    const every = Math.max(1, Math.ceil(chosen.length * stage.times.length / MOST));
    for (const k of chosen) {
      const parts = [[]], now = [];
      let before = null;
      const rows = [...stage.times.keys()].filter(a => a % every === 0 || a === stage.times.length - 1)
        .filter(a => stage.times[a] >= bodies[k].release - 1e-9);
      for (const a of rows) {
        const { place } = stage.pose(k, [a, a, 0]), { x, y, w } = this.at(place);
        if (w <= 0 || before && place.some((v, i) => period[i] && Math.abs(v - before[i]) > period[i] / 2))
          parts.push([]);
        parts[parts.length - 1].push([x, y]);
        if (stage.times[a] <= stage.time) now[parts.length - 1] = parts[parts.length - 1].length;
        before = place;
      }
      const colour = css(rgb(bodies[k].colour));
      this.pen.globalAlpha = 0.35;
      parts.forEach(part => this.line(part, colour, 1.5));
      this.pen.globalAlpha = 1;
      parts.forEach((part, i) => now[i] && this.line(part.slice(0, now[i]), this.paper, 4));
      parts.forEach((part, i) => now[i] && this.line(part.slice(0, now[i]), colour, 2.2));
    }
  }

  // An arrow of a direction, as seen; away from and towards the viewer it is a cross or a dot.
  arrow(x, y, direction, length, colour, name) {
    const { right, up, away } = this.stage.axes, pen = this.pen;
    const dx = dot(direction, right), dy = -dot(direction, up), long = Math.hypot(dx, dy);
    if (long < 0.1) {
      pen.beginPath();
      pen.arc(x, y, 5, 0, 2 * Math.PI);
      pen.fillStyle = this.paper;
      pen.fill();
      pen.strokeStyle = colour;
      pen.lineWidth = 1.5;
      pen.stroke();
      if (dot(direction, away) > 0) this.line([[x, y], [x, y]], colour, 4);
      else for (const s of [-1, 1]) this.line([[x - 3, y - 3 * s], [x + 3, y + 3 * s]], colour);
      this.write(name, x - 12, y + 8, 'center', colour);
      return;
    }
    const [ex, ey] = [x + length * dx, y + length * dy], [ux, uy] = [dx / long, dy / long];
    const back = side => [ex - 6 * ux - side * 3.5 * uy, ey - 6 * uy + side * 3.5 * ux];
    this.line([[x, y], [ex, ey]], colour, 2);
    this.line([back(1), [ex, ey], back(-1)], colour, 2);
    this.write(name, ex + 9 * ux, ey + 9 * uy, 'center', colour);
  }

  drawAxes() {
    const { away } = this.stage.axes, base = [44, 48];
    AXES.map(([name, colour], i) => [name, colour, [0, 1, 2].map(k => k === i ? 1 : 0)])
      .sort((a, b) => dot(a[2], away) - dot(b[2], away))
      .forEach(([name, colour, direction]) => this.arrow(...base, direction, 28, colour, name));
  }

  drawNorth() {
    this.arrow(this.wide - 46, 48, this.north, 24, this.ink, 'N');
  }

  // A round length; in perspective it is that at the middle of what is looked at.
  drawBar() {
    const step = 2 * this.stage.half / this.high, length = roundBelow(0.25 * step * this.wide);
    const [x, y] = this.stage.flat ? [96, 16] : [16, this.high - 16], end = x + length / step;
    for (const [colour, width] of [[this.paper, 5], [this.ink, 2]]) {
      this.line([[x, y], [end, y]], colour, width);
      for (const at of [x, end]) this.line([[at, y - 5], [at, y + 5]], colour, width);
    }
    this.bar = { length, pixels: end - x };
    this.write(inWords(length, this.stage.scene.unit), end + 8, y, 'left');
  }

  // Coordinates along the lower and the left edge.
  drawRulers() {
    const { stage, wide, high } = this, step = 2 * stage.half / high, [across, upward] = stage.flat;
    const tick = roundBelow(90 * step), { unit, origin } = stage.scene;
    const words = value => `${+(value / unit.size).toFixed(6)}`;
    const middle = [across, upward].map(d => stage.focus[d] + origin[d]);
    const ticks = (centre, extent) => {
      const found = [];
      for (let k = Math.ceil((centre - extent) / tick); k * tick <= centre + extent; k++) found.push(k * tick);
      return found;
    };
    const columns = ticks(middle[0], step * wide / 2), rows = ticks(middle[1], step * high / 2);
    const edge = 12 + Math.max(32, ...rows.map(value => this.pen.measureText(words(value)).width));
    this.pen.fillStyle = this.paper;
    this.pen.globalAlpha = 0.75;
    this.pen.fillRect(0, high - 22, wide, 22);
    this.pen.fillRect(0, 0, edge, high - 22);
    this.pen.globalAlpha = 1;
    for (const value of columns) {
      const x = wide / 2 + (value - middle[0]) / step;
      if (x < edge + 6 || x > wide - 70) continue;
      this.line([[x, high - 22], [x, high - 16]], this.ink, 1);
      this.write(words(value), x, high - 8);
    }
    for (const value of rows) {
      const y = high / 2 - (value - middle[1]) / step;
      if (y < 90 || y > high - 30) continue;
      this.line([[edge - 6, y], [edge, y]], this.ink, 1);
      this.write(words(value), edge - 9, y, 'right');
    }
    this.write(`${'xyz'[across]} [${unit.name}]`, wide - 6, high - 8, 'right');
    this.write(`${'xyz'[upward]} [${unit.name}]`, 4, 82, 'left');
  }

  // The length that was dragged, and the place under the mouse.
  drawMeasured() {
    const { stage } = this, [across, upward] = stage.flat, names = ['xyz'[across], 'xyz'[upward]];
    const { unit, origin } = stage.scene, inUnit = length => inWords(length, unit);
    const place = d => `${+((origin[d] + stage.pointed[d]) / unit.size).toFixed(unit.decimals)} ${unit.name}`;
    const { from, to } = stage.measured || {};
    this.told = '';
    if (to && Math.hypot(...to.map((v, i) => v - from[i])) > 0) {
      const d = [to[across] - from[across], to[upward] - from[upward]], ends = [this.at(from), this.at(to)];
      for (const [colour, width] of [[this.paper, 5], [this.ink, 2]]) {
        this.line(ends.map(({ x, y }) => [x, y]), colour, width);
        for (const { x, y } of ends) this.line([[x - 4, y], [x + 4, y]], colour, width);
      }
      this.told = `${inUnit(Math.hypot(...d))} (${names.map((n, i) => `Δ${n} ${inUnit(d[i])}`).join(', ')})`;
    } else if (stage.pointed)
      this.told = names.map((n, i) => `${n} ${place(stage.flat[i])}`).join(', ');
    this.write(this.told, 96, 38, 'left');
  }
}
