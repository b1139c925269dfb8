'use strict';
// Numbers, colours and cameras of the player. Lengths in m, times in s; z is up.

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
const css = colour => `rgb(${colour.map(v => Math.round(255 * v)).join()})`;

// Colours from low to high that can be told apart in grey, too.
const RAMP = ['#2c2a6b', '#3b6ea5', '#3fa79a', '#a9cf54', '#fbe44a'].map(rgb);
const ramp = share => {
  const at = clamp(share, 0, 1) * (RAMP.length - 1), k = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[k].map((c, i) => c + (RAMP[k + 1][i] - c) * (at - k));
};

// Yaw and pitch of a view; in the flat ones which axis runs to the right and which up.
const VIEWS = {
  corner: { turn: [-0.5, 0.42] },
  front: { turn: [0, 0], axes: [0, 2] },
  side: { turn: [Math.PI / 2, 0], axes: [1, 2] },
  top: { turn: [0, Math.PI / 2], axes: [0, 1] },
};

// Frame before a time and the share of the way to the next.
function between(times, time) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) { const k = (low + high) >> 1; if (times[k] <= time) low = k; else high = k; }
  const share = high > low ? clamp((time - times[low]) / (times[high] - times[low]), 0, 1) : 0;
  return [low, high, share];
}

// The largest of 1, 2, 5, 10, ... times a power of ten that is not above a value > 0.
function roundBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find(step => step * power <= value * (1 + 1e-9)) * power;
}

// A length [m] in words, in the unit of the page: its `name`, and its `size` in m.
const inWords = (length, unit, digits = 3) => `${+(length / unit.size).toPrecision(digits)} ${unit.name}`;

// The camera, column-major 4 x 4, of a viewer who looks from `eye` along -back.
function inPerspective(eye, [right, up, back], angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2), depth = 1 / (near - far);
  const sx = f / aspect, a = (far + near) * depth, b = 2 * far * near * depth;
  const at = [-dot(right, eye), -dot(up, eye), -dot(back, eye)];
  return new Float32Array([
    sx * right[0], f * up[0], a * back[0], -back[0],
    sx * right[1], f * up[1], a * back[1], -back[1],
    sx * right[2], f * up[2], a * back[2], -back[2],
    sx * at[0], f * at[1], a * at[2] + b, -at[2]]);
}

// The same without perspective: what lies `half` above the focus is at the upper edge.
function inParallel(focus, [right, up, back], half, aspect, reach) {
  const sx = 1 / (half * aspect), sy = 1 / half, sz = -1 / reach;
  return new Float32Array([
    sx * right[0], sy * up[0], sz * back[0], 0,
    sx * right[1], sy * up[1], sz * back[1], 0,
    sx * right[2], sy * up[2], sz * back[2], 0,
    -sx * dot(right, focus), -sy * dot(up, focus), -sz * dot(back, focus), 1]);
}

// Where a point is seen: from -1 to 1 to the right and up; w is below 0 behind the viewer.
function seenAt(camera, p) {
  const row = k => camera[k] * p[0] + camera[4 + k] * p[1] + camera[8 + k] * p[2] + camera[12 + k];
  const w = row(3);
  return { x: row(0) / w, y: row(1) / w, w };
}
