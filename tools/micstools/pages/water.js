'use strict';
// The water up to its surface: a lid and four sides that one looks through, blue or in colours of
// the speed: on the lid that at the surface, on the sides the largest on the way across the tank.

const WATER_VERTEX = `
attribute vec3 place, normal;
uniform mat4 camera;
uniform vec3 size, across, upward;
varying vec3 facing;
varying vec2 at;
void main() {
  vec3 share = place / size;
  facing = normal;
  at = vec2(dot(share, across), dot(share, upward));
  gl_Position = camera * vec4(place, 1.0);
}`;
const WATER_FRAGMENT = `
precision mediump float;
uniform vec3 ramp[5];
uniform vec4 plain;
uniform float coloured;
uniform sampler2D map;
varying vec3 facing;
varying vec2 at;
void main() {
  float share = texture2D(map, at).r, k = 4.0 * share;
  vec3 colour = mix(ramp[0], ramp[1], clamp(k, 0.0, 1.0));
  colour = mix(colour, ramp[2], clamp(k - 1.0, 0.0, 1.0));
  colour = mix(colour, ramp[3], clamp(k - 2.0, 0.0, 1.0));
  colour = mix(colour, ramp[4], clamp(k - 3.0, 0.0, 1.0));
  float light = 0.85 + 0.15 * normalize(facing).z;
  gl_FragColor = mix(vec4(plain.rgb * light, plain.a), vec4(colour, 0.15 + 0.6 * share), coloured);
}`;
const MAPS = [['plan', [1, 0, 0], [0, 1, 0]], ['front', [1, 0, 0], [0, 0, 1]], ['side', [0, 1, 0], [0, 0, 1]]];

class Water {
  constructor(stage) {
    this.stage = stage;
    this.program = compile(stage.gl, WATER_VERTEX, WATER_FRAGMENT,
      ['camera', 'size', 'across', 'upward', 'ramp', 'plain', 'coloured', 'map']);
    this.buffer = stage.gl.createBuffer();
    this.textures = MAPS.map(() => stage.gl.createTexture());
  }

  // Takes the water of a scene; none: there is no water.
  load(scene) {
    const water = scene.water;
    this.scene = scene;
    this.shown = Boolean(water);
    this.surface = water && water.height ? { times: unpack(water.times, Float32Array),
      x: unpack(water.x, Float32Array), y: unpack(water.y, Float32Array),
      height: unpack(water.height, Uint8Array), low: water.low, step: water.span / 255 } : null;
    const s = water && water.speed;
    this.speed = s ? { times: unpack(s.times, Float32Array), fastest: s.fastest,
      maps: MAPS.map(([name]) => ({ ...s[name], values: unpack(s[name].values, Uint8Array) })) } : null;
  }

  paint(camera, coloured) {
    const stage = this.stage, gl = stage.gl, at = this.program.at;
    gl.useProgram(this.program.program);
    const { values, counts } = this.faces();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.DYNAMIC_DRAW);
    stage.point();
    gl.uniformMatrix4fv(at.camera, false, camera);
    gl.uniform3fv(at.size, this.scene.size);
    gl.uniform3fv(at.ramp, RAMP.flat());
    gl.uniform4f(at.plain, 0.2, 0.5, 0.78, 0.15);
    gl.uniform1f(at.coloured, coloured && this.speed ? 1 : 0);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    let first = 0;
    MAPS.forEach(([, across, upward], k) => {
      if (coloured && this.speed) this.upload(k); else this.bind(k, 1, 1, new Uint8Array(1));
      gl.uniform3fv(at.across, across);
      gl.uniform3fv(at.upward, upward);
      gl.drawArrays(gl.TRIANGLES, first, counts[k]);
      first += counts[k];
    });
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  // The map of the present moment, between two that were written.
  upload(k) {
    const { nx, ny, values } = this.speed.maps[k], n = nx * ny;
    const [a, b, share] = between(this.speed.times, this.stage.time), now = new Uint8Array(n);
    for (let i = 0; i < n; i++) now[i] = values[a * n + i] * (1 - share) + values[b * n + i] * share;
    this.bind(k, nx, ny, now);
  }

  bind(k, nx, ny, values) {
    const gl = this.stage.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.textures[k]);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.LUMINANCE, nx, ny, 0, gl.LUMINANCE, gl.UNSIGNED_BYTE, values);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
      gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    for (const way of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, way, gl.LINEAR);
  }

  // Triangles of the lid, of the front and back, and of the two sides.
  faces() {
    const { size } = this.scene, s = this.surface, out = [];
    const x = s ? s.x : [0, size[0]], y = s ? s.y : [0, size[1]];
    const [a, b, share] = s ? between(s.times, this.stage.time) : [0, 0, 0], n = x.length * y.length;
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
      for (const v of [p, q, [q[0], q[1], 0], p, [q[0], q[1], 0], [p[0], p[1], 0]]) out.push(...v, ...n);
    };
    const nx = x.length - 1, ny = y.length - 1;
    for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++) {
      top(i, j); top(i + 1, j); top(i + 1, j + 1);
      top(i, j); top(i + 1, j + 1); top(i, j + 1);
    }
    for (let i = 0; i < nx; i++) { side(i, 0, i + 1, 0, [0, -1, 0]); side(i, ny, i + 1, ny, [0, 1, 0]); }
    for (let j = 0; j < ny; j++) { side(0, j, 0, j + 1, [-1, 0, 0]); side(nx, j, nx, j + 1, [1, 0, 0]); }
    return { values: out, counts: [6 * nx * ny, 12 * nx, 12 * ny] };
  }
}
