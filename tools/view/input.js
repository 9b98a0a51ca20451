// Mouse, touch and keys.

const keyHelp = [
  ["Space", "play, pause"], ["Left, Right", "a frame back, on"], ["Up, Down", "ten frames back, on"],
  ["Home, End", "first, last frame"], ["+, -", "faster, slower"], ["C", "next color: look, strain, stress, speed, contact, contact pressure"],
  ["W", "wireframe"], ["S", "shadows"], ["N, P", "pick the next, the previous body"], ["Escape", "pick none"],
  ["F", "look at the picked body, or at all"], ["R", "the run's own camera"],
  ["Shift + arrows", "turn about the target"], ["Ctrl + arrows", "move sideways, up, down"],
  ["Page Up, Page Down", "nearer, farther"], ["H, ?", "this help"],
  ["Drag; one finger", "turn about the target"], ["Right drag, Shift + drag; two fingers", "move"],
  ["Wheel; pinch", "nearer, farther"], ["Click; tap", "pick a body"], ["Double click", "look at the body"],
  ["Click in a chart", "go to that frame"]
];

const stillPixels = 5;  // a pointer that moves less has clicked

/// Pointers on the canvas: they turn and move the camera, and pick.
class Pointers {
  constructor(canvas, {camera, changed, pick, lookAt}) {
    Object.assign(this, {canvas, camera, changed, pick});
    this.active = new Map();  // by the pointer's number: place and way so far
    canvas.addEventListener("pointerdown", event => this.down(event));
    canvas.addEventListener("pointermove", event => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, event => this.up(event));
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("dblclick", () => lookAt());
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      camera.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * (event.deltaMode ? 0.05 : 0.0015)))));
      changed();
    }, {passive: false});
  }
  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({preventScroll: true});
    this.active.set(event.pointerId, {x: event.clientX, y: event.clientY, way: 0});
    if (this.active.size > 1) for (const pointer of this.active.values()) pointer.way = Infinity;
  }
  move(event) {
    const pointer = this.active.get(event.pointerId);
    if (!pointer) return;
    const before = this.spread(), dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    pointer.way += Math.hypot(dx, dy);
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    if (pointer.way < stillPixels) return;
    const height = this.canvas.clientHeight, {camera} = this;
    if (this.active.size > 1) {
      const after = this.spread();
      if (before > 0 && after > 0) camera.zoom(before / after);
      camera.pan(dx / height / this.active.size, dy / height / this.active.size);
    } else if (event.buttons & 6 || event.shiftKey) {
      camera.pan(dx / height, dy / height);
    } else {
      camera.orbit(-4 * dx / height, 4 * dy / height);
    }
    this.changed();
  }
  up(event) {
    const pointer = this.active.get(event.pointerId);
    this.active.delete(event.pointerId);
    if (event.type === "pointerup" && pointer && pointer.way < stillPixels && event.button === 0)
      this.pick(event.clientX, event.clientY);
  }
  /// How far apart two fingers are, px; 0 without two.
  spread() {
    const [a, b] = this.active.values();
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }
}

/// Keys of the whole page, but those that a control with the focus needs itself.
function listenToKeys(player, camera, changed) {
  const turn = 0.06, shift = 0.04;
  const plain = {
    ArrowLeft: () => player.step(-1), ArrowRight: () => player.step(1), ArrowUp: () => player.step(-10),
    ArrowDown: () => player.step(10), Home: () => player.goTo(0), End: () => player.goTo(Infinity),
    " ": () => player.toggle(), "+": () => player.changeSpeed(1), "=": () => player.changeSpeed(1),
    "-": () => player.changeSpeed(-1), c: () => player.nextColor(), w: () => player.click("wireframe"),
    s: () => player.click("shadows"), n: () => player.pickNext(1), p: () => player.pickNext(-1),
    Escape: () => player.pick(-1), f: () => player.lookAt(), r: () => player.resetCamera(), h: () => player.help(),
    "?": () => player.help(), PageUp: () => camera.zoom(0.9), PageDown: () => camera.zoom(1 / 0.9)
  };
  const turning = {
    ArrowLeft: () => camera.orbit(-turn, 0), ArrowRight: () => camera.orbit(turn, 0),
    ArrowUp: () => camera.orbit(0, turn), ArrowDown: () => camera.orbit(0, -turn)
  };
  const moving = {
    ArrowLeft: () => camera.pan(shift, 0), ArrowRight: () => camera.pan(-shift, 0),
    ArrowUp: () => camera.pan(0, shift), ArrowDown: () => camera.pan(0, -shift)
  };
  document.addEventListener("keydown", event => {
    const {target, key} = event, isArrow = key.startsWith("Arrow");
    if (event.altKey || event.metaKey || byId("help").open) return;
    if (target.matches("input[type=search], input[type=number], select")) return;
    if (target.matches("button, summary, input[type=checkbox]") && (key === " " || key === "Enter")) return;
    if (event.ctrlKey && !isArrow) return;
    const act = isArrow && event.shiftKey ? turning[key] : isArrow && event.ctrlKey ? moving[key]
      : plain[key.length === 1 ? key.toLowerCase() : key];
    if (!act) return;
    event.preventDefault();
    act();
    changed();
  });
}

function fillHelp() {
  for (const [keys, what] of keyHelp) {
    const row = element("tr"), cell = element("td");
    keys.split(/(, |; )/).forEach(part => cell.append(/^[,;] $/.test(part) ? part : element("kbd", {}, part)));
    row.append(cell, element("td", {}, what));
    byId("keys").append(row);
  }
}
