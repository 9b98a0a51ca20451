// Bodies in USD: meshes in its text format, and the values of deformable bodies at frames.
#pragma once

#include <array>
#include <iterator>
#include <string>
#include <vector>

#include "sim/io/export/tracks.h"
#include "sim/io/export/usd_crate.h"
#include "sim/io/export/usd_text.h"

namespace duet::io {

/// Returns the attributes of a Mesh that never change: faces, texture coordinates, and the index of the
/// normal of each corner. Each line begins with `indent`.
std::string usd_topology(const Surface& surface, const std::string& indent);

/// Returns points, extent and normals of a rigid body's Mesh, in the axes of its pose. Each line begins
/// with `indent`.
std::string usd_rest_shape(const Surface& surface, const std::string& indent);

/// Attributes of a deformable body that change from frame to frame.
enum class UsdValue {
  translate,  ///< translation of the body's Xform: the origin of its points
  points,     ///< positions of the vertices, relative to the translation
  extent,     ///< bounding box of the points
  normals,    ///< normals, as in the run's surface
  velocities  ///< velocities of the vertices, units of the export per second
};
/// All values of UsdValue, in their order.
inline constexpr std::array usd_values{UsdValue::translate, UsdValue::points, UsdValue::extent,
                                       UsdValue::normals, UsdValue::velocities};
/// Number of values of UsdValue.
inline constexpr std::size_t usd_value_count = usd_values.size();

/// Returns the type and the name of an attribute. `translate` belongs to the body's Xform, the others to
/// its Mesh.
const char* usd_declaration(UsdValue value);

/// Number of attributes of a deformable body that change from frame to frame: those of UsdValue, and then a
/// primvar for each of point_values.
inline constexpr std::size_t usd_attribute_count = usd_value_count + std::size(point_values);
/// Returns the type and the name of the attribute with this number.
std::string usd_declaration(std::size_t attribute);
/// Returns the metadata of the attribute with this number, such as " ( interpolation = \"vertex\" )"; empty
/// if it has none. `surface` is the body's.
std::string usd_metadata(std::size_t attribute, const Surface& surface);
/// Returns the interpolation of the normals: "vertex" if position i has normal i everywhere, and otherwise
/// "faceVarying"; usd_topology() then writes the index of the normal of each corner.
const char* usd_normal_interpolation(const Surface& surface);

/// Returns the text of a value of the attribute with this number. Normals have four digits after the point,
/// values of points that are no vectors five significant digits, all others all digits. A value of the kind
/// none has an empty text.
std::string usd_value_text(std::size_t attribute, const UsdData& value);

/// The values of one deformable body from frame to frame.
class UsdDeformable {
 public:
  /// Begins before the first frame. `body` has to outlive the object.
  explicit UsdDeformable(const ExportedBody& body) : body_(body), surface_(body.rest) {}

  /// Returns the body.
  const ExportedBody& body() const { return body_; }
  /// Returns the value of each attribute at a frame, by its number; none if the frame lacks it. Frames have
  /// to come in order, because the translation follows the body (LocalOrigin).
  std::array<UsdData, usd_attribute_count> at(const FrameValues& values);

 private:
  const ExportedBody& body_;
  Surface surface_;
  LocalOrigin local_;
};

/// Estimates how many bytes of text the values of a moving body take at a frame.
std::uint64_t usd_frame_bytes(const ExportedBody& body);

}  // namespace duet::io
