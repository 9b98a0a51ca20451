// Draws the bodies of one frame: the passes that shaders.h describes.
#pragma once

#include <cstdint>
#include <vector>

#include "render/body_meshes.h"
#include "render/gl_objects.h"
#include "render/looks.h"
#include "render/mirrors.h"
#include "render/projection.h"
#include "render/shadow_samples.h"
#include "sim/scene/camera_path.h"

namespace duet::render {

class SceneRenderer {
 public:
  // The context of `gl` must be current here, in draw and in the destructor. `gl` must outlive the renderer.
  // Throws Error(usage) when the scene asks for more than the shaders hold, FileError when the library is too
  // old.
  SceneRenderer(const Gl& gl, const scene::Scene& scene, const LookTable& looks);

  // 8-bit sRGB RGB, top row first. `looks_of_bodies`: places in the look table. `time`: seconds, of the
  // camera.
  std::vector<unsigned char> draw(const std::vector<BodySurface>& bodies,
                                  const std::vector<int>& looks_of_bodies, double time);

 private:
  void allocate_targets();
  void fill_looks();
  void fill_lights();
  void take_view(double time);
  double ground_height() const { return scene_.ground ? scene_.ground->height - origin_.y() : 0; }
  void set_view(const Program& program, const Vec2& range) const;
  void set_environment(const Program& program) const;
  Vec2 depth_range() const;
  void draw_shadow_maps();
  void draw_geometry(const std::vector<int>& looks_of_bodies, const Vec2& range);
  void draw_mirrors(const std::vector<int>& looks_of_bodies);
  void draw_visibility(const Vec2& range);
  void draw_shading(const Vec2& range);
  std::vector<unsigned char> read_picture();

  const Gl& gl_;
  const scene::Scene scene_;
  const LookTable looks_;
  const scene::CameraPath camera_path_;
  // Of the frame that is being drawn. All that goes to OpenGL, and the members below, is relative to the
  // place of the camera: floats are exact near the origin only.
  Vec3 origin_ = Vec3::Zero();  // m, where the camera is
  scene::Camera camera_;
  View view_;
  ShadowSampleSet samples_;
  const int tile_width_, tile_height_;  // of a ninth of the picture

  Program shadow_program_, geometry_program_, mirror_program_, visibility_program_, shading_program_;
  Texture shadow_maps_, surfaces_, depths_, shares_, keys_, picture_;
  Framebuffer shadow_target_, geometry_target_, visibility_target_, picture_target_;
  Buffer look_block_, light_block_, sample_block_;
  VertexArray nothing_;  // the screen triangle has no attributes
  BodyMeshes meshes_;
  Mirrors mirrors_;
  std::vector<std::uint16_t> pixels_;
};

}  // namespace duet::render
