// Surfaces for formats whose vertices have one normal and one texture coordinate each: a position at a
// sharp edge has several vertices.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// All exported bodies as one mesh. Vertices are in the order of the bodies, and of the positions of each
/// body.
struct SplitSurfaces {
  /// A vertex of the mesh.
  struct Vertex {
    int body = 0;      ///< index in ExportedRun::bodies()
    int position = 0,  ///< index of its position in the body's surface
        uv = 0,        ///< index of its texture coordinate in the body's surface; -1: none
        normal = 0;    ///< index of its normal in the body's surface; -1: none
  };
  std::vector<Vertex> vertices;                        ///< vertices of all bodies
  std::vector<std::array<std::int32_t, 3>> triangles;  ///< indices into `vertices`
  std::vector<std::int32_t> triangle_body;  ///< for each triangle the index in ExportedRun::bodies()
  bool has_deformable = false;              ///< true if one of the bodies is deformable
};

/// Makes one mesh of the exported bodies, in which each position has a vertex even if no triangle uses it.
/// Throws Error (usage) if there are 2^31 vertices or more.
SplitSurfaces split_surfaces(const ExportedRun& run);

/// The exported bodies at a frame: values at the vertices of SplitSurfaces, in the axes and unit of the
/// export.
struct PlacedBodies {
  /// Takes over the bodies at rest. `run` has to outlive the object.
  explicit PlacedBodies(const ExportedRun& run);
  /// Moves the bodies to their places at the frame of `values`.
  void place(const FrameValues& values);

  /// Returns the position of a vertex.
  const Vec3& position(const SplitSurfaces::Vertex& v) const {
    return surface(v).positions[index(v.position)];
  }
  /// Returns the unit normal of a vertex; zero if it has none.
  Vec3f normal(const SplitSurfaces::Vertex& v) const {
    return v.normal < 0 ? Vec3f::Zero() : surface(v).normals[index(v.normal)];
  }
  /// Returns the texture coordinate of a vertex; zero if it has none.
  Vec2f uv(const SplitSurfaces::Vertex& v) const {
    return v.uv < 0 ? Vec2f::Zero() : surface(v).uvs[index(v.uv)];
  }
  /// Returns the velocity of a vertex, units of the export per second. It is valid after place().
  const Vec3f& velocity(const SplitSurfaces::Vertex& v) const {
    return velocities_[index(v.body)][index(v.position)];
  }
  /// Returns one of the scalars of PointValue at a vertex; 0 for rigid bodies.
  float of_point(const SplitSurfaces::Vertex& v, const std::vector<float>& values) const;
  /// Returns one of the vectors of PointValue at a vertex; zero for rigid bodies.
  Vec3f of_point(const SplitSurfaces::Vertex& v, const std::vector<Vec3f>& values) const;

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  const Surface& surface(const SplitSurfaces::Vertex& v) const { return surfaces_[index(v.body)]; }

  const std::vector<ExportedBody>& bodies_;
  std::vector<Surface> surfaces_;
  std::vector<std::vector<Vec3f>> velocities_;
};

}  // namespace duet::io
