// The camera: the run's own until it is moved, then around its target.

const radians = degrees => degrees * Math.PI / 180;

class Camera {
  constructor(described, scene) {
    this.described = described;
    this.scene = scene;  // box of what moves
    this.reset();
  }

  /// The run's own camera again, which follows its keyframes.
  reset() {
    this.isFree = false;
    this.take(this.described);
  }

  take({position, target, up, fov}) {
    this.position = position;
    this.target = target;
    this.upward = up;
    this.fov = fov;
  }

  setFrame(frame) {
    if (!this.isFree && this.described.motion) this.take(this.described.motion[frame]);
  }

  get axes() {
    const back = normalized(sub(this.position, this.target));
    let right = cross(this.upward, back);
    right = norm(right) < 1e-6 ? perpendicular(back) : normalized(right);
    return {back, right, up: cross(back, right)};
  }
  get distance() { return norm(sub(this.position, this.target)); }

  /// Turns about the target by angles in rad; it stops short of the directions straight up and down.
  orbit(around, over) {
    this.isFree = true;
    const {back, right} = this.axes, most = radians(89);
    const height = Math.asin(Math.max(-1, Math.min(1, dot(back, normalized(this.upward)))));
    const next = Math.max(-most, Math.min(most, height + over));
    let arm = turned(sub(this.position, this.target), right, height - next);
    arm = turned(arm, normalized(this.upward), around);
    this.position = add(this.target, arm);
  }

  /// Moves by fractions of the picture's height.
  pan(x, y) {
    this.isFree = true;
    const {right, up} = this.axes, size = 2 * this.distance * Math.tan(radians(this.fov) / 2);
    const by = add(scaled(right, -x * size), scaled(up, y * size));
    this.position = add(this.position, by);
    this.target = add(this.target, by);
  }

  /// Comes nearer to the target: at `factor` times the distance.
  zoom(factor) {
    this.isFree = true;
    const size = Math.max(this.scene.radius, 1e-6);
    const distance = Math.max(1e-3 * size, Math.min(1e4 * size, this.distance * factor));
    this.position = add(this.target, scaled(this.axes.back, distance));
  }

  /// Looks at the box from the same side.
  lookAt(box) {
    this.isFree = true;
    const distance = Math.max(1.2 * box.radius, 1e-6) / Math.sin(radians(Math.min(this.fov, 100)) / 2), {back} = this.axes;
    this.target = box.center;
    this.position = add(this.target, scaled(back, distance));
  }

  /// The tangent of half the vertical field of view. Where the window is narrower than the run's pictures, what these
  /// show from left to right stays in view.
  tangent(aspect) {
    const own = Math.tan(radians(this.fov) / 2);
    return aspect < this.described.aspect ? own * this.described.aspect / aspect : own;
  }

  /// What the renderer needs: the matrix, the eye, and half the picture's width and height at distance 1.
  view(aspect, bounds, ground) {
    const {back, right, up} = this.axes, tangent = this.tangent(aspect), away = norm(sub(bounds.center, this.position));
    const fade = 8 * this.distance;
    // From the nearest body on to the farthest, or to where the ground has faded.
    let near = Math.max(away - 1.05 * bounds.radius, 0.002 * this.distance);
    if (ground) near = Math.min(near, Math.max(0.3 * Math.abs(this.position[1] - ground.height), 0.002 * this.distance));
    const far = Math.max(away + 1.05 * bounds.radius, ground ? 4 * fade : 0, 2 * near);
    return {
      projection: product(perspective(tangent, aspect, near, far), viewMatrix(this.position, right, up, back)),
      eye: this.position, forward: scaled(back, -1), right: scaled(right, tangent * aspect), up: scaled(up, tangent),
      near, far, fade
    };
  }

  /// The direction of the ray through a place in the picture, from -1 to 1 to the right and up.
  ray(x, y, aspect) {
    const {back, right, up} = this.axes, tangent = this.tangent(aspect);
    return normalized(add(add(scaled(back, -1), scaled(right, x * tangent * aspect)), scaled(up, y * tangent)));
  }
}
