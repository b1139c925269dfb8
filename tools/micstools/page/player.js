'use strict';
// Shows blocks and water in three dimensions and plays their fall: plain WebGL, nothing loaded.
// Lengths in m, times in s; z is up. A scene is what motion.py packs.

const BLOCK_VERTEX = `
attribute vec3 place, normal;
uniform mat4 camera;
uniform vec3 shift;
uniform vec4 turn;
varying vec3 facing;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
void main() {
  facing = turned(normal);
  gl_Position = camera * vec4(turned(place) + shift, 1.0);
}`;
const BLOCK_FRAGMENT = `
precision mediump float;
uniform vec4 colour;
uniform float lit;
varying vec3 facing;
void main() {
  vec3 n = normalize(facing);
  float sky = 0.5 + 0.5 * n.z;
  float sun = max(dot(n, normalize(vec3(-0.45, -0.6, 0.75))), 0.0);
  gl_FragColor = vec4(colour.rgb * mix(1.0, 0.42 + 0.28 * sky + 0.36 * sun, lit), colour.a);
}`;

const unpack = (text, Kind) => {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Kind(bytes.buffer);
};
const rgb = text => [1, 3, 5].map(k => parseInt(text.slice(k, k + 2), 16) / 255);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = v => { const n = Math.hypot(...v) || 1; return v.map(c => c / n); };
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// Colours from low to high that can be told apart in grey, too.
const RAMP = ['#2c2a6b', '#3b6ea5', '#3fa79a', '#a9cf54', '#fbe44a'].map(rgb);
const ramp = share => {
  const at = clamp(share, 0, 1) * (RAMP.length - 1), k = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[k].map((c, i) => c + (RAMP[k + 1][i] - c) * (at - k));
};
const VIEWS = { corner: [-0.5, 0.42], front: [0, 0], side: [Math.PI / 2, 0], top: [0, Math.PI / 2] };

// The camera: column-major 4 x 4 for a viewer at `eye` who looks at `focus`.
function lookFrom(eye, focus, up, angle, aspect, near, far) {
  const back = unit(eye.map((c, i) => c - focus[i])), right = unit(cross(up, back));
  const over = cross(back, right), f = 1 / Math.tan(angle / 2), depth = 1 / (near - far);
  const sx = f / aspect, a = (far + near) * depth, b = 2 * far * near * depth;
  const at = [-dot(right, eye), -dot(over, eye), -dot(back, eye)];
  return new Float32Array([
    sx * right[0], f * over[0], a * back[0], -back[0],
    sx * right[1], f * over[1], a * back[1], -back[1],
    sx * right[2], f * over[2], a * back[2], -back[2],
    sx * at[0], f * at[1], a * at[2] + b, -at[2]]);
}

