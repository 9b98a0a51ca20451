// The data of the page: what page_data.h describes, unpacked.

/// The bytes of base 64 without line ends.
function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const values = new Uint8Array(128);
  const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (let i = 0; i < 64; ++i) values[letters.charCodeAt(i)] = i;
  const padding = text.endsWith("==") ? 2 : text.endsWith("=") ? 1 : 0;
  const bytes = new Uint8Array(text.length / 4 * 3 - padding);
  for (let i = 0, at = 0; i < text.length; i += 4) {
    const group = values[text.charCodeAt(i)] << 18 | values[text.charCodeAt(i + 1)] << 12 |
      values[text.charCodeAt(i + 2)] << 6 | values[text.charCodeAt(i + 3)];
    bytes[at++] = group >> 16;
    bytes[at++] = group >> 8;  // beyond the end, an assignment does nothing
    bytes[at++] = group;
  }
  return bytes;
}

/// The block's bytes, from its element, which is emptied: its text would stay in memory otherwise.
async function takeBlock(element) {
  const packed = fromBase64(element.textContent);
  element.remove();
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/// Reads bytes from front to back.
class ByteReader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  get isAtEnd() { return this.at >= this.bytes.length; }
  byte() { return this.bytes[this.at++]; }
  take(count) {
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }
  floats(count) { return new Float32Array(this.take(4 * count).slice().buffer); }
  indices(count) { return new Uint32Array(this.take(4 * count).slice().buffer); }
}

/// FloatRows of packing.h.
class FloatRows {
  constructor(size) { this.bits = new Uint32Array(size); }
  next(reader) {
    const size = this.bits.length, bytes = reader.take(4 * size);
    for (let i = 0; i < size; ++i)
      this.bits[i] ^= bytes[i] | bytes[size + i] << 8 | bytes[2 * size + i] << 16 | bytes[3 * size + i] << 24;
    return new Float32Array(this.bits.slice().buffer);
  }
}

/// ByteRows of packing.h.
class ByteRows {
  constructor(size) { this.before = new Uint8Array(size); }
  next(reader) {
    const row = reader.take(this.before.length).slice();
    for (let i = 0; i < row.length; ++i) row[i] += this.before[i];
    return this.before = row;
  }
}

/// PositionRows of packing.h. A row has all x, then all y, then all z.
class PositionRows {
  constructor(size) {
    this.size = size;
    this.before = new Uint16Array(3 * size);
    this.beforeThat = new Uint16Array(3 * size);
  }
  next(reader) {
    const {size, before, beforeThat} = this, way = reader.byte(), row = new Uint16Array(3 * size);
    const goesOn = way & 1, likeNeighbor = way & 2;
    for (let axis = 0; axis < 3; ++axis) {
      const low = reader.take(size), high = reader.take(size);
      for (let i = 0, k = axis * size, last = 0; i < size; ++i, ++k) {
        const folded = low[i] | high[i] << 8;
        let off = folded >>> 1 ^ -(folded & 1);
        if (likeNeighbor) off += last;
        last = off;
        row[k] = before[k] + off + (goesOn ? before[k] - beforeThat[k] : 0);
      }
    }
    this.beforeThat = before;
    return this.before = row;
  }
}

const numbersOfBody = 16;  // in a frame's row

/// The frames in their order: each has `row`, the numbers of all bodies, and `bodies`, for each body its
/// `positions` (16 bits a coordinate), `speed`, `strain`, `stress`, `near` and `pressure` (bytes), where it has them.
class FrameReader {
  constructor(run) {
    this.run = run;
    this.rows = new FloatRows(run.rowSize);
    this.bodies = run.bodies.map(body => {
      const size = run.meshes[body.mesh].positionCount;
      return {
        positions: body.isRigid ? null : new PositionRows(size),
        speed: body.isRigid ? null : new ByteRows(size),
        strain: body.strain ? new ByteRows(size) : null,
        stress: body.stress ? new ByteRows(size) : null,
        near: new ByteRows(size),
        pressure: !body.isRigid && run.max_pressure !== null ? new ByteRows(size) : null
      };
    });
  }
  next(reader) {
    const frame = {row: this.rows.next(reader), bodies: this.bodies.map(() => ({}))};
    this.bodies.forEach((rows, i) => {
      for (const key of ["positions", "speed", "strain", "stress"]) if (rows[key]) frame.bodies[i][key] = rows[key].next(reader);
    });
    for (const key of ["near", "pressure"])
      this.bodies.forEach((rows, i) => {
        if (rows[key] && reader.byte()) frame.bodies[i][key] = rows[key].next(reader);
      });
    return frame;
  }
}

function readMesh(described, isRigid, reader) {
  const mesh = {
    positionCount: described.positions, vertexCount: described.vertices, normalCount: described.normals,
    triangleCount: described.triangles
  };
  if (isRigid) {
    mesh.positions = reader.floats(3 * described.positions);
    mesh.normals = reader.floats(3 * described.normals);
  }
  mesh.corners = reader.indices(2 * described.vertices);
  if (described.uv) mesh.uvs = reader.floats(2 * described.vertices);
  mesh.triangles = reader.indices(3 * described.triangles);
  return mesh;
}

/// The run of the page. `progress` is called with the fraction that is done; in between, the page is drawn.
async function readRun(progress) {
  const run = JSON.parse(document.getElementById("run").textContent);
  const blocks = [...document.querySelectorAll("script.block")];
  run.states = [];
  if (blocks.length === 0) return run;
  let size = 0;
  for (const body of run.bodies) {
    body.isRigid = body.kind !== "deformable";
    body.row = size;
    size += numbersOfBody;
  }
  run.rowSize = size;
  const meshReader = new ByteReader(await takeBlock(blocks[0]));
  run.meshes = run.meshes.map((described, i) =>
    readMesh(described, run.bodies.find(body => body.mesh === i).isRigid, meshReader));
  const frames = new FrameReader(run);
  for (let i = 1; i < blocks.length; ++i) {
    progress(i / blocks.length);
    await new Promise(resolve => setTimeout(resolve));
    const reader = new ByteReader(await takeBlock(blocks[i]));
    while (!reader.isAtEnd) run.states.push(frames.next(reader));
  }
  return run;
}
