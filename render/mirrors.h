// Mirror images of bodies in bodies: for each of the most visible metallic bodies, six small pictures of the
// others as seen from its middle. The shading marches reflected rays through their distances.
#pragma once

#include <functional>
#include <vector>

#include "render/body_meshes.h"
#include "render/gl_objects.h"
#include "render/projection.h"

namespace duet::render {

class Mirrors {
 public:
  explicit Mirrors(const Gl& gl);

  // Chooses which bodies get pictures: those of `metallic` that cover most of the view.
  void choose(const BodyMeshes& meshes, const std::vector<bool>& metallic, const View& view);
  int mirror_of(int body) const;  // its place, -1 for none

  // Draws the pictures. `program` is in use and complete but for the view and `prepare`, which sets what is
  // special to a body before it is drawn.
  void draw(const BodyMeshes& meshes, const Program& program, const std::function<void(int body)>& prepare);

  // Sets the uniforms of the look-up and binds the pictures to texture units `first_unit` and the next.
  void bind(const Program& program, int first_unit) const;

 private:
  void draw_view(int layer, const View& view, int mirror, const BodyMeshes& meshes, const Program& program,
                 const std::function<void(int body)>& prepare);

  const Gl& gl_;
  Texture colors_, distances_, depth_;
  Framebuffer target_;
  std::vector<int> bodies_;    // by place
  std::vector<Vec3> centers_;  // m, by place
};

}  // namespace duet::render
