/// Bodies as USD has them: text of meshes, and the values of deformable bodies at frames.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/io/export/tracks.h"
#include "sim/io/export/usd_text.h"

namespace duet::io {

/// The attributes of a Mesh that never change: faces, texture coordinates, which normal a corner has.
std::string usd_topology(const Surface& surface, const std::string& indent);

/// Points, extent and normals of a rigid body's Mesh, in the axes of its pose.
std::string usd_rest_shape(const Surface& surface, const std::string& indent);

/// Attributes of a deformable body that change.
enum class UsdValue { translate, points, extent, normals, velocities };
inline constexpr std::array usd_values{UsdValue::translate, UsdValue::points, UsdValue::extent,
                                       UsdValue::normals, UsdValue::velocities};
inline constexpr std::size_t usd_value_count = usd_values.size();

/// The attribute's type and name; translate is of the body's Xform, the others are of its Mesh.
const char* usd_declaration(UsdValue value);
/// "vertex" where each position has its own normal, and "faceVarying" where usd_topology has indices of them.
const char* usd_normal_interpolation(const Surface& surface);

/// The values of one deformable body from frame to frame, as text, each indexed by UsdValue.
class UsdDeformable {
 public:
  explicit UsdDeformable(const ExportedBody& body) : body_(body), surface_(body.rest) {}

  const ExportedBody& body() const { return body_; }
  /// The frames have to come in order.
  std::array<std::string, usd_value_count> at(const FrameValues& values);

 private:
  const ExportedBody& body_;
  Surface surface_;
  LocalOrigin local_;
  std::vector<Vec3f> points_, velocities_;
};

/// About as many bytes as the values of a body that moves take at a frame.
std::uint64_t usd_frame_bytes(const ExportedBody& body);

}  // namespace duet::io