// A scene in a canvas. `set(time)` shows a moment; drag, wheel and keys move the viewer.
class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl', { alpha: false, antialias: true });
    if (!this.gl) throw new Error('no WebGL');
    this.colouring = 'block';
    this.showWater = true;
    this.followed = null;
    this.pointers = new Map();
    this.program = this.compile();
    this.hear();
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
  }

  compile() {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, BLOCK_VERTEX], [gl.FRAGMENT_SHADER, BLOCK_FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'place');
    gl.bindAttribLocation(program, 1, 'normal');
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error('shaders fail');
    gl.useProgram(program);
    this.at = {};
    for (const name of ['camera', 'shift', 'turn', 'colour', 'lit'])
      this.at[name] = gl.getUniformLocation(program, name);
    return program;
  }

  // Takes a scene, frees the one before.
  load(scene) {
    const gl = this.gl;
    for (const mesh of [...(this.meshes || []), this.bed, this.frame, this.floor])
      if (mesh) [mesh.faces, mesh.lines].forEach(part => part && gl.deleteBuffer(part.buffer));
    this.scene = scene;
    this.times = unpack(scene.times, Float32Array);
    this.place = unpack(scene.place, Float32Array);
    this.turn = unpack(scene.turn, Int16Array);
    this.speed = unpack(scene.speed, Uint8Array);
    this.contacts = unpack(scene.contacts, Uint8Array);
    this.size = scene.high.map((c, i) => c - scene.low[i]);
    this.middle = scene.high.map((c, i) => (c + scene.low[i]) / 2);
    this.reach = Math.hypot(...this.size);
    this.meshes = scene.shapes.map(shape => this.mesh(shape));
    this.bed = scene.bed && this.mesh(scene.bed);
    this.buildTank();
    this.surface = scene.water && scene.water.height ? this.unpackSurface(scene.water) : null;
    this.followed = null;
    this.view('corner');
    this.set(this.times[0]);
  }

  buffer(values, count) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    return { buffer, count };
  }

  // Faces with a normal each, and the edges at which they bend.
  mesh(shape) {
    const points = unpack(shape.points, Float32Array), corners = unpack(shape.triangles, Uint32Array);
    const edges = unpack(shape.edges, Uint32Array), faces = [], lines = [];
    const point = k => [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map(k => point(corners[t + k]));
      const n = unit(cross(b.map((v, i) => v - a[i]), c.map((v, i) => v - a[i])));
      for (const p of [a, b, c]) faces.push(...p, ...n);
    }
    for (const k of edges) lines.push(...point(k), 0, 0, 1);
    return { faces: this.buffer(faces, corners.length), lines: this.buffer(lines, edges.length) };
  }

  buildTank() {
    const [x0, y0, z0] = this.scene.low, [x1, y1, z1] = this.scene.high, up = [0, 0, 1], lines = [];
    const line = (a, b) => lines.push(...a, ...up, ...b, ...up);
    for (const z of [z0, z1]) {
      line([x0, y0, z], [x1, y0, z]); line([x1, y0, z], [x1, y1, z]);
      line([x1, y1, z], [x0, y1, z]); line([x0, y1, z], [x0, y0, z]);
    }
    for (const [x, y] of [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) line([x, y, z0], [x, y, z1]);
    const floor = [[x0, y0], [x1, y0], [x1, y1], [x0, y0], [x1, y1], [x0, y1]];
    this.frame = { lines: this.buffer(lines, lines.length / 6) };
    this.floor = { faces: this.buffer(floor.flatMap(([x, y]) => [x, y, z0, ...up]), 6) };
  }

  unpackSurface(water) {
    return { times: unpack(water.times, Float32Array), x: unpack(water.x, Float32Array),
      y: unpack(water.y, Float32Array), height: unpack(water.height, Uint8Array),
      low: water.low, step: water.span / 255 };
  }

  view(name) {
    [this.yaw, this.pitch] = VIEWS[name];
    this.distance = null; // as far away as shows all
    this.offset = [0, 0, 0];
    this.draw();
  }

  // Frame before a time and the share of the way to the next.
  between(times, time) {
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const k = (low + high) >> 1; if (times[k] <= time) low = k; else high = k; }
    const share = high > low ? clamp((time - times[low]) / (times[high] - times[low]), 0, 1) : 0;
    return [low, high, share];
  }

  // Place and attitude (w, x, y, z) of a block at the present moment.
  pose(k) {
    const n = this.scene.bodies.length, [a, b, s] = this.moment;
    const i = 3 * (a * n + k), j = 3 * (b * n + k), p = 4 * (a * n + k), q = 4 * (b * n + k);
    const place = [0, 1, 2].map(c => this.place[i + c] * (1 - s) + this.place[j + c] * s);
    const turn = [0, 1, 2, 3].map(c => this.turn[p + c] * (1 - s) + this.turn[q + c] * s);
    return { place, turn: unit(turn) };
  }

  shown(k) {
    const release = this.scene.bodies[k].release;
    return release !== null && release <= this.time + 1e-9;
  }

  set(time) {
    this.time = clamp(time, this.times[0], this.times[this.times.length - 1]);
    this.moment = this.between(this.times, this.time);
    this.canvas.dataset.time = this.time.toFixed(4);
    this.draw();
  }

  colourOf(k) {
    const body = this.scene.bodies[k], n = this.scene.bodies.length, [a, b, s] = this.moment;
    const at = s < 0.5 ? a : b;
    if (this.colouring === 'speed') return ramp(Math.sqrt(this.speed[at * n + k] / 255));
    if (this.colouring === 'contacts') return ramp(this.contacts[at * n + k] / 5);
    return rgb(body.colour);
  }

  camera() {
    const aspect = this.canvas.width / this.canvas.height, angle = 0.5;
    const c = Math.cos(this.pitch), s = Math.sin(this.pitch);
    const away = [Math.sin(this.yaw) * c, -Math.cos(this.yaw) * c, s];
    const up = [-Math.sin(this.yaw) * s, Math.cos(this.yaw) * s, c], right = unit(cross(up, away));
    this.axes = { right, up, angle };
    this.fit = this.enough(right, up, away, Math.tan(angle / 2), aspect);
    if (this.distance === null) this.distance = this.fit;
    const base = this.followed === null ? this.middle : this.pose(this.followed).place;
    const focus = base.map((v, i) => v + this.offset[i]);
    const eye = focus.map((v, i) => v + this.distance * away[i]);
    return lookFrom(eye, focus, up, angle, aspect, this.distance / 50, this.distance + 3 * this.reach);
  }

  // The distance from which every corner of the tank is seen.
  enough(right, up, away, slope, aspect) {
    const { low, high } = this.scene, needed = [];
    for (const x of [low[0], high[0]]) for (const y of [low[1], high[1]]) for (const z of [low[2], high[2]]) {
      const p = [x, y, z].map((v, i) => v - this.middle[i]);
      needed.push(dot(p, away) + Math.max(Math.abs(dot(p, right)) / aspect, Math.abs(dot(p, up))) / slope);
    }
    return 1.06 * Math.max(...needed);
  }

  draw() {
    if (!this.scene || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    const gl = this.gl, canvas = this.canvas, scale = Math.min(devicePixelRatio || 1, 2);
    const wide = Math.round(canvas.clientWidth * scale), high = Math.round(canvas.clientHeight * scale);
    if (!wide || !high) return;
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    const style = getComputedStyle(canvas), ink = rgb(style.getPropertyValue('--stage-line').trim());
    gl.viewport(0, 0, wide, high);
    gl.clearColor(...rgb(style.getPropertyValue('--stage').trim()), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2, 2);
    gl.uniformMatrix4fv(this.at.camera, false, this.camera());
    this.put([0, 0, 0], [1, 0, 0, 0]);
    this.fill(this.floor.faces, gl.TRIANGLES, rgb(style.getPropertyValue('--stage-floor').trim()), 1, 0);
    this.fill(this.frame.lines, gl.LINES, ink, 1, 0);
    if (this.bed) this.fill(this.bed.faces, gl.TRIANGLES, rgb('#b7a78c'), 1, 1);
    this.scene.bodies.forEach((body, k) => {
      if (!this.shown(k)) return;
      const { place, turn } = this.pose(k), mesh = this.meshes[body.shape], colour = this.colourOf(k);
      this.put(place, turn);
      this.fill(mesh.faces, gl.TRIANGLES, colour, 1, 1);
      this.fill(mesh.lines, gl.LINES, colour.map(c => 0.35 * c), 1, 0);
    });
    this.put([0, 0, 0], [1, 0, 0, 0]);
    if (this.showWater && this.scene.water) this.paintWater();
  }

  put(shift, turn) {
    this.gl.uniform3fv(this.at.shift, shift);
    this.gl.uniform4fv(this.at.turn, turn);
  }

  fill(part, kind, colour, opacity, lit) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffer);
    for (const k of [0, 1]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
    }
    gl.uniform4f(this.at.colour, ...colour, opacity);
    gl.uniform1f(this.at.lit, lit);
    gl.drawArrays(kind, 0, part.count);
  }

  // The water up to its surface: a lid and four sides that one looks through.
  paintWater() {
    const gl = this.gl, values = this.waterFaces(), blue = [0.2, 0.5, 0.78];
    if (!this.wet) this.wet = this.buffer([], 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.wet.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.DYNAMIC_DRAW);
    this.wet.count = values.length / 6;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.fill(this.wet, gl.TRIANGLES, blue, 0.15, 0.4);
    gl.depthMask(true);
  }

  waterFaces() {
    const { low, high } = this.scene, s = this.surface, out = [];
    const x = s ? s.x : [low[0], high[0]], y = s ? s.y : [low[1], high[1]];
    const [a, b, share] = s ? this.between(s.times, this.time) : [0, 0, 0], n = x.length * y.length;
    const z = (i, j) => s ? s.low + s.step * (s.height[a * n + j * x.length + i] * (1 - share)
      + s.height[b * n + j * x.length + i] * share) : this.scene.water.level;
    const normal = (i, j) => {
      const i0 = Math.max(i - 1, 0), i1 = Math.min(i + 1, x.length - 1);
      const j0 = Math.max(j - 1, 0), j1 = Math.min(j + 1, y.length - 1);
      return unit([-(z(i1, j) - z(i0, j)) / (x[i1] - x[i0] || 1), -(z(i, j1) - z(i, j0)) / (y[j1] - y[j0] || 1), 1]);
    };
    const top = (i, j) => out.push(x[i], y[j], z(i, j), ...normal(i, j));
    const side = (i, j, k, l, n) => {
      const p = [x[i], y[j], z(i, j)], q = [x[k], y[l], z(k, l)];
      for (const v of [p, q, [q[0], q[1], low[2]], p, [q[0], q[1], low[2]], [p[0], p[1], low[2]]]) out.push(...v, ...n);
    };
    const nx = x.length - 1, ny = y.length - 1;
    for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
      top(i, j); top(i + 1, j); top(i + 1, j + 1);
      top(i, j); top(i + 1, j + 1); top(i, j + 1);
    }
    for (let i = 0; i < nx; i++) { side(i, 0, i + 1, 0, [0, -1, 0]); side(i, ny, i + 1, ny, [0, 1, 0]); }
    for (let j = 0; j < ny; j++) { side(0, j, 0, j + 1, [-1, 0, 0]); side(nx, j, nx, j + 1, [1, 0, 0]); }
    return out;
  }

  rotate(dx, dy) {
    this.yaw -= dx;
    this.pitch = clamp(this.pitch + dy, -0.2, Math.PI / 2);
    this.draw();
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.05 * this.fit, 4 * this.fit);
    this.draw();
  }

  pan(dx, dy) {
    const step = 2 * this.distance * Math.tan(this.axes.angle / 2) / this.canvas.clientHeight;
    this.offset = this.offset.map((v, i) => v + step * (dy * this.axes.up[i] - dx * this.axes.right[i]));
    this.draw();
  }

  // Drag turns, with Shift or the right button it shifts; two fingers zoom; the wheel zooms once
  // the picture was clicked, so that a page scrolls by it.
  hear() {
    const canvas = this.canvas, here = this.pointers;
    canvas.addEventListener('contextmenu', event => event.preventDefault());
    canvas.addEventListener('pointerdown', event => {
      here.set(event.pointerId, [event.clientX, event.clientY]);
      canvas.setPointerCapture(event.pointerId);
    });
    for (const kind of ['pointerup', 'pointercancel'])
      canvas.addEventListener(kind, event => here.delete(event.pointerId));
    canvas.addEventListener('pointermove', event => {
      const before = here.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY], d = now.map((v, i) => v - before[i]);
      const other = [...here].find(([id]) => id !== event.pointerId);
      here.set(event.pointerId, now);
      if (other) {
        const far = p => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
        this.zoom(far(before) / Math.max(far(now), 1));
      } else if (event.shiftKey || event.buttons & 2) this.pan(...d);
      else this.rotate(d[0] / 160, d[1] / 160);
    });
    canvas.addEventListener('wheel', event => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      this.zoom(Math.exp(clamp(event.deltaY, -200, 200) / 500));
    }, { passive: false });
    canvas.addEventListener('keydown', event => {
      const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (step) this.rotate(...step);
      else if (event.key === '+' || event.key === '=') this.zoom(0.9);
      else if (event.key === '-') this.zoom(1 / 0.9);
      else return;
      event.preventDefault();
    });
  }
}

