// The page: it unpacks the run, draws the frame that is shown, and plays.

const speeds = [0.1, 0.25, 0.5, 1, 2, 4];
const colors = {
  look: "as in pictures", strain: "strain", stress: "stress", speed: "speed", contact: "contact", pressure: "contact pressure"
};

class Player {
  constructor(run) {
    this.run = run;
    this.frame = 0;     // index of the frame shown
    this.picked = -1;
    this.isPlaying = false;
    this.isDirty = true;
    this.time = 0;      // s of the run, while it plays
    const seek = number => this.goTo(this.indexOf(number));
    this.runPanel = new RunPanel(run, seek);
    if (run.states.length) this.makeView(seek);
    this.makeControls();
    this.goTo(0);
    requestAnimationFrame(now => this.tick(now));
  }

  makeView(seek) {
    const {run} = this, canvas = byId("view");
    this.geometry = new Geometry(run);
    this.camera = new Camera(run.camera, this.geometry.scene);
    this.list = new BodyList(run, () => this.changed(), body => this.pick(body));
    this.bodyPanel = new BodyPanel(run, this.geometry, seek);
    this.legend = new Legend(run, this.geometry, () => this.changed());
    new Pointers(canvas, {
      camera: this.camera, changed: () => this.changed(), lookAt: () => this.lookAt(),
      pick: (x, y) => this.pick(this.bodyAt(x, y))
    });
    try {
      this.renderer = new Renderer(canvas, run, this.geometry);
    } catch (problem) {
      byId("status").textContent = `No picture: ${problem.message}. The charts and numbers work.`;
      return;
    }
    new ResizeObserver(() => this.changed()).observe(canvas);
    canvas.addEventListener("webglcontextlost", event => {
      event.preventDefault();
      byId("status").textContent = "The graphics processor has been taken away; the picture comes back with it.";
      this.renderer = null;
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.renderer = new Renderer(canvas, run, this.geometry);
      byId("status").textContent = "";
      this.goTo(this.frame);
    });
  }

  makeControls() {
    const on = (id, event, act) => byId(id).addEventListener(event, act);
    for (const value of speeds) byId("speed").append(new Option(`${value} x`, value));
    byId("speed").value = "1";
    for (const [value, name] of Object.entries(colors)) byId("color").append(new Option(name, value));
    this.offerColors();
    byId("scrub").max = this.run.frames.length - 1;
    on("scrub", "input", () => this.goTo(Number(byId("scrub").value)));
    on("color", "change", () => this.goTo(this.frame));
    on("first", "click", () => this.goTo(0));
    on("back", "click", () => this.step(-1));
    on("play", "click", () => this.toggle());
    on("forth", "click", () => this.step(1));
    on("last", "click", () => this.goTo(Infinity));
    on("wireframe", "change", () => this.changed());
    on("shadows", "change", () => this.changed());
    on("reset", "click", () => this.resetCamera());
    on("focus", "click", () => this.lookAt());
    on("help-button", "click", () => this.help());
    fillHelp();
    listenToKeys(this, this.camera || new Camera({position: [0, 0, 1], target: [0, 0, 0], up: [0, 1, 0], fov: 30, aspect: 1}, new Box()), () => this.changed());
  }

  /// Colors of numbers that the run does not have cannot be chosen.
  offerColors() {
    const {run} = this, isSoft = body => !body.isRigid;
    const lacks = {
      strain: !run.bodies.some(body => body.strain) && "no body has it",
      stress: !run.bodies.some(body => body.strain) ? "no body has it" : run.max_stress === null && "not in this run",
      pressure: !run.bodies.some(isSoft) ? "no body has it" : run.max_pressure === null && "not in this run"
    };
    for (const option of byId("color").options) {
      const lack = lacks[option.value];
      option.disabled = run.states.length === 0 || Boolean(lack);
      if (lack) option.textContent = `${colors[option.value]} (${lack})`;
    }
  }

  changed() { this.isDirty = true; }

  /// The index of the frame with the number, or of the nearest one before it.
  indexOf(number) {
    let i = 0;
    while (i + 1 < this.run.frames.length && this.run.frames[i + 1] <= number + 1e-6) ++i;
    return i;
  }

  show(index) {
    const {run} = this;
    this.frame = Math.max(0, Math.min(run.frames.length - 1, index));
    const number = run.frames[this.frame], seconds = (number / run.fps).toFixed(3);
    byId("scrub").value = this.frame;
    byId("scrub").setAttribute("aria-valuetext", `frame ${number}, ${seconds} s`);
    byId("frame-text").textContent = `frame ${number} of ${run.frames[run.frames.length - 1]}, ${seconds} s`;
    this.runPanel.show(number);
    if (!this.geometry) return;
    this.camera.setFrame(this.frame);
    this.bodyPanel.show(this.frame);
    this.legend.show(byId("color").value);
    if (this.renderer) this.renderer.setFrame(this.frame, byId("color").value);
    this.changed();
  }

  goTo(index) {
    this.show(index);
    this.time = this.run.frames[this.frame] / this.run.fps;
  }
  step(by) {
    this.setPlaying(false);
    this.goTo(this.frame + by);
  }

