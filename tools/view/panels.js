// What stands beside the picture: bodies, the picked one, the run's numbers, the legend.

const byId = id => document.getElementById(id);

/// The color of the scale's fraction t, as bodyFragment of shaders.js has it, for CSS.
function colorOf(t, color) {
  const mix = (a, b, s) => a.map((x, i) => x + (b[i] - x) * s);
  const low = [0.02, 0.10, 0.42], middle = [0.03, 0.36, 0.28], high = [1.0, 0.72, 0.05];
  let c = t < 0.5 ? mix(low, middle, 2 * t) : mix(middle, high, 2 * t - 1);
  if (color === "contact") c = mix([0.42, 0.42, 0.42], [0.9, 0.16, 0.02], Math.min(t / 0.6, 1));
  return cssOf(c);
}

/// A color of linear light for CSS.
function cssOf(linear) {
  const encoded = linear.map(x => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  return `rgb(${encoded.map(x => Math.round(255 * Math.max(0, Math.min(1, x)))).join(" ")})`;
}

/// Charts of the whole run, and what it says of itself.
class RunPanel {
  constructor(run, seek) {
    this.stats = run.stats;
    this.charts = [];
    for (const note of [...run.notes, `Simulated by ${run.program}`]) byId("notes").append(element("p", {}, note));
    if (!run.stats || run.stats.frame.length === 0) return;
    const {stats} = run, {frame} = stats, total = frame.map((_, i) =>
      ["kinetic", "potential", "elastic"].reduce((sum, key) => sum + (stats[key][i] === null ? NaN : stats[key][i]), 0));
    const add = (title, unit, series) => {
      if (!series.some(s => s.values.some(Number.isFinite))) return;
      const chart = new Chart({title, unit, frames: frame, series}, seek);
      byId("charts").append(chart.figure);
      this.charts.push(chart);
    };
    add("Energy", "J", [
      {name: "kinetic", values: stats.kinetic}, {name: "potential", values: stats.potential},
      {name: "elastic", values: stats.elastic}, {name: "total", values: total}
    ]);
    add("Contacts", "", [{name: "contacts", values: stats.contacts}]);
    const penetration = [{name: "penetration", values: stats.max_penetration}];
    if (stats.drawn_penetration.some(Number.isFinite))
      penetration.push({name: "of drawn surfaces", values: stats.drawn_penetration});
    add("Deepest penetration", "m", penetration);
    add("Steps a frame", "", [{name: "steps", values: stats.substeps}]);
    add("Time to simulate a frame", "s", [{name: "seconds", values: stats.seconds}]);
  }
  show(frame) { for (const chart of this.charts) chart.show(frame); }
}

/// The list of bodies: a box to show or hide each, and a button to pick it.
class BodyList {
  constructor(run, changed, pick) {
    this.shown = new Set(run.bodies.map((_, i) => i));
    this.rows = run.bodies.map((body, i) => {
      const row = element("li"), box = element("input", {type: "checkbox", "aria-label": `Show ${body.name}`});
      box.checked = true;
      box.addEventListener("change", () => {
        this.shown[box.checked ? "add" : "delete"](i);
        changed();
      });
      const swatch = element("span", {class: "swatch"});
      swatch.style.background = cssOf(run.looks[body.look].color);
      const button = element("button", {type: "button", "aria-pressed": "false", title: body.name}, body.name);
      button.addEventListener("click", () => pick(i));
      row.append(box, swatch, button, element("small", {}, body.kind));
      return {row, box, button, name: body.name.toLowerCase()};
    });
    byId("bodies").append(...this.rows.map(({row}) => row));
    byId("body-count").textContent = `(${run.bodies.length})`;
    const filter = byId("filter");
    filter.addEventListener("input", () => {
      for (const {row, name} of this.rows) row.hidden = !name.includes(filter.value.toLowerCase());
    });
    const set = isShown => {
      this.rows.forEach(({row, box}, i) => {
        if (row.hidden) return;
        box.checked = isShown;
        this.shown[isShown ? "add" : "delete"](i);
      });
      changed();
    };
    byId("show-all").addEventListener("click", () => set(true));
    byId("hide-all").addEventListener("click", () => set(false));
  }
  mark(picked) {
    this.rows.forEach(({button}, i) => button.setAttribute("aria-pressed", String(i === picked)));
    if (picked < 0) return;
    // Only the list scrolls, not all that stands beside the picture.
    const list = byId("bodies"), {row} = this.rows[picked], top = row.offsetTop - list.offsetTop;
    if (top < list.scrollTop || top + row.offsetHeight > list.scrollTop + list.clientHeight)
      list.scrollTop = top - list.clientHeight / 2;
  }
}

/// The picked body: its numbers at the frame, and over time.
class BodyPanel {
  constructor(run, geometry, seek) {
    Object.assign(this, {run, geometry, seek, charts: [], body: -1});
    this.pick(-1);
  }
  pick(body) {
    const host = byId("selection"), {run, geometry} = this;
    this.body = body;
    this.charts = [];
    this.outputs = {};
    host.replaceChildren();
    if (body < 0) {
      host.append(element("p", {}, "Click a body, or choose it in the list below, to see its numbers."));
      return;
    }
    const {name, kind, mesh, strain, isRigid} = run.bodies[body], list = element("dl");
    const row = (key, text) => {
      const output = element("dd", {}, text);
      list.append(element("dt", {}, key), output);
      return output;
    };
    row("name", name);
    row("kind", kind);
    row("surface", `${run.meshes[mesh].positionCount} vertices, ${run.meshes[mesh].triangleCount} triangles`);
    for (const key of [isRigid ? "center of mass, m" : "mean position, m", "velocity, m/s", "speed, m/s"]) this.outputs[key] = row(key, "");
    if (isRigid) this.outputs["angular speed, rad/s"] = row("angular speed, rad/s", "");
    for (const {name: key, isThere} of this.loads()) if (isThere(run.bodies[body])) this.outputs[key] = row(key, "");
    host.append(list);
    const frames = run.states.map((_, i) => i), number = frames.map(i => run.frames[i]);
    const add = (title, unit, series) => {
      const chart = new Chart({title, unit, frames: number, series}, this.seek);
      host.append(chart.figure);
      this.charts.push(chart);
    };
    const middles = frames.map(i => geometry.middle(body, i));
    add("Position", "m", ["x", "y", "z"].map((axis, k) => ({name: axis, values: middles.map(x => x[k])})));
    add("Speed", "m/s", [{name: "speed", values: frames.map(i => norm(geometry.velocity(body, i)))}]);
    for (const {title, unit, isThere, value} of this.loads())
      if (isThere(run.bodies[body])) add(title, unit, [{name: title.toLowerCase(), values: frames.map(i => value(body, i))}]);
  }
  /// What bodies have besides their motion: the key of the number, the chart, whether a body has it, the value at a frame.
  loads() {
    const {run, geometry} = this, hasLoads = run.max_pressure !== null;
    return [
      {name: "largest strain", title: "Largest strain", unit: "", isThere: body => body.strain,
       value: (body, i) => geometry.strain(body, i) < 0 ? NaN : geometry.strain(body, i)},
      {name: "largest stress, Pa", title: "Largest stress", unit: "Pa", isThere: body => body.stress,
       value: (body, i) => geometry.stress(body, i)},
      {name: "force of contact, N", title: "Force of contact", unit: "N", isThere: body => hasLoads && body.kind !== "static",
       value: (body, i) => norm(geometry.contactForce(body, i))},
      {name: "contact pressure, Pa", title: "Largest contact pressure", unit: "Pa", isThere: body => hasLoads && !body.isRigid,
       value: (body, i) => geometry.pressure(body, i)}
    ];
  }
  show(i) {
    if (this.body < 0) return;
    const {geometry, body, outputs, run} = this, v = geometry.velocity(body, i), {isRigid} = run.bodies[body];
    const three = x => x.map(short).join(", ");
    outputs[isRigid ? "center of mass, m" : "mean position, m"].textContent = three(geometry.middle(body, i));
    outputs["velocity, m/s"].textContent = three(v);
    outputs["speed, m/s"].textContent = short(norm(v));
    if (isRigid) outputs["angular speed, rad/s"].textContent = short(norm(geometry.pose(body, i).spin));
    for (const {name, value} of this.loads())
      if (outputs[name]) outputs[name].textContent = Number.isNaN(value(body, i)) ? "an element is inverted" : short(value(body, i));
    if (outputs["force of contact, N"]) outputs["force of contact, N"].textContent = three(geometry.contactForce(body, i));
    for (const chart of this.charts) chart.show(run.frames[i]);
  }
}

/// The scale of the colors, whose end can be set.
class Legend {
  constructor(run, geometry, changed) {
    this.run = run;
    this.geometry = geometry;
    this.tops = {
      strain: run.max_strain > 0 ? Math.min(run.max_strain, Math.max(run.strain_range, 1e-6)) : 1,
      speed: this.usual(i => run.bodies[i].kind !== "static", (i, frame) => this.speed(i, frame), run.max_speed),
      stress: run.stress_range || this.usual(i => run.bodies[i].stress, (i, frame) => geometry.stress(i, frame), run.max_stress),
      pressure: run.pressure_range ||
        this.usual(i => !run.bodies[i].isRigid, (i, frame) => geometry.pressure(i, frame), run.max_pressure)
    };
    this.input = byId("legend-top");
    this.input.addEventListener("change", () => {
      const value = Number(this.input.value);
      if (value > 0) this.tops[this.color] = value;
      this.show(this.color);
      changed();
    });
  }
  /// m/s, of the center of a rigid body, or the largest of a deformable one.
  speed(body, frame) {
    const {isRigid, row} = this.run.bodies[body];
    return isRigid ? norm(this.geometry.velocity(body, frame)) : this.run.states[frame].row[row + 9];
  }
  /// The value below which those of the bodies are in 95 of 100 cases that are not 0: a single jump would leave all others
  /// dark.
  usual(isMeant, value, most) {
    const bodies = this.run.bodies.map((_, i) => i).filter(isMeant);
    const all = bodies.flatMap(i => this.run.states.map((_, frame) => value(i, frame))).filter(x => x > 0);
    all.sort((a, b) => a - b);
    return Number((all[Math.floor(0.95 * (all.length - 1))] || most || 1).toPrecision(2));
  }
  get top() { return this.tops[this.color] || 1; }
  show(color) {
    this.color = color;
    byId("legend").hidden = color === "look";
    if (color === "look") return;
    const near = `${short(100 * this.run.near_fraction)} % of the size of the smaller body`;
    byId("legend-name").textContent = {
      strain: "Strain, largest |stretch - 1|", stress: "Stress, Pa", speed: "Speed, m/s",
      contact: "Near another body or the ground", pressure: "Contact pressure, Pa"
    }[color];
    byId("legend-note").textContent = {
      strain: "Red: an element is inverted. Gray: the body has no strain.",
      stress: "Von Mises' equivalent of the elastic stress. Gray: the body has no stress.",
      speed: "The speed of each vertex, by translation, rotation and deformation.",
      contact: `Red: a vertex touches; gray: it is farther away than ${near}.`,
      pressure: "The mean over the time since the frame before. Gray: a rigid body, see its force of contact."
    }[color];
    const stops = Array.from({length: 13}, (_, i) => colorOf(i / 12, color));
    byId("legend-bar").style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    byId("legend-scale").hidden = color === "contact";
    byId("legend-scale").style.display = color === "contact" ? "none" : "";
    this.input.value = short(this.top);
  }
}