// The buttons around a stage. Names of elements are classes inside `root`.
class Player {
  constructor(root) {
    const part = name => root.querySelector('.' + name);
    this.root = root;
    this.stage = new Stage(part('stage'));
    this.slider = part('slider');
    this.button = part('play');
    this.clock = part('clock');
    this.pace = part('pace');
    this.legend = part('legend');
    this.playing = false;
    this.follow = part('follow');
    const stage = this.stage;
    this.button.addEventListener('click', () => this.toggle());
    this.slider.addEventListener('input', () => { this.pause(); this.show(+this.slider.value); });
    part('colouring').addEventListener('change', event => { stage.colouring = event.target.value; this.explain(); stage.draw(); });
    this.follow.addEventListener('change', event => {
      stage.followed = event.target.value === '' ? null : +event.target.value;
      stage.offset = [0, 0, 0];
      stage.distance = stage.followed === null ? null : 0.45 * stage.fit;
      stage.draw();
    });
    this.wet = part('wet');
    this.wet.addEventListener('change', event => { stage.showWater = event.target.checked; stage.draw(); });
    root.querySelectorAll('[data-view]').forEach(b => b.addEventListener('click', () => stage.view(b.dataset.view)));
    root.querySelectorAll('[data-zoom]').forEach(b => b.addEventListener('click', () => stage.zoom(+b.dataset.zoom)));
    stage.canvas.addEventListener('keydown', event => {
      if (event.key !== ' ' || this.still) return;
      event.preventDefault();
      this.toggle();
    });
  }

