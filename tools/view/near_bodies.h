/// Which vertices of a run's bodies are near another body or the ground: what the page colors as contact.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/geometry/queries/triangle_tree.h"
#include "sim/io/export/exported_run.h"

namespace duet::view {

/// A vertex is near another surface within this fraction of the size (diagonal of the box) of the smaller
/// body. Twice as much would color the whole lower half of a body of some centimeters that lies on another
/// one.
inline constexpr double near_fraction = 0.01;

class NearBodies {
 public:
  /// `ground`: height of the ground, m, where the scene has one. `run` has to outlive this object.
  NearBodies(const io::ExportedRun& run, std::optional<double> ground);

  /// For each body a byte a position: 255 (1 - d / reach), rounded up, at the distance d to the nearest other
  /// surface within reach, and 0 beyond. Bodies with no such position have none at all. Surfaces of one and
  /// the same body are not looked at, nor are two static bodies.
  std::vector<std::vector<std::uint8_t>> at(const io::FrameValues& values);

 private:
  void place_bodies(const io::FrameValues& values);
  void mark_near_ground(std::size_t body);
  void mark_near(std::size_t guest, std::size_t host, const io::FrameValues& values);
  void mark(std::size_t body, std::size_t position, double distance, double reach);
  const TriangleTree& tree_of(std::size_t body);

  const io::ExportedRun& run_;
  std::optional<double> ground_;
  std::vector<std::size_t> shape_of_;  // the first body with the same rest surface
  std::vector<std::optional<TriangleTree>>
      trees_;                         // of rigid shapes at rest, of deformable bodies at the frame
  std::vector<TriangleMesh> meshes_;  // of the trees
  std::vector<Surface> placed_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<std::vector<std::uint8_t>> marks_;
};

}  // namespace duet::view
