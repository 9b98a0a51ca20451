// Where bodies are at a frame: positions, normals, boxes, and what a ray meets.

class Geometry {
  constructor(run) {
    this.run = run;
    this.shapes = run.meshes.map(mesh => {
      const box = new Box();
      if (mesh.positions)
        for (let i = 0; i < mesh.positions.length; i += 3) box.extend(...mesh.positions.subarray(i, i + 3));
      return box;
    });
    this.scene = this.boxOfMovingBodies();
  }

  mesh(body) { return this.run.meshes[this.run.bodies[body].mesh]; }

  /// Of a rigid body: {position, rotation, velocity, spin}; the numbers of page_data.h.
  pose(body, frame) {
    const {row} = this.run.states[frame], at = this.run.bodies[body].row;
    return {
      position: [row[at], row[at + 1], row[at + 2]],
      rotation: rotationOf(row[at + 3], row[at + 4], row[at + 5], row[at + 6]),
      velocity: [row[at + 7], row[at + 8], row[at + 9]],
      spin: [row[at + 10], row[at + 11], row[at + 12]]
    };
  }

  /// Of a deformable body: x = center + extent (q / 65535 - 1/2), three numbers a position.
  points(body, frame) {
    const {row, bodies} = this.run.states[frame], {row: at, extent} = this.run.bodies[body];
    const q = bodies[body].positions, count = q.length / 3, x = new Float32Array(q.length);
    for (let axis = 0; axis < 3; ++axis) {
      const size = extent[axis] / 65535, start = row[at + axis] - 0.5 * extent[axis];
      for (let i = 0, k = axis * count; i < count; ++i, ++k) x[3 * i + axis] = start + size * q[k];
    }
    return x;
  }

  /// All positions of a body in the run's axes, m, three numbers each; of deformable and of rigid bodies.
  worldPositions(body, frame) {
    const {origin} = this.run, out = [];
    if (!this.run.bodies[body].isRigid) {
      const x = this.points(body, frame);
      for (let i = 0; i < x.length; ++i) out.push(x[i] + origin[i % 3]);
      return out;
    }
    const {position, rotation} = this.pose(body, frame), rest = this.mesh(body).positions;
    for (let i = 0; i < rest.length; i += 3)
      out.push(...add(add(rotate(rotation, rest.subarray(i, i + 3)), position), origin));
    return out;
  }

  /// Normals of a deformable body by index of normal: sums of the area vectors of the triangles around.
  normals(body, points) {
    const {corners, triangles, normalCount} = this.mesh(body), sums = new Float32Array(3 * normalCount);
    for (let t = 0; t < triangles.length; t += 3) {
      const i = 2 * triangles[t], j = 2 * triangles[t + 1], k = 2 * triangles[t + 2];
      const a = 3 * corners[i], b = 3 * corners[j], c = 3 * corners[k];
      const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
      const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
      const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      for (const n of [3 * corners[i + 1], 3 * corners[j + 1], 3 * corners[k + 1]]) {
        sums[n] += nx;
        sums[n + 1] += ny;
        sums[n + 2] += nz;
      }
    }
    return sums;  // the shader makes them unit vectors
  }