  load(scene) {
    this.pause();
    this.stage.load(scene);
    const times = this.stage.times;
    [this.slider.min, this.slider.max] = [times[0], times[times.length - 1]];
    this.slider.step = 'any';
    this.still = times.length < 2;
    this.root.classList.toggle('still', this.still);
    this.follow.replaceChildren(new Option('whole tank', ''), ...scene.bodies
      .map((body, k) => [body, k]).filter(([body]) => !body.fixed && body.release !== null)
      .map(([body, k]) => new Option('block ' + body.number, k)));
    this.wet.closest('label').hidden = !scene.water;
    this.explain();
    this.show(times[0]);
  }

  show(time) {
    this.stage.set(time);
    this.slider.value = this.stage.time;
    this.clock.textContent = this.stage.time.toFixed(2) + ' s';
    this.slider.setAttribute('aria-valuetext', this.clock.textContent);
    if (!this.still) moveMarks(this.stage.time);
  }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  play() {
    const end = this.stage.times[this.stage.times.length - 1];
    if (this.stage.time >= end) this.show(this.stage.times[0]);
    this.playing = true;
    this.button.textContent = 'Pause';
    let last = performance.now();
    const step = now => {
      if (!this.playing) return;
      this.show(this.stage.time + (now - last) / 1000 * +this.pace.value);
      last = now;
      if (this.stage.time >= end) this.pause(); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    this.button.textContent = 'Play';
  }

  // What the colours mean.
  explain() {
    const { colouring, scene } = this.stage, css = c => `rgb(${c.map(v => Math.round(255 * v)).join()})`;
    const entry = (colour, words) => {
      const item = document.createElement('li'), box = document.createElement('i');
      box.style.background = colour;
      item.append(box, words);
      return item;
    };
    const entries = { block: [], speed: [0, 0.04, 0.16, 0.36, 0.64, 1].map(s =>
      entry(css(ramp(Math.sqrt(s))), (s * scene.fastest).toPrecision(2) + ' m/s')),
      contacts: [0, 1, 2, 3, 4, 5].map(n => entry(css(ramp(n / 5)), n < 5 ? `touches ${n}` : '5 or more')) };
    this.legend.replaceChildren(...entries[colouring]);
  }
}

// The marks in the charts that stand where the player is.
function moveMarks(time) {
  for (const mark of document.querySelectorAll('.now')) {
    const { left, right, from, to } = mark.dataset;
    const x = +left + (time - from) / (to - from) * (right - left);
    mark.setAttribute('x1', x);
    mark.setAttribute('x2', x);
    mark.removeAttribute('hidden');
  }
}

// A player, or the word that there can be none.
function startPlayer(root) {
  try {
    return new Player(root);
  } catch (problem) {
    root.classList.add('without');
    return null;
  }
}
const read = name => JSON.parse(document.getElementById(name).textContent);
