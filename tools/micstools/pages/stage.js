'use strict';
// Draws blocks, bed, tank and water of a scene at a moment: plain WebGL, nothing loaded. A scene is
// what motion.py packs: places count from the lower corner of the tank, `origin`. Bed and walls are
// see-through where they stand before a block.

const BLOCK_VERTEX = `
attribute vec3 place, normal;
uniform mat4 camera;
uniform vec3 shift;
uniform vec4 turn;
varying vec3 facing, here;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
void main() {
  facing = turned(normal);
  here = turned(place) + shift;
  gl_Position = camera * vec4(here, 1.0);
}`;
const BLOCK_FRAGMENT = `
precision highp float;
uniform vec4 colour;
uniform vec3 size;
uniform float lit, cut;
varying vec3 facing, here;
void main() {
  if (cut > 0.5 && (any(lessThan(here.xy, vec2(0.0))) || any(greaterThan(here.xy, size.xy)))) discard;
  vec3 n = normalize(facing);
  float sky = 0.5 + 0.5 * n.z;
  float sun = max(dot(n, normalize(vec3(-0.45, -0.6, 0.75))), 0.0);
  gl_FragColor = vec4(colour.rgb * mix(1.0, 0.42 + 0.28 * sky + 0.36 * sun, lit), colour.a);
}`;
// An edge is a strip of a width in pixels: lines of WebGL come out otherwise each time, or not at all.
const EDGE_VERTEX = `
attribute vec3 place, normal;
attribute float side;
uniform mat4 camera;
uniform vec3 shift;
uniform vec4 turn;
uniform vec2 picture;
uniform float width;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.yzw, cross(turn.yzw, v) + turn.x * v); }
vec4 seen(vec3 v) { return camera * vec4(turned(v) + shift, 1.0); }
vec4 before(vec4 p, vec4 q) {
  float least = 0.01 * max(p.w, q.w);
  return p.w < least ? mix(q, p, (q.w - least) / (q.w - p.w)) : p;
}
void main() {
  vec4 p = seen(place), q = seen(normal);
  vec4 from = before(p, q), to = before(q, p);
  vec2 way = (to.xy / to.w - from.xy / from.w) * picture;
  way = length(way) > 0.0 ? normalize(way) : vec2(1.0, 0.0);
  from.xy += side * width * vec2(-way.y, way.x) / picture * from.w;
  gl_Position = from;
}`;
const EDGE_FRAGMENT = `
precision mediump float;
uniform vec4 colour;
void main() { gl_FragColor = colour; }`;
const EDGE = 1.2; // pixels of the page
const BED = rgb('#b7a78c');
const VEIL = 0.3; // how much of a bed or wall is seen before a block

// A program of two shaders and where its uniforms are.
function compile(gl, vertex, fragment, uniforms) {
  const program = gl.createProgram(), at = {};
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, 'place');
  gl.bindAttribLocation(program, 1, 'normal');
  gl.bindAttribLocation(program, 2, 'side');
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error('shaders fail');
  for (const name of uniforms) at[name] = gl.getUniformLocation(program, name);
  return { program, at };
}

