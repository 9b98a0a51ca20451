/// Surfaces for formats whose vertices have one normal and one texture coordinate each: a position at an edge
/// is there several times.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// All exported bodies as one mesh. The vertices of a body follow each other in the order of its positions.
struct SplitSurfaces {
  struct Vertex {
    int body = 0;                          ///< index in ExportedRun::bodies
    int position = 0, uv = 0, normal = 0;  ///< indices into the body's surface; -1: it has none
  };
  std::vector<Vertex> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;  ///< indices into vertices
  std::vector<std::int32_t> triangle_body;             ///< of the triangles
  bool has_deformable = false;
};

SplitSurfaces split_surfaces(const ExportedRun& run);

/// All bodies at a frame.
struct PlacedBodies {
  explicit PlacedBodies(const ExportedRun& run);
  void place(const FrameValues& values);

  const Vec3& position(const SplitSurfaces::Vertex& v) const {
    return surface(v).positions[index(v.position)];
  }
  Vec3f normal(const SplitSurfaces::Vertex& v) const {
    return v.normal < 0 ? Vec3f::Zero() : surface(v).normals[index(v.normal)];
  }
  Vec2f uv(const SplitSurfaces::Vertex& v) const {
    return v.uv < 0 ? Vec2f::Zero() : surface(v).uvs[index(v.uv)];
  }
  const Vec3f& velocity(const SplitSurfaces::Vertex& v) const {
    return velocities_[index(v.body)][index(v.position)];
  }
  /// 0 for rigid bodies.
  float strain(const SplitSurfaces::Vertex& v, const FrameValues& values) const;

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  const Surface& surface(const SplitSurfaces::Vertex& v) const { return surfaces_[index(v.body)]; }

  const std::vector<ExportedBody>& bodies_;
  std::vector<Surface> surfaces_;
  std::vector<std::vector<Vec3f>> velocities_;
};

}  // namespace duet::io