  setPlaying(isPlaying) {
    this.isPlaying = isPlaying;
    byId("play").textContent = isPlaying ? "||" : "\u25B6";
    byId("play").setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  }
  toggle() {
    if (!this.isPlaying && this.frame === this.run.frames.length - 1) this.goTo(0);
    this.setPlaying(!this.isPlaying);
  }
  changeSpeed(by) {
    const next = byId("speed").selectedIndex + by;
    if (next >= 0 && next < speeds.length) byId("speed").selectedIndex = next;
  }
  nextColor() {
    const select = byId("color"), {options} = select;
    for (let i = 1; i <= options.length; ++i) {
      const next = (select.selectedIndex + i) % options.length;
      if (options[next].disabled) continue;
      select.selectedIndex = next;
      break;
    }
    this.goTo(this.frame);
  }
  click(id) { byId(id).click(); }
  help() { byId("help").showModal(); }

  shownBodies() { return this.list ? [...this.list.shown].sort((a, b) => a - b) : []; }

  /// The body under a place of the window, or -1.
  bodyAt(x, y) {
    const box = byId("view").getBoundingClientRect();
    const across = 2 * (x - box.left) / box.width - 1, up = 1 - 2 * (y - box.top) / box.height;
    const hit = this.geometry.pick(
      this.camera.position, this.camera.ray(across, up, box.width / box.height), this.shownBodies(), this.frame);
    const {ground} = this.run, ray = this.camera.ray(across, up, box.width / box.height);
    const toGround = ground ? (ground.height - this.camera.position[1]) / ray[1] : Infinity;
    if (!hit || (toGround > 0 && ray[1] < 0 && toGround < hit.distance * (1 - 1e-6))) return -1;
    return hit.body;
  }
  pick(body) {
    if (!this.geometry) return;
    this.picked = body;
    this.list.mark(body);
    this.bodyPanel.pick(body);
    this.bodyPanel.show(this.frame);
    this.changed();
  }
  pickNext(by) {
    const count = this.run.bodies.length;
    if (count) this.pick(this.picked < 0 ? (by > 0 ? 0 : count - 1) : (this.picked + by + count) % count);
  }
  lookAt() {
    if (!this.geometry) return;
    this.camera.lookAt(this.picked < 0 ? this.geometry.boxOf(this.shownBodies(), this.frame) : this.geometry.box(this.picked, this.frame));
    this.changed();
  }
  resetCamera() {
    if (!this.geometry) return;
    this.camera.reset();
    this.camera.setFrame(this.frame);
    this.changed();
  }

  tick(now) {
    const passed = Math.min((now - (this.before || now)) / 1000, 0.25);
    this.before = now;
    if (this.isPlaying) this.play(passed * Number(byId("speed").value));
    if (this.isDirty && this.renderer) this.draw();
    requestAnimationFrame(next => this.tick(next));
  }

  play(seconds) {
    const {frames, fps} = this.run, end = frames[frames.length - 1] / fps;
    this.time += seconds;
    if (this.time > end + 1 / fps && byId("loop").checked) this.time = frames[0] / fps;
    const index = this.indexOf(this.time * fps);
    if (index !== this.frame) this.show(index);
    if (this.time >= end && !byId("loop").checked) this.setPlaying(false);
  }

  draw() {
    const canvas = byId("view"), ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    this.isDirty = false;
    this.renderer.draw({
      camera: this.camera, shown: this.shownBodies(), picked: this.picked, wireframe: byId("wireframe").checked,
      shadows: byId("shadows").checked, top: this.legend.top
    });
  }
}

function describeRun(run) {
  byId("title").textContent = run.title;
  document.title = run.title;
  const count = (n, one, many) => `${n} ${n === 1 ? one : many}`;
  byId("summary").textContent = `${count(run.frames.length, "frame", "frames")} of ` +
    `${count(run.bodies.length, "body", "bodies")}, ${run.fps} frames a second`;
}

/// What tests read: the page's own state, and positions as the page has them.
function testAccess(player) {
  const {run, geometry} = player;
  return {
    frameCount: run.frames.length, frames: run.frames, bodies: run.bodies.map(({name}) => name),
    positions: (name, index) => geometry.worldPositions(run.bodies.findIndex(body => body.name === name), index),
    /// Where the middle of the body is in the window, px.
    place: name => {
      const canvas = byId("view"), box = canvas.getBoundingClientRect(), body = run.bodies.findIndex(b => b.name === name);
      const x = sub(geometry.middle(body, player.frame), run.origin), m = player.camera.view(box.width / box.height, geometry.scene, run.ground).projection;
      const at = row => m[row] * x[0] + m[4 + row] * x[1] + m[8 + row] * x[2] + m[12 + row];
      return [box.left + box.width * (0.5 + 0.5 * at(0) / at(3)), box.top + box.height * (0.5 - 0.5 * at(1) / at(3))];
    },
    picked: () => player.picked < 0 ? null : run.bodies[player.picked].name,
    eye: () => player.camera.position, frame: () => run.frames[player.frame], goTo: index => player.goTo(index), isDrawn: () => !player.isDirty
  };
}

(async () => {
  const status = byId("status");
  status.textContent = "Unpacking";
  try {
    const run = await readRun(done => status.textContent = `Unpacking: ${Math.round(100 * done)} %`);
    status.textContent = run.states.length ? "" : "The run has no motion of bodies: its statistics are on the right.";
    describeRun(run);
    const player = new Player(run);
    window.duetView = testAccess(player);
  } catch (problem) {
    status.textContent = `The page cannot be shown: ${problem.message}`;
  }
})();