class Stage {
  constructor(canvas, over) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl', { alpha: false, antialias: true, stencil: true });
    if (!this.gl) throw new Error('no WebGL');
    this.faces = compile(this.gl, BLOCK_VERTEX, BLOCK_FRAGMENT,
      ['camera', 'shift', 'turn', 'colour', 'size', 'lit', 'cut']);
    this.edges = compile(this.gl, EDGE_VERTEX, EDGE_FRAGMENT,
      ['camera', 'shift', 'turn', 'colour', 'picture', 'width']);
    this.colouring = 'block';
    this.wet = 'clear'; // or 'speed', 'none'
    this.grab = null; // drags blocks in a flat view, where a page has that
    this.followed = null;
    this.water = new Water(this);
    this.overlay = new Overlay(this, over);
    this.layers = []; // what a page draws besides, with load, paint, write
    new Hands(this);
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
  }

  // Takes a scene, frees the one before. `keep`: looks at it as at that.
  load(scene, keep = false) {
    const gl = this.gl;
    for (const mesh of [...(this.meshes || []), this.bed, this.frame, this.floor]) this.free(mesh);
    this.scene = scene;
    this.times = unpack(scene.times, Float32Array);
    this.place = unpack(scene.place, Float32Array);
    this.turn = unpack(scene.turn, Int16Array);
    this.speed = unpack(scene.speed, Uint8Array);
    this.contacts = unpack(scene.contacts, Uint8Array);
    this.middle = scene.size.map(c => c / 2);
    this.reach = Math.hypot(...scene.size);
    this.meshes = scene.shapes.map(shape => this.mesh(shape));
    this.bed = scene.bed && this.mesh(scene.bed);
    this.buildTank();
    this.water.load(scene);
    this.overlay.load(scene);
    this.layers.forEach(layer => layer.load(scene));
    if (!keep) {
      this.followed = null;
      this.view('corner');
    }
    this.set(this.times[0]);
  }

  free(mesh) {
    if (mesh) [mesh.faces, mesh.lines].forEach(part => part && this.gl.deleteBuffer(part.buffer));
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
    const edges = unpack(shape.edges, Uint32Array), faces = [], ends = [];
    const point = k => [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map(k => point(corners[t + k]));
      const n = unit(cross(b.map((v, i) => v - a[i]), c.map((v, i) => v - a[i])));
      for (const p of [a, b, c]) faces.push(...p, ...n);
    }
    for (const k of edges) ends.push(point(k));
    let radius = 0;
    for (let k = 0; k < points.length; k += 3) radius = Math.max(radius, Math.hypot(...point(k / 3)));
    return { points, corners, radius, faces: this.buffer(faces, corners.length), lines: this.strips(ends) };
  }

  // Two triangles along each line, whose ends are one after another.
  strips(ends) {
    const values = [];
    for (let k = 0; k < ends.length; k += 2) {
      const [a, b] = [ends[k], ends[k + 1]], corner = (p, q, side) => values.push(...p, ...q, side);
      corner(a, b, 1); corner(a, b, -1); corner(b, a, -1);
      corner(a, b, -1); corner(b, a, 1); corner(b, a, -1);
    }
    return this.buffer(values, 3 * ends.length);
  }

  buildTank() {
    const [x0, y0, z0] = [0, 0, 0], [x1, y1, z1] = this.scene.size, up = [0, 0, 1], ends = [];
    const line = (a, b) => ends.push(a, b);
    for (const z of [z0, z1]) {
      line([x0, y0, z], [x1, y0, z]); line([x1, y0, z], [x1, y1, z]);
      line([x1, y1, z], [x0, y1, z]); line([x0, y1, z], [x0, y0, z]);
    }
    for (const [x, y] of [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) line([x, y, z0], [x, y, z1]);
    const floor = [[x0, y0], [x1, y0], [x1, y1], [x0, y0], [x1, y1], [x0, y1]];
    this.frame = { lines: this.strips(ends) };
    this.floor = { faces: this.buffer(floor.flatMap(([x, y]) => [x, y, z0, ...up]), 6) };
  }

  // Looks from a named side; front, side and top are without perspective.
  view(name) {
    [this.yaw, this.pitch] = VIEWS[name].turn;
    this.flat = VIEWS[name].axes || null;
    this.distance = null; // as far away as shows all
    this.offset = [0, 0, 0];
    this.measured = null;
    this.canvas.classList.toggle('flat', this.flat !== null);
    this.draw();
  }

  // Place and attitude (w, x, y, z) of a block at a moment, the present one by default; on the way
  // over a periodic side it goes on and comes in at the other.
  pose(k, moment = this.moment) {
    const n = this.scene.bodies.length, [a, b, s] = moment, { period } = this.scene;
    const i = 3 * (a * n + k), j = 3 * (b * n + k), p = 4 * (a * n + k), q = 4 * (b * n + k);
    const place = [0, 1, 2].map(c => {
      const step = this.place[j + c] - this.place[i + c], length = period[c];
      if (!length) return this.place[i + c] + s * step;
      const there = this.place[i + c] + s * (step - length * Math.round(step / length));
      return there - length * Math.floor(there / length);
    });
    const turn = [0, 1, 2, 3].map(c => this.turn[p + c] * (1 - s) + this.turn[q + c] * s);
    return { place, turn: unit(turn) };
  }

  shown(k) {
    const { release, exit } = this.scene.bodies[k];
    return release !== null && release <= this.time + 1e-9 && (exit == null || this.time < exit);
  }

  set(time) {
    this.time = clamp(time, this.times[0], this.times[this.times.length - 1]);
    this.moment = between(this.times, this.time);
    this.canvas.dataset.time = this.time.toFixed(4);
    this.draw();
  }

  colourOf(k) {
    const n = this.scene.bodies.length, [a, b, s] = this.moment;
    if (this.colouring === 'speed')
      return ramp(Math.sqrt((this.speed[a * n + k] * (1 - s) + this.speed[b * n + k] * s) / 255));
    if (this.colouring === 'contacts') return ramp(this.contacts[(s < 0.5 ? a : b) * n + k] / 5);
    return rgb(this.scene.bodies[k].colour);
  }

  // Sets `axes`, `focus` and `half`, half the height of what is seen at the focus; gives the matrix.
  camera() {
    const aspect = this.canvas.width / this.canvas.height, angle = 0.5, slope = Math.tan(angle / 2);
    const c = Math.cos(this.pitch), s = Math.sin(this.pitch);
    const away = [Math.sin(this.yaw) * c, -Math.cos(this.yaw) * c, s];
    const up = [-Math.sin(this.yaw) * s, Math.cos(this.yaw) * s, c], right = unit(cross(up, away));
    this.axes = { right, up, away };
    this.fit = this.enough(right, up, away, slope, aspect);
    if (this.distance === null) this.distance = this.fit;
    this.half = this.distance * slope;
    const base = this.followed === null ? this.middle : this.pose(this.followed).place;
    this.focus = base.map((v, i) => v + this.offset[i]);
    const axes = [right, up, away];
    if (this.flat) return inParallel(this.focus, axes, this.half, aspect, 2 * this.reach);
    const eye = this.focus.map((v, i) => v + this.distance * away[i]);
    return inPerspective(eye, axes, angle, aspect, this.distance / 50, this.distance + 3 * this.reach);
  }

  // The distance from which every corner of the tank is seen, and the rulers of a flat view.
  enough(right, up, away, slope, aspect) {
    const [wide, deep, tall] = this.scene.size, needed = [];
    for (const x of [0, wide]) for (const y of [0, deep]) for (const z of [0, tall]) {
      const p = [x, y, z].map((v, i) => v - this.middle[i]);
      needed.push((this.flat ? 0 : dot(p, away))
        + Math.max(Math.abs(dot(p, right)) / aspect, Math.abs(dot(p, up))) / slope);
    }
    return (this.flat ? 1.25 : 1.06) * Math.max(...needed);
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
    const style = getComputedStyle(canvas), colour = name => rgb(style.getPropertyValue(name).trim());
    this.matrix = this.camera();
    this.picture = [wide, high];
    this.edge = EDGE * scale;
    this.seen = this.overlay.numbers ? new BlockMap(this, canvas.clientWidth, canvas.clientHeight) : null;
    gl.viewport(0, 0, wide, high);
    gl.clearColor(...colour('--stage'), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    this.put([0, 0, 0], [1, 0, 0, 0]);
    gl.disable(gl.DEPTH_TEST); // the floor is behind all that stands on it, and hides nothing from below
    this.fill(this.floor.faces, colour('--stage-floor'));
    gl.enable(gl.DEPTH_TEST);
    gl.polygonOffset(2, 2);
    this.draft(this.frame.lines, colour('--stage-line'));
    gl.enable(gl.STENCIL_TEST); // 1 where a block is seen
    gl.stencilFunc(gl.ALWAYS, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    this.each(false, k => this.paintBlock(k, 1));
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    this.paintWalls(1);
    gl.stencilFunc(gl.EQUAL, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR); // one veil, whatever the layers
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.paintWalls(VEIL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.STENCIL_TEST);
    this.layers.forEach(layer => layer.paint(colour));
    if (this.water.shown && this.wet !== 'none') this.water.paint(this.matrix, this.wet === 'speed');
    this.overlay.paint(this.matrix, wide / scale, high / scale, scale, style);
  }

  // Every block that is there: the walls among them, or the others.
  each(walls, work) {
    this.scene.bodies.forEach((body, k) => { if (body.wall === walls && this.shown(k)) work(k); });
  }

  // Every block that bears a number: ghosts of those to come, too.
  numbered(work) {
    this.each(false, work);
    if (this.scene.plan) this.scene.bodies.forEach((body, k) => { if (!this.shown(k)) work(k); });
  }

  paintBlock(k, opacity) {
    const gl = this.gl, mesh = this.meshes[this.scene.bodies[k].shape], colour = this.colourOf(k);
    const { place, turn } = this.pose(k);
    this.put(place, turn);
    this.fill(mesh.faces, colour, opacity, 1);
    const seen = mesh.radius / (2 * this.half) * this.canvas.clientHeight; // where the focus is [pixels]
    if (opacity === 1 || seen > SMALL) this.draft(mesh.lines, colour.map(c => 0.35 * c), opacity);
  }

  paintWalls(opacity) {
    this.put([0, 0, 0], [1, 0, 0, 0]);
    if (this.bed) this.fill(this.bed.faces, BED, opacity, 1, 1);
    this.each(true, k => this.paintBlock(k, opacity));
  }

  // Where what is drawn next stands.
  put(shift, turn) {
    this.shift = shift;
    this.turned = turn;
  }

  // Place and normal of the bound buffer.
  point() {
    const gl = this.gl;
    for (const k of [0, 1]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
    }
    gl.disableVertexAttribArray(2);
  }

  begin({ program, at }, part, colour, opacity) {
    const gl = this.gl;
    gl.useProgram(program);
    gl.bindBuffer(gl.ARRAY_BUFFER, part.buffer);
    gl.uniformMatrix4fv(at.camera, false, this.matrix);
    gl.uniform3fv(at.shift, this.shift);
    gl.uniform4fv(at.turn, this.turned);
    gl.uniform4f(at.colour, ...colour, opacity);
    return at;
  }

  // Draws faces, a little farther away than their edges. `cut`: what stands out of the plan of the
  // tank is left out.
  fill(part, colour, opacity = 1, lit = 0, cut = 0) {
    const gl = this.gl, at = this.begin(this.faces, part, colour, opacity);
    this.point();
    gl.uniform3fv(at.size, this.scene.size);
    gl.uniform1f(at.lit, lit);
    gl.uniform1f(at.cut, cut);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.drawArrays(gl.TRIANGLES, 0, part.count);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  // Draws lines.
  draft(part, colour, opacity = 1) {
    const gl = this.gl, at = this.begin(this.edges, part, colour, opacity);
    for (const [k, size, offset] of [[0, 3, 0], [1, 3, 12], [2, 1, 24]]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, size, gl.FLOAT, false, 28, offset);
    }
    gl.uniform2fv(at.picture, this.picture);
    gl.uniform1f(at.width, this.edge);
    gl.drawArrays(gl.TRIANGLES, 0, part.count);
  }

  // The view is turned, and no longer flat.
  rotate(dx, dy) {
    if (this.flat) this.distance = null;
    this.flat = this.measured = null;
    this.canvas.classList.remove('flat');
    this.yaw -= dx;
    this.pitch = clamp(this.pitch + dy, -0.2, Math.PI / 2);
    this.draw();
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.05 * this.fit, 4 * this.fit);
    this.draw();
  }

  pan(dx, dy) {
    const step = 2 * this.half / this.canvas.clientHeight;
    this.offset = this.offset.map((v, i) => v + step * (dy * this.axes.up[i] - dx * this.axes.right[i]));
    this.draw();
  }

  // The point of a flat view under a place in the window, at the depth of the focus.
  under(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect(), step = 2 * this.half / box.height;
    const dx = step * (clientX - box.x - box.width / 2), dy = step * (box.y + box.height / 2 - clientY);
    return this.focus.map((v, i) => v + dx * this.axes.right[i] + dy * this.axes.up[i]);
  }
}
