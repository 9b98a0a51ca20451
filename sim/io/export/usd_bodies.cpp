#include "sim/io/export/usd_bodies.h"

#include <algorithm>

#include <fmt/format.h>

namespace duet::io {
namespace {

// Returns one of the indices (position, uv or normal) of all corners, in the order of the faces.
std::vector<int> corners(const Surface& surface, int Corner::*index) {
  std::vector<int> indices;
  indices.reserve(3 * surface.triangles.size());
  for (const std::array<Corner, 3>& triangle : surface.triangles)
    for (const Corner& corner : triangle) indices.push_back(corner.*index);
  return indices;
}

// Returns true if each position has a normal of its own, with the index of the position.
bool has_vertex_normals(const Surface& surface) {
  return surface.normals.size() == surface.positions.size() &&
         corners(surface, &Corner::normal) == corners(surface, &Corner::position);
}

std::vector<Vec3f> extent_of(const std::vector<Vec3f>& points) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& x : points) box.extend(x);
  return box.isEmpty() ? std::vector<Vec3f>(2, Vec3f::Zero()) : std::vector<Vec3f>{box.min(), box.max()};
}

}  // namespace

std::string usd_topology(const Surface& surface, const std::string& indent) {
  std::string text;
  const auto add = [&](const char* declaration, const std::string& value) {
    text += fmt::format("{}{} = {}\n", indent, declaration, value);
  };
  add("int[] faceVertexCounts", usd_array(std::vector<int>(surface.triangles.size(), 3)));
  add("int[] faceVertexIndices", usd_array(corners(surface, &Corner::position)));
  add("uniform token orientation", "\"rightHanded\"");
  add("uniform token subdivisionScheme", "\"none\"");
  if (!has_vertex_normals(surface))
    add("int[] primvars:normals:indices", usd_array(corners(surface, &Corner::normal)));
  if (surface.uvs.empty()) return text;
  add("texCoord2f[] primvars:st",
      usd_array(surface.uvs) + " (\n" + indent + "    interpolation = \"faceVarying\"\n" + indent + ")");
  add("int[] primvars:st:indices", usd_array(corners(surface, &Corner::uv)));
  return text;
}

std::string usd_rest_shape(const Surface& surface, const std::string& indent) {
  std::vector<Vec3f> points;
  points.reserve(surface.positions.size());
  for (const Vec3& x : surface.positions) points.push_back(x.cast<float>());
  return fmt::format(
      "{0}point3f[] points = {1}\n{0}float3[] extent = {2}\n{0}{3} = {4} ( interpolation = \"{5}\" )\n",
      indent, usd_array(points), usd_array(extent_of(points)), usd_declaration(UsdValue::normals),
      usd_array(surface.normals), usd_normal_interpolation(surface));
}

const char* usd_declaration(UsdValue value) {
  switch (value) {
    case UsdValue::translate:
      return "double3 xformOp:translate";
    case UsdValue::points:
      return "point3f[] points";
    case UsdValue::extent:
      return "float3[] extent";
    case UsdValue::normals:
      return "normal3f[] primvars:normals";
    case UsdValue::velocities:
      return "vector3f[] velocities";
  }
  return "";
}

std::string usd_declaration(std::size_t attribute) {
  if (attribute < usd_value_count) return usd_declaration(usd_values[attribute]);
  const PointValue& kind = point_values[attribute - usd_value_count];
  return fmt::format("{}[] primvars:{}", kind.scalars ? "float" : "vector3f", kind.name);
}

std::string usd_metadata(std::size_t attribute, const Surface& surface) {
  const bool is_normals = attribute == static_cast<std::size_t>(UsdValue::normals);
  if (!is_normals && attribute < usd_value_count) return {};
  return fmt::format(" ( interpolation = \"{}\" )",
                     is_normals ? usd_normal_interpolation(surface) : "vertex");
}

const char* usd_normal_interpolation(const Surface& surface) {
  return has_vertex_normals(surface) ? "vertex" : "faceVarying";
}

std::string usd_value_text(std::size_t attribute, const UsdData& value) {
  if (const auto* vector = std::get_if<Vec3>(&value)) return usd_tuple(*vector);
  if (const auto* rotation = std::get_if<Quat>(&value)) return usd_tuple(*rotation);
  if (const auto* numbers = std::get_if<std::vector<float>>(&value)) return usd_rounded_array(*numbers);
  const auto* vectors = std::get_if<std::vector<Vec3f>>(&value);
  if (vectors == nullptr) return {};
  const bool is_normals = attribute == static_cast<std::size_t>(UsdValue::normals);
  return is_normals ? usd_rounded_array(*vectors) : usd_array(*vectors);
}

std::array<UsdData, usd_attribute_count> UsdDeformable::at(const FrameValues& values) {
  place(body_, values, surface_);
  const Vec3& origin = local_.follow(surface_.positions);
  std::vector<Vec3f> points, point_velocities;
  points.reserve(surface_.positions.size());
  for (const Vec3& x : surface_.positions) points.push_back((x - origin).cast<float>());
  velocities(body_, values, point_velocities);
  const auto of_body = [&, count = points.size()](const auto& all) {
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(body_.first_point);
    return std::decay_t<decltype(all)>(first, first + static_cast<std::ptrdiff_t>(count));
  };
  std::array<UsdData, usd_attribute_count> data;
  for (std::size_t i = 0; i < std::size(point_values); ++i) {
    const PointValue& kind = point_values[i];
    if (!kind.is_in(values)) continue;
    if (kind.scalars)
      data[usd_value_count + i] = of_body(kind.scalars(values));
    else
      data[usd_value_count + i] = of_body(kind.vectors(values));
  }
  data[static_cast<std::size_t>(UsdValue::translate)] = origin;
  data[static_cast<std::size_t>(UsdValue::extent)] = extent_of(points);
  data[static_cast<std::size_t>(UsdValue::points)] = std::move(points);
  data[static_cast<std::size_t>(UsdValue::normals)] = surface_.normals;
  data[static_cast<std::size_t>(UsdValue::velocities)] = std::move(point_velocities);
  return data;
}

std::uint64_t usd_frame_bytes(const ExportedBody& body) {
  // Measured lengths in bytes: a vector is three numbers of 9 digits, a normal three of 4, a pose seven of
  // 17, and the values of a point have 5 digits each, or are zeros where nothing touches it.
  constexpr std::uint64_t of_vector = 38, of_normal = 26, of_pose = 190, of_values = 50;
  if (body.is_rigid()) return of_pose;
  return (2 * of_vector + of_values) * body.rest.positions.size() + of_normal * body.rest.normals.size();
}

}  // namespace duet::io
