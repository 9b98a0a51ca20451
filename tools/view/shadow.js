// The shadows of one light: a map of the distances of the bodies from it.

const shadowSide = 2048;  // texels; twice as many take four times as long on processors without graphics

class ShadowMap {
  constructor(gl) {
    this.gl = gl;
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, shadowSide, shadowSide);
    for (const [key, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE], [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE],
      [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL]
    ]) gl.texParameteri(gl.TEXTURE_2D, key, value);
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /// Draws with draw(matrix) what stands in the light, whose bodies are within the sphere. Sets `matrix`, from the
  /// world to the map, and `texel`, the width of a texel at distance 1. Without a light outside the sphere there is
  /// no shadow, and the matrix is null.
  render(light, center, radius, draw) {
    const {gl} = this;
    this.matrix = null;
    if (!light) return;
    const away = sub(light.position, center), distance = norm(away);
    if (distance < 1.1 * radius) return;
    const back = normalized(away), right = perpendicular(back), up = cross(back, right);
    const tangent = radius / Math.sqrt(distance * distance - radius * radius);
    this.texel = 2 * tangent / shadowSide;
    this.matrix = product(
      perspective(tangent, 1, Math.max(distance - radius, 0.01 * distance), distance + radius),
      viewMatrix(light.position, right, up, back));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, shadowSide, shadowSide);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 4);
    draw(this.matrix);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }
}
