// Draws the bodies of one frame, in the passes that shaders.h describes.
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

/// Draws frames of one scene into pictures. Holds the programs, the targets of all passes and what stays
/// equal from frame to frame.
class SceneRenderer {
 public:
  /// Compiles the programs and allocates the targets for the size of scene.render. The context of `gl` must
  /// be current here, in draw() and in the destructor, and `gl` must outlive the renderer. Throws Error
  /// (usage) if the scene asks for more than the shaders or OpenGL hold, FileError if the OpenGL library is
  /// too old.
  SceneRenderer(const Gl& gl, const scene::Scene& scene, const LookTable& looks);

  /// Draws `bodies` as the camera sees them at `time` (s), and returns 3 * width * height bytes of 8-bit sRGB
  /// in rows from the top. `looks_of_bodies` has the place in the look table for every body. Throws Error
  /// (files) if OpenGL reports an error.
  std::vector<unsigned char> draw(const std::vector<BodySurface>& bodies,
                                  const std::vector<int>& looks_of_bodies, double time);

 private:
  void allocate_targets();
  void fill_looks();
  void fill_lights();
  // Moves the camera to its place at `time` (s) and makes that the origin of everything that is drawn.
  void take_view(double time);
  // m, relative to origin_; 0 without ground.
  double ground_height() const { return scene_.ground ? scene_.ground->height - origin_.y() : 0; }
  // Sets the uniforms with which a pass over the screen finds surfaces. `range`: nearest and farthest
  // distance (m).
  void set_view(const Program& program, const Vec2& range) const;
  // Sets the uniforms of ground, sky, lights and shadow maps. The program must be in use.
  void set_environment(const Program& program) const;
  // Nearest and farthest distance of bodies along the view (m), a little widened.
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
  // The following four members belong to the frame that is being drawn. They, and all that goes to OpenGL,
  // are relative to the position of the camera, because floats are exact near the origin only.
  Vec3 origin_ = Vec3::Zero();  // m, world frame: position of the camera
  scene::Camera camera_;
  View view_;
  ShadowSampleSet samples_;

  // Size of a tile of the visibility target (pixels): each of the nine tiles holds every ninth pixel.
  const int tile_width_, tile_height_;

  Program shadow_program_, geometry_program_, mirror_program_, visibility_program_, shading_program_;
  // Targets of the passes: depths of all shadow samples; packed surfaces and depths of the samples of the
  // picture; light that arrives with and without shadows, and the surfaces for which it was computed; the
  // picture.
  Texture shadow_maps_, surfaces_, depths_, shares_, keys_, picture_;
  Framebuffer shadow_target_, geometry_target_, visibility_target_, picture_target_;
  Buffer look_block_, light_block_, sample_block_;
  VertexArray nothing_;  // without attributes: the triangle over the screen needs none
  BodyMeshes meshes_;
  Mirrors mirrors_;
  std::vector<std::uint16_t> pixels_;
};

}  // namespace duet::render
