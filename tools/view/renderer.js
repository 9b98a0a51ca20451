// Draws a frame of the run with WebGL 2. No library stands between: bodies with poses, vertices and colors are all there is
// to draw, the light is that of Duet's pictures, and the page needs no package where it is made, whatever version of
// three.js a system has (before release 150 or so it was a script, now it is modules, which a page from a file cannot load).

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.id = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(this.id, shader);
    }
    gl.linkProgram(this.id);
    if (!gl.getProgramParameter(this.id, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`a shader does not compile: ${gl.getProgramInfoLog(this.id)}`);
    this.places = new Map();
  }
  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.id, name));
    return this.places.get(name);
  }
  use() { this.gl.useProgram(this.id); }
  number(name, x) { this.gl.uniform1f(this.place(name), x); }
  integer(name, x) { this.gl.uniform1i(this.place(name), x); }
  vectors(name, x, size) { this.gl[`uniform${size}fv`](this.place(name), x); }
  vector(name, x) { this.gl.uniform3fv(this.place(name), x); }
  matrix(name, x) { this.gl.uniformMatrix4fv(this.place(name), false, x); }
  turn(x) { this.gl.uniformMatrix3fv(this.place("turn"), false, x); }
}

const patternNumbers = {checker: 1, stripes: 2};
const attribute = {position: 0, normal: 1, uv: 2, scalar: 3};
const modes = {look: 0, strain: 1, scalar: 2, rigidSpeed: 3, near: 4, gray: 5};  // of bodyFragment in shaders.js
const noTurn = [1, 0, 0, 0, 1, 0, 0, 0, 1];

class Renderer {
  constructor(canvas, run, geometry) {
    this.canvas = canvas;
    this.run = run;
    this.geometry = geometry;
    const gl = canvas.getContext("webgl2", {antialias: true, alpha: false});
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.programs = {
      body: new Program(gl, bodyVertex, bodyFragment), line: new Program(gl, bodyVertex, lineFragment),
      depth: new Program(gl, bodyVertex, depthFragment), ground: new Program(gl, groundVertex, groundFragment),
      sky: new Program(gl, skyVertex, skyFragment)
    };
    this.shadow = new ShadowMap(gl);
    this.meshes = run.meshes.map(mesh => this.uploadMesh(mesh));
    this.bodies = run.bodies.map((body, i) => this.makeBody(body, i));
    this.empty = gl.createVertexArray();
    const casters = run.lights.filter(light => light.shadow).sort((a, b) => b.power - a.power);
    this.caster = casters[0] || null;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
  }

