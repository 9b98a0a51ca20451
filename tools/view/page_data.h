/// What the page of `duet view` knows of a run, and how it is packed; data.js reads it.
///
/// The description is JSON. The blocks are zlib streams, as base 64: the first has the meshes, the others the
/// frames one after another.
///
/// A mesh is, with little-endian numbers of 4 bytes: positions of a rigid one in the axes of its pose (3
/// floats each; none for deformable ones), normals (3 floats each, in the same axes; none for deformable
/// ones), vertices (index of the position, index of the normal), texture coordinates of the vertices (2
/// floats each; only where the description says `uv`), triangles (3 vertices each).
///
/// A frame is a row of FloatRows with the numbers of all bodies, one after another: a rigid body has
/// position, orientation (w, x, y, z), velocity, angular velocity and force of contact; a deformable one has
/// the center of the box around it, the mean of its positions and the mean of their velocities, the largest
/// speed, the largest strain, which is -1 where an element is inverted, the force of contact, the largest
/// stress and the largest pressure of contact. Then come for each deformable body a row of PositionRows, one
/// of ByteRows with the speeds, if the description says `strain` one with the strains, and if it says
/// `stress` one with the stresses: root_byte of the largest in the run; strains take up to 254, and 255 is an
/// inverted element. Then comes for each body a byte: 1 if a row of ByteRows follows that says how near its
/// positions are to other bodies (NearBodies), and 0 if none is. If the description has `max_pressure`, such
/// a byte follows for each deformable body, with a row of the pressures of contact if one is not 0.
///
/// Positions are relative to the description's `origin`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/io/export/exported_run.h"

namespace duet::view {

/// What all frames of a run have to be read for, before the first one is packed.
struct Measures {
  Vec3 origin = Vec3::Zero();    ///< m, the center of the box around all bodies at the first frame
  std::vector<Vec3f> extents;    ///< m, for each body: of PositionRows; 0 for rigid ones
  std::vector<bool> has_strain;  ///< for each body
  double max_speed = 0;          ///< m/s, of vertices of deformable bodies
  double max_strain = 0;         ///< of vertices that are not inverted
  /// Pa, of vertices of deformable bodies; none if a frame does not have stresses (runs of older programs).
  std::optional<double> max_stress;
  /// Pa, the largest pressure of contact; none if a frame does not have loads of contact.
  std::optional<double> max_pressure;

  /// Returns whether the body has stresses: those with strain do, if the run does.
  bool has_stress(std::size_t body) const { return has_strain[body] && max_stress.has_value(); }
};
Measures measure(const io::ExportedRun& run);

/// Frames of the run that the page has: every `step`-th one, and the last one.
std::vector<int> thinned(const std::vector<int>& frames, std::size_t step);

/// The block of the meshes.
std::string mesh_block(const io::ExportedRun& run);

struct PackedFrames {
  std::vector<std::string> blocks;  ///< base 64
  std::size_t bytes = 0;            ///< of the blocks
  std::size_t frames = 0;           ///< packed, fewer than asked for where there is no room for more
};
/// Packs the frames in blocks until they take more bytes than `room`. `ground`: its height, m, if there is
/// one.
PackedFrames pack(const io::ExportedRun& run, const Measures& measures, const std::vector<int>& frames,
                  std::optional<double> ground, std::size_t room);

/// What the page has to know of bodies, meshes, looks, camera and lights.
nlohmann::ordered_json describe(const io::ExportedRun& run, const Measures& measures,
                                const std::vector<int>& frames);

}  // namespace duet::view
