// Reflections of bodies in other bodies. For each of the most visible metallic bodies, six small pictures
// show the other bodies as seen from its center; the shading marches reflected rays through the distances in
// them.
#pragma once

#include <functional>
#include <vector>

#include "render/body_meshes.h"
#include "render/gl_objects.h"
#include "render/projection.h"

namespace duet::render {

/// Chooses mirroring bodies, draws the pictures of what they reflect, and gives these to the shading. The six
/// pictures of a body form a cube map that is stored as layers of an array texture.
class Mirrors {
 public:
  /// Allocates textures for shaders::max_mirrors bodies. `gl` must outlive the object.
  explicit Mirrors(const Gl& gl);

  /// Chooses the bodies that get pictures: up to shaders::max_mirrors of those with `metallic` set that cover
  /// most of `view`. `metallic` has one entry for each body of `meshes`.
  void choose(const BodyMeshes& meshes, const std::vector<bool>& metallic, const View& view);
  /// Returns the place of a body among the chosen ones; -1: it has no pictures.
  int mirror_of(int body) const;

  /// Draws the pictures of all chosen bodies. `program` must be in use, with all its uniforms set but those
  /// of the view, `projection` and `eye`. `prepare` is called before each body and sets the uniforms of that
  /// body. Leaves the viewport and the framebuffer changed.
  void draw(const BodyMeshes& meshes, const Program& program, const std::function<void(int body)>& prepare);

  /// Sets the uniforms with which `program` looks up reflections, and binds the colors to the texture unit
  /// `first_unit` and the distances to the next one. `program` must be in use.
  void bind(const Program& program, int first_unit) const;

 private:
  // Draws all bodies but `mirror` into one layer.
  void draw_view(int layer, const View& view, int mirror, const BodyMeshes& meshes, const Program& program,
                 const std::function<void(int body)>& prepare);

  const Gl& gl_;
  Texture colors_, distances_, depth_;
  Framebuffer target_;
  std::vector<int> bodies_;    // bodies that have pictures, those that cover most first
  std::vector<Vec3> centers_;  // m, centers of their boxes, relative to the origin of the meshes
};

}  // namespace duet::render