  buffer(target, data, usage = this.gl.STATIC_DRAW) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, data, usage);
    return buffer;
  }

  uploadMesh(mesh) {
    const {gl} = this;
    gl.bindVertexArray(null);
    const gpu = {triangles: this.buffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles), count: mesh.triangles.length};
    if (mesh.uvs) gpu.uvs = this.buffer(gl.ARRAY_BUFFER, mesh.uvs);
    if (mesh.positions) {
      gpu.positions = this.buffer(gl.ARRAY_BUFFER, spread(mesh.positions, mesh.corners, 0));
      gpu.normals = this.buffer(gl.ARRAY_BUFFER, spread(mesh.normals, mesh.corners, 1));
    }
    return gpu;
  }

  /// Bodies with the same mesh share its buffers; each has a vertex array, for the numbers at its own vertices.
  makeBody(body, i) {
    const {gl} = this, mesh = this.meshes[body.mesh], look = this.run.looks[body.look];
    const gpu = {mesh, look, repeats: this.repeats(i, look), vertices: gl.createVertexArray(), scalars: gl.createBuffer()};
    gpu.positions = mesh.positions || gl.createBuffer();
    gpu.normals = mesh.normals || gl.createBuffer();
    gl.bindVertexArray(gpu.vertices);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    for (const [name, buffer, size] of [["position", gpu.positions, 3], ["normal", gpu.normals, 3], ["uv", mesh.uvs, 2]]) {
      if (!buffer) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(attribute[name]);
      gl.vertexAttribPointer(attribute[name], size, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, gpu.scalars);
    gl.vertexAttribPointer(attribute.scalar, 1, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.bindVertexArray(null);
    return gpu;
  }

  /// Bands of the look's pattern along the texture coordinates: whole periods of two, so that the pattern closes where
  /// the texture coordinates do. The meters a unit of these are a mean over the surface at the first frame.
  repeats(i, look) {
    const mesh = this.geometry.mesh(i);
    if (!mesh.uvs) return [1, 1];
    const x = this.run.bodies[i].isRigid ? mesh.positions : this.geometry.points(i, 0);
    const at = v => [x[3 * mesh.corners[2 * v]], x[3 * mesh.corners[2 * v] + 1], x[3 * mesh.corners[2 * v] + 2]];
    let sum = [0, 0], area = 0;
    for (let t = 0; t < mesh.triangles.length; t += 3) {
      const [a, b, c] = mesh.triangles.subarray(t, t + 3), u = mesh.uvs;
      const e = sub(at(b), at(a)), f = sub(at(c), at(a));
      const eu = u[2 * b] - u[2 * a], ev = u[2 * b + 1] - u[2 * a + 1];
      const fu = u[2 * c] - u[2 * a], fv = u[2 * c + 1] - u[2 * a + 1], det = eu * fv - ev * fu;
      if (Math.abs(det) < 1e-12) continue;
      const weight = norm(cross(e, f));
      sum[0] += weight * norm(sub(scaled(e, fv), scaled(f, ev))) / Math.abs(det);
      sum[1] += weight * norm(sub(scaled(f, eu), scaled(e, fu))) / Math.abs(det);
      area += weight;
    }
    return sum.map(s => 2 * Math.max(1, Math.round((area > 0 ? s / area : 1) / (2 * look.pattern_size))));
  }

  /// Hands over the numbers of a frame. `color`: one of `colors` of main.js.
  setFrame(frame, color) {
    const {gl} = this;
    this.frame = frame;
    this.run.bodies.forEach((body, i) => {
      const gpu = this.bodies[i], mesh = this.geometry.mesh(i);
      if (!body.isRigid) {
        const points = this.geometry.points(i, frame), normals = this.geometry.normals(i, points);
        gl.bindBuffer(gl.ARRAY_BUFFER, gpu.positions);
        gl.bufferData(gl.ARRAY_BUFFER, spread(points, mesh.corners, 0), gl.DYNAMIC_DRAW);
        gl.bindBuffer(gl.ARRAY_BUFFER, gpu.normals);
        gl.bufferData(gl.ARRAY_BUFFER, spread(normals, mesh.corners, 1), gl.DYNAMIC_DRAW);
      }
      this.setScalars(i, gpu, color);
    });
  }

  setScalars(i, gpu, color) {
    const {gl} = this, data = this.run.states[this.frame].bodies[i], mesh = this.geometry.mesh(i);
    const bytes = data[color === "contact" ? "near" : color];
    gl.bindVertexArray(gpu.vertices);
    if (bytes) {
      const values = new Uint8Array(mesh.vertexCount);
      for (let v = 0; v < values.length; ++v) values[v] = bytes[mesh.corners[2 * v]];
      gl.bindBuffer(gl.ARRAY_BUFFER, gpu.scalars);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(attribute.scalar);
    } else {
      gl.disableVertexAttribArray(attribute.scalar);
    }
    gl.bindVertexArray(null);
    [gpu.mode, gpu.largest] = this.modeOf(this.run.bodies[i], color);
  }

  /// How the shader makes the body's color, and the number that the largest byte stands for. Bodies without the numbers
  /// are gray.
  modeOf(body, color) {
    const {run} = this;
    switch (color) {
      case "strain": return body.strain ? [modes.strain, run.max_strain] : [modes.gray, 1];
      case "stress": return body.stress ? [modes.scalar, run.max_stress] : [modes.gray, 1];
      case "pressure": return body.isRigid ? [modes.gray, 1] : [modes.scalar, run.max_pressure];
      case "speed": return body.isRigid ? [modes.rigidSpeed, 1] : [modes.scalar, run.max_speed];
      case "contact": return [modes.near, 1];
      default: return [modes.look, 1];
    }
  }

  /// Draws the frame that was set. `how`: camera, shown (bodies), picked (body or -1), wireframe, shadows, top (of the
  /// scale of colors).
  draw(how) {
    const {gl, canvas} = this;
    const bounds = this.geometry.boxOf(how.shown, this.frame);
    if (bounds.isEmpty) bounds.extend(0, 0, 0);
    this.drawShadows(how, bounds);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    const view = how.camera.view(canvas.width / canvas.height, bounds, this.run.ground);
    this.drawSky(view);
    if (this.run.ground && view.eye[1] > this.run.ground.height) this.drawGround(view);
    this.drawBodies(view, how);
    if (how.wireframe) this.drawLines(view, how);
  }

  drawShadows(how, bounds) {
    // The map stays as it is while only the camera moves.
    const key = `${this.frame} ${how.shadows} ${how.shown}`;
    if (key === this.shadowKey) return;
    this.shadowKey = key;
    const program = this.programs.depth, isOff = !how.shadows;
    this.shadow.render(isOff ? null : this.caster, bounds.center, Math.max(bounds.radius, 1e-9), matrix => {
      program.use();
      program.matrix("projection", matrix);
      for (const i of how.shown) if (this.bodies[i].look.opacity > 0.5) this.drawBody(program, i, this.gl.TRIANGLES);
    });
  }

  /// Sets what lightSource of shaders.js reads.
  light(program, view) {
    const {gl, run} = this, lights = run.lights.slice(0, mostLights), place = [], color = [];
    for (const light of lights) {
      place.push(...light.position, light.radius);
      color.push(...scaled(light.color, light.power / (4 * Math.PI)), light === this.caster ? 1 : 0);
    }
    program.use();
    program.vector("eye", view.eye);
    program.integer("lightCount", lights.length);
    if (lights.length) {
      program.vectors("lightPlace", place, 4);
      program.vectors("lightColor", color, 4);
    }
    program.vector("zenith", run.sky.zenith);
    program.vector("horizon", run.sky.horizon);
    program.number("skyIntensity", run.sky.intensity);
    program.number("exposure", run.exposure);
    program.integer("hasGround", run.ground ? 1 : 0);
    program.number("groundHeight", run.ground ? run.ground.height : 0);
    program.vector("groundColor", run.ground ? this.groundColors().mean : [0, 0, 0]);
    program.integer("hasShadow", this.shadow.matrix ? 1 : 0);
    program.number("shadowTexel", this.shadow.texel || 0);
    program.matrix("toShadow", this.shadow.matrix || view.projection);
    program.integer("shadowMap", 0);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow.texture);
  }

  drawSky(view) {
    const {gl} = this, program = this.programs.sky;
    this.light(program, view);
    for (const key of ["forward", "right", "up"]) program.vector(key, view[key]);
    gl.bindVertexArray(this.empty);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthMask(true);
  }

  /// The colors of the ground's pattern and its width, m. A plain ground shows a faint one, by which its place is seen.
  groundColors() {
    const {color, color2, pattern, pattern_size: size} = this.run.ground;
    const second = pattern ? color2 : scaled(color, 0.94);
    return {first: color, second, mean: scaled(add(color, second), 0.5), size: pattern ? size : 2};
  }

  drawGround(view) {
    const {gl, run} = this, {ground, origin} = run, program = this.programs.ground;
    this.light(program, view);
    program.matrix("projection", view.projection);
    program.vector("middle", [view.eye[0], ground.height, view.eye[2]]);
    program.number("reach", view.far);
    program.number("fade", view.fade);
    const {first, second, size} = this.groundColors();
    program.vector("color", first);
    program.vector("color2", second);
    program.integer("pattern", patternNumbers[ground.pattern || "checker"] || 0);
    program.number("patternSize", size);
    program.number("roughness", ground.roughness);
    program.vectors("patternOrigin", [origin[0] / size % 2, origin[2] / size % 2], 2);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  drawBodies(view, how) {
    const {gl} = this, program = this.programs.body;
    this.light(program, view);
    program.matrix("projection", view.projection);
    program.number("top", how.top || 1);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);  // lines of the wireframe lie in front
    const isSolid = i => this.bodies[i].look.opacity >= 1 || this.bodies[i].mode !== modes.look;
    for (const i of how.shown) if (isSolid(i)) this.drawShaded(program, i, how, 1);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
    gl.depthMask(false);
    for (const i of how.shown) if (!isSolid(i)) this.drawShaded(program, i, how, this.bodies[i].look.opacity);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  drawShaded(program, i, how, opacity) {
    const {look, repeats, mode, largest} = this.bodies[i];
    program.vector("color", look.color);
    program.vector("color2", look.pattern || look.spots.length ? look.color2 : look.color);
    program.number("metallic", look.metallic);
    program.number("roughness", look.roughness);
    program.number("opacity", opacity);
    program.number("picked", i === how.picked ? 1 : 0);
    program.integer("pattern", patternNumbers[look.pattern] || 0);
    program.integer("mode", mode);
    program.number("largest", largest || 1);
    program.vectors("repeats", repeats, 2);
    program.integer("spotCount", look.spots.length);
    if (look.spots.length) program.vectors("spots", look.spots.flat(), 3);
    this.drawBody(program, i, this.gl.TRIANGLES);
  }

  drawLines(view, how) {
    const {gl} = this, program = this.programs.line;
    program.use();
    program.matrix("projection", view.projection);
    program.vectors("lineColor", [0, 0, 0, 0.55], 4);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE);
    for (const i of how.shown) this.drawBody(program, i, gl.LINES);
    gl.disable(gl.BLEND);
  }

  drawBody(program, i, primitive) {
    const {gl} = this, gpu = this.bodies[i], {mesh} = gpu;
    const pose = this.run.bodies[i].isRigid ? this.geometry.pose(i, this.frame) : null;
    program.turn(pose ? pose.rotation : noTurn);
    program.vector("place", pose ? pose.position : [0, 0, 0]);
    program.vector("velocity", pose ? pose.velocity : [0, 0, 0]);
    program.vector("spin", pose ? pose.spin : [0, 0, 0]);
    gl.bindVertexArray(gpu.vertices);
    if (primitive === gl.LINES) {
      if (!mesh.edges) {
        const edges = edgesOf(this.geometry.mesh(i));
        mesh.edgeCount = edges.length;
        mesh.edges = this.buffer(gl.ELEMENT_ARRAY_BUFFER, edges);
      }
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.edges);
      gl.drawElements(gl.LINES, mesh.edgeCount, gl.UNSIGNED_INT, 0);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    } else {
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
  }
}

/// Values by vertex, three numbers each, of values by position (which = 0) or by normal (which = 1).
function spread(values, corners, which) {
  const out = new Float32Array(corners.length / 2 * 3);
  for (let v = 0, c = which; c < corners.length; ++v, c += 2)
    for (let k = 0; k < 3; ++k) out[3 * v + k] = values[3 * corners[c] + k];
  return out;
}
