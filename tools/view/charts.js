// Charts of numbers by frame, as SVG, with the frame shown as a line in them.

const chartWidth = 300, chartHeight = 84, chartTop = 12, chartBottom = 72;
const pointsOfChart = 1200;  // of a line; of longer runs, the least and the greatest value of some frames each

/// A number for people: three digits.
function short(x) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "-";
  const size = Math.abs(x);
  if (size === 0) return "0";
  if (size >= 1e5 || size < 1e-3) return x.toExponential(2);
  return String(Number(x.toPrecision(3)));
}

function element(name, attributes = {}, text = "") {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

function svg(name, attributes = {}, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

class Chart {
  /// `frames`: numbers of the frames, of which `series` has {name, values}, null where there is none. `seek` is called
  /// with the number of a frame that is clicked at.
  constructor({title, unit, frames, series}, seek) {
    Object.assign(this, {frames, series});
    this.first = frames[0];
    this.last = Math.max(frames[frames.length - 1], this.first + 1);
    const values = series.flatMap(s => s.values.filter(Number.isFinite));
    this.low = values.reduce((a, b) => Math.min(a, b), 0);
    this.high = values.reduce((a, b) => Math.max(a, b), 0);
    if (this.high === this.low) this.high = this.low + 1;
    this.figure = element("figure");
    const caption = element("figcaption");
    caption.append(element("b", {}, unit ? `${title}, ${unit}` : title));
    this.outputs = series.map(({name}, i) => {
      const key = element("span", {class: `s${i + 1}`}), output = element("span");
      key.append(element("span", {class: series.length > 1 ? "key" : ""}, series.length > 1 ? `${name} ` : ""), output);
      caption.append(key);
      return output;
    });
    this.figure.append(caption, this.draw(title));
    this.listen(seek);
  }

  x(frame) { return chartWidth * (frame - this.first) / (this.last - this.first); }
  y(value) { return chartBottom - (chartBottom - chartTop) * (value - this.low) / (this.high - this.low); }

  draw(title) {
    this.svg = svg("svg", {viewBox: `0 0 ${chartWidth} ${chartHeight}`, preserveAspectRatio: "none", role: "img"});
    this.svg.setAttribute("aria-label", `${title} by frame, from ${short(this.low)} to ${short(this.high)}`);
    this.svg.append(svg("line", {class: "axis", x1: 0, x2: chartWidth, y1: this.y(0), y2: this.y(0)}));
    this.series.forEach(({values}, i) =>
      this.svg.append(svg("path", {class: `s${i + 1}`, d: this.path(values)})));
    this.cursor = svg("line", {class: "cursor", y1: chartTop - 4, y2: chartBottom + 4});
    this.svg.append(
      this.cursor, svg("text", {x: 0, y: 9}, short(this.high)),
      svg("text", {x: 0, y: chartHeight - 2}, this.low < 0 ? short(this.low) : `frame ${this.first}`),
      svg("text", {x: chartWidth, y: chartHeight - 2, "text-anchor": "end"}, String(this.last)));
    return this.svg;
  }

  /// "M0 1L2 3": values that are missing interrupt the line.
  path(values) {
    let text = "", isOpen = false;
    const visit = k => {
      if (Number.isFinite(values[k]))
        text += `${isOpen ? "L" : "M"}${this.x(this.frames[k]).toFixed(2)} ${this.y(values[k]).toFixed(2)}`;
      isOpen = Number.isFinite(values[k]);
    };
    const step = Math.ceil(2 * values.length / pointsOfChart);
    for (let i = 0; i < values.length; i += step) {
      if (step <= 2) {
        for (let k = i; k < Math.min(i + step, values.length); ++k) visit(k);
        continue;
      }
      let least = i, most = i;
      for (let k = i; k < Math.min(i + step, values.length); ++k) {
        if (values[k] < values[least]) least = k;
        if (values[k] > values[most]) most = k;
      }
      visit(Math.min(least, most));
      if (least !== most) visit(Math.max(least, most));
    }
    return text;
  }

  listen(seek) {
    const at = event => {
      const box = this.svg.getBoundingClientRect(), fraction = (event.clientX - box.left) / box.width;
      seek(this.first + Math.max(0, Math.min(1, fraction)) * (this.last - this.first));
    };
    this.svg.addEventListener("pointerdown", event => {
      this.svg.setPointerCapture(event.pointerId);
      at(event);
    });
    this.svg.addEventListener("pointermove", event => {
      if (event.buttons & 1) at(event);
    });
  }

  /// Shows where a frame is, and its values.
  show(frame) {
    const x = this.x(Math.max(this.first, Math.min(this.last, frame)));
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const k = this.frames.indexOf(frame);
    this.outputs.forEach((output, i) => output.textContent = k < 0 ? "-" : short(this.series[i].values[k]));
  }
}
