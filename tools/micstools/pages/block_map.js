'use strict';
// Which block is seen where, on squares of a few pixels: a depth buffer in plain JavaScript, since
// reading the picture back from WebGL halts it.

const SQUARE = 4; // pixels of the page
const SMALL = 7; // pixels: a block of a smaller radius bears no number, and hides none

class BlockMap {
  // Of the blocks of a stage in a picture so large; bed and walls are see-through.
  constructor(stage, wide, high) {
    this.w = Math.ceil(wide / SQUARE);
    this.h = Math.ceil(high / SQUARE);
    this.number = new Int32Array(this.w * this.h); // from 1; 0: none
    this.depth = new Float32Array(this.w * this.h).fill(Infinity);
    const pixels = high / (2 * stage.half);
    stage.numbered(k => {
      const { place, turn } = stage.pose(k), shape = stage.meshes[stage.scene.bodies[k].shape];
      const middle = seenAt(stage.matrix, place), near = stage.flat ? 1 : stage.distance / middle.w;
      const radius = shape.radius * pixels * near;
      const outside = Math.abs(middle.x) > 1 + 2 * radius / wide || Math.abs(middle.y) > 1 + 2 * radius / high;
      if (middle.w > 0 && radius >= SMALL && !outside) this.add(k + 1, shape, place, turn, stage.matrix);
    });
  }

  // The number of the block at a square, rows from the top.
  at(x, y) { return this.number[y * this.w + x]; }

  add(number, shape, place, [qw, qx, qy, qz], m) {
    const { points, corners } = shape, seen = new Float32Array(points.length);
    for (let i = 0; i < points.length; i += 3) {
      const [x, y, z] = [points[i], points[i + 1], points[i + 2]];
      const tx = qy * z - qz * y + qw * x, ty = qz * x - qx * z + qw * y, tz = qx * y - qy * x + qw * z;
      const px = place[0] + x + 2 * (qy * tz - qz * ty), py = place[1] + y + 2 * (qz * tx - qx * tz);
      const pz = place[2] + z + 2 * (qx * ty - qy * tx), w = m[3] * px + m[7] * py + m[11] * pz + m[15];
      if (w <= 0) return; // the viewer is in it
      seen[i] = (1 + (m[0] * px + m[4] * py + m[8] * pz + m[12]) / w) / 2 * this.w - 0.5;
      seen[i + 1] = (1 - (m[1] * px + m[5] * py + m[9] * pz + m[13]) / w) / 2 * this.h - 0.5;
      seen[i + 2] = (m[2] * px + m[6] * py + m[10] * pz + m[14]) / w;
    }
    for (let t = 0; t < corners.length; t += 3)
      this.triangle(number, seen, 3 * corners[t], 3 * corners[t + 1], 3 * corners[t + 2]);
  }

  // Fills the squares whose middle is in a triangle, where nothing is nearer.
  triangle(number, seen, a, b, c) {
    const ax = seen[a], ay = seen[a + 1], bx = seen[b], by = seen[b + 1], cx = seen[c], cy = seen[c + 1];
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (!area) return;
    const first = (...values) => Math.max(0, Math.ceil(Math.min(...values)));
    const last = (n, ...values) => Math.min(n - 1, Math.floor(Math.max(...values)));
    const x0 = first(ax, bx, cx), x1 = last(this.w, ax, bx, cx), y1 = last(this.h, ay, by, cy);
    for (let y = first(ay, by, cy); y <= y1; y++) for (let x = x0; x <= x1; x++) {
      const u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area;
      const v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area, w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) continue;
      const z = u * seen[a + 2] + v * seen[b + 2] + w * seen[c + 2], i = y * this.w + x;
      if (z < this.depth[i]) [this.depth[i], this.number[i]] = [z, number];
    }
  }
}