  /// The box around a body, in the page's coordinates; of a rigid one around its turned box.
  box(body, frame) {
    const {row} = this.run.states[frame], {row: at, isRigid, extent, mesh} = this.run.bodies[body], box = new Box();
    if (!isRigid) {
      for (const side of [-0.5, 0.5])
        box.extend(row[at] + side * extent[0], row[at + 1] + side * extent[1], row[at + 2] + side * extent[2]);
      return box;
    }
    const {position, rotation} = this.pose(body, frame), {low, high} = this.shapes[mesh];
    for (let i = 0; i < 8; ++i) {
      const corner = [i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]];
      box.extend(...add(rotate(rotation, corner), position));
    }
    return box;
  }

  boxOf(bodies, frame) {
    const all = new Box();
    for (const body of bodies) {
      const box = this.box(body, frame);
      all.extend(...box.low);
      all.extend(...box.high);
    }
    return all;
  }

  /// Around what moves at the first frame, or around all where nothing does.
  boxOfMovingBodies() {
    const all = this.run.bodies.map((_, i) => i), moving = all.filter(i => this.run.bodies[i].kind !== "static");
    return this.boxOf(moving.length ? moving : all, 0);
  }

  /// The middle of a body (center of mass of a rigid one, mean of the positions of a deformable one), in the run's
  /// axes, m.
  middle(body, frame) {
    const {row} = this.run.states[frame], {row: at, isRigid} = this.run.bodies[body], k = at + (isRigid ? 0 : 3);
    return add([row[k], row[k + 1], row[k + 2]], this.run.origin);
  }

  /// The velocity of the middle, m/s.
  velocity(body, frame) {
    const {row} = this.run.states[frame], {row: at, isRigid} = this.run.bodies[body], k = at + (isRigid ? 7 : 6);
    return [row[k], row[k + 1], row[k + 2]];
  }

  /// The largest strain of a deformable body, -1 where an element is inverted.
  strain(body, frame) { return this.run.states[frame].row[this.run.bodies[body].row + 10]; }

  /// The largest stress and the largest pressure of contact of a deformable body, Pa.
  stress(body, frame) { return this.run.states[frame].row[this.run.bodies[body].row + 14]; }
  pressure(body, frame) { return this.run.states[frame].row[this.run.bodies[body].row + 15]; }

  /// The force of contact on a body, N: the mean over the time since the frame before.
  contactForce(body, frame) {
    const {row} = this.run.states[frame], {row: at, isRigid} = this.run.bodies[body], k = at + (isRigid ? 13 : 11);
    return [row[k], row[k + 1], row[k + 2]];
  }

  /// The first body of those that the ray start + s direction (s > 0) meets: {body, distance, point}, or null.
  pick(start, direction, bodies, frame) {
    let best = null;
    for (const body of bodies) {
      if (!meetsBox(this.box(body, frame), start, direction, best ? best.distance : Infinity)) continue;
      const isRigid = this.run.bodies[body].isRigid, pose = isRigid ? this.pose(body, frame) : null;
      const s = this.distanceTo(
        this.mesh(body), isRigid ? this.mesh(body).positions : this.points(body, frame),
        isRigid ? rotateBack(pose.rotation, sub(start, pose.position)) : start,
        isRigid ? rotateBack(pose.rotation, direction) : direction);
      if (s < (best ? best.distance : Infinity)) best = {body, distance: s};
    }
    return best && {...best, point: add(start, scaled(direction, best.distance))};
  }

  /// The least s > 0 at which the ray meets a triangle (Moeller and Trumbore 1997), or Infinity.
  distanceTo({corners, triangles}, x, start, direction) {
    let least = Infinity;
    for (let t = 0; t < triangles.length; t += 3) {
      const ia = 3 * corners[2 * triangles[t]], ib = 3 * corners[2 * triangles[t + 1]];
      const ic = 3 * corners[2 * triangles[t + 2]];
      const a = [x[ia], x[ia + 1], x[ia + 2]];
      const u = [x[ib] - a[0], x[ib + 1] - a[1], x[ib + 2] - a[2]];
      const v = [x[ic] - a[0], x[ic + 1] - a[1], x[ic + 2] - a[2]];
      const p = cross(direction, v), det = dot(u, p);
      if (det === 0) continue;
      const to = sub(start, a), first = dot(to, p) / det;
      if (first < 0 || first > 1) continue;
      const q = cross(to, u), second = dot(direction, q) / det;
      if (second < 0 || first + second > 1) continue;
      const s = dot(v, q) / det;
      if (s > 0 && s < least) least = s;
    }
    return least;
  }
}

/// Whether the ray meets the box before the distance.
function meetsBox({low, high}, start, direction, before) {
  let from = 0, to = before;
  for (let axis = 0; axis < 3; ++axis) {
    const a = (low[axis] - start[axis]) / direction[axis], b = (high[axis] - start[axis]) / direction[axis];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;  // parallel to a face, in its plane
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
  }
  return from <= to;
}

/// Indices of the mesh's edges, two each: an edge that two triangles share stands once.
function edgesOf({corners, triangles}) {
  const seen = new Set(), edges = [];
  for (let t = 0; t < triangles.length; t += 3)
    for (let k = 0; k < 3; ++k) {
      const i = triangles[t + k], j = triangles[t + (k + 1) % 3], a = corners[2 * i], b = corners[2 * j];
      const key = a < b ? a * 4294967296 + b : b * 4294967296 + a;
      if (seen.has(key)) continue;
      seen.add(key);
      edges.push(i, j);
    }
  return new Uint32Array(edges);
}
