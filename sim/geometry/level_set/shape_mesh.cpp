#include "sim/geometry/level_set/shape_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/geometry/queries/texture.h"

namespace duet {
namespace {

using std::numbers::pi;

// A face of the cube [-1, 1]^3: its outward axis and two tangents with axis = u x v.
struct CubeFace {
  Vec3 axis, u, v;
};

std::array<CubeFace, 6> cube_faces() {
  std::array<CubeFace, 6> faces;
  for (int i = 0; i < 3; ++i) {
    const Vec3 axis = Vec3::Unit(i), u = Vec3::Unit((i + 1) % 3), v = Vec3::Unit((i + 2) % 3);
    const std::size_t pair = 2 * as_index(i);
    faces[pair] = {axis, u, v};
    faces[pair + 1] = {-axis, v, u};
  }
  return faces;
}

void add_quad(Surface& surface, const std::array<Corner, 4>& q) {
  surface.triangles.push_back({q[0], q[1], q[2]});
  surface.triangles.push_back({q[0], q[2], q[3]});
}

Surface box_surface(const Vec3& half) {
  Surface surface;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1);
    surface.positions.push_back(half.cwiseProduct(sign));
  }
  surface.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const CubeFace& face : cube_faces()) {
    const int normal = static_cast<int>(surface.normals.size());
    surface.normals.push_back(face.axis.cast<float>());
    std::array<Corner, 4> corners;
    for (int k = 0; k < 4; ++k) {
      const Vec3 x = face.axis + (k == 1 || k == 2 ? 1 : -1) * face.u + (k >= 2 ? 1 : -1) * face.v;
      const int vertex = (x.x() > 0 ? 1 : 0) + (x.y() > 0 ? 2 : 0) + (x.z() > 0 ? 4 : 0);
      corners[static_cast<std::size_t>(k)] = {vertex, k, normal};
    }
    add_quad(surface, corners);
  }
  return surface;
}

// A point of the curve that generates a surface of revolution, with the normal of the surface there, both as
// (distance from the axis y, height). Two points at one place with different normals make a sharp rim.
struct ProfilePoint {
  Vec2 place, normal;
  double along = 0;  // texture coordinate, in [0, 1]
};

// Appends an arc from angle `begin` to `end` (rad), counted from the axis y, as `rows` + 1 points.
void add_arc(std::vector<ProfilePoint>& profile, const Vec2& center, double radius, double begin, double end,
             int rows) {
  for (int row = 0; row <= rows; ++row) {
    const double angle = begin + (end - begin) * (static_cast<double>(row) / rows);
    // Poles lie on the axis exactly; rounding would leave a tiny hole.
    const bool pole = center.x() == 0 && (angle == 0 || angle == pi);
    const Vec2 direction(pole ? 0 : math::sin(angle), math::cos(angle));
    profile.push_back({center + radius * direction, direction});
  }
}

// Sets the texture coordinates to fractions of the length of the profile.
void measure(std::vector<ProfilePoint>& profile) {
  for (std::size_t i = 1; i < profile.size(); ++i)
    profile[i].along = profile[i - 1].along + (profile[i].place - profile[i - 1].place).norm();
  const double length = profile.back().along;
  for (ProfilePoint& point : profile) point.along /= length;
}

// Whether a profile ends where it begins.
enum class ProfileEnds { are_poles, are_joined };

// Turns a profile, given from top to bottom along the outside, about the axis y.
class Revolution {
 public:
  Revolution(std::span<const ProfilePoint> profile, int columns, ProfileEnds ends)
      : profile_(profile), columns_(columns) {
    const int rows = static_cast<int>(profile.size());
    for (int row = 0; row < rows; ++row) add_row(row, ends == ProfileEnds::are_joined && row == rows - 1);
    for (int row = 0; row + 1 < rows; ++row)
      if (!same_place(row, row + 1)) add_band(row);
  }
  Surface take() { return std::move(surface_); }

 private:
  const ProfilePoint& at(int row) const { return profile_[as_index(row)]; }
  bool is_pole(int row) const { return at(row).place.x() == 0; }
  bool same_place(int a, int b) const { return at(a).place == at(b).place; }

  // Adds the points of a row. The last row of a closed profile shares those of the first one (`as_first`).
  void add_row(int row, bool as_first) {
    const int points = is_pole(row) ? 1 : columns_;
    if (as_first) {
      first_position_.push_back(0);
      first_normal_.push_back(0);
    } else {
      const bool at_last = row > 0 && same_place(row, row - 1);
      first_position_.push_back(at_last ? first_position_.back()
                                        : static_cast<int>(surface_.positions.size()));
      first_normal_.push_back(static_cast<int>(surface_.normals.size()));
      for (int column = 0; column < points; ++column) {
        const double azimuth = 2 * pi * column / columns_;
        const Vec3 out(math::sin(azimuth), 0, math::cos(azimuth));
        const auto turned = [&](const Vec2& v) { return Vec3(v.x() * out + Vec3(0, v.y(), 0)); };
        if (!at_last) surface_.positions.push_back(turned(at(row).place));
        surface_.normals.push_back(turned(at(row).normal).cast<float>());
      }
    }
    for (int column = 0; column <= columns_; ++column)
      surface_.uvs.emplace_back(static_cast<float>(column) / static_cast<float>(columns_),
                                static_cast<float>(1 - at(row).along));
  }

  // Returns the corner at a row and column of the surface.
  Corner corner(int row, int column) const {
    const int wrapped = is_pole(row) ? 0 : column % columns_;
    return {first_position_[as_index(row)] + wrapped, row * (columns_ + 1) + column,
            first_normal_[as_index(row)] + wrapped};
  }

  // Adds the triangles between a row and the next one.
  void add_band(int row) {
    for (int column = 0; column < columns_; ++column) {
      const Corner a = corner(row, column), b = corner(row + 1, column), c = corner(row + 1, column + 1),
                   d = corner(row, column + 1);
      if (!is_pole(row + 1)) surface_.triangles.push_back({a, b, c});  // b and c are one point at a pole
      if (!is_pole(row)) surface_.triangles.push_back({a, c, d});      // a and d are one point at a pole
    }
  }

  std::span<const ProfilePoint> profile_;
  int columns_;
  std::vector<int> first_position_, first_normal_;  // indices of the first point of each row
  Surface surface_;
};

Surface revolved(std::vector<ProfilePoint> profile, int columns, ProfileEnds ends = ProfileEnds::are_poles) {
  measure(profile);
  return Revolution(profile, columns, ends).take();
}

Surface round_surface(const LevelSet& shape, double detail) {
  const auto scaled = [&](int count) { return std::max(4, static_cast<int>(std::lround(detail * count))); };
  const int columns = scaled(64);
  std::vector<ProfilePoint> profile;
  const double r = shape.radius, h = shape.half_length;
  switch (shape.kind) {
    case LevelSet::Kind::capsule:
      add_arc(profile, {0, h}, r, 0, pi / 2, scaled(16));
      add_arc(profile, {0, -h}, r, pi / 2, pi, scaled(16));
      return revolved(profile, columns);
    case LevelSet::Kind::cylinder:
      profile = {{{0, h}, {0, 1}},  {{r, h}, {0, 1}},   {{r, h}, {1, 0}},
                 {{r, -h}, {1, 0}}, {{r, -h}, {0, -1}}, {{0, -h}, {0, -1}}};
      return revolved(profile, columns);
    case LevelSet::Kind::torus:
      add_arc(profile, {r, 0}, shape.tube, 0, 2 * pi, scaled(32));
      return revolved(profile, scaled(96), ProfileEnds::are_joined);
    default:
      add_arc(profile, Vec2::Zero(), r, 0, pi, scaled(32));
      return revolved(profile, columns);
  }
}

// Gives every distinct value at a position one index.
template <class Value>
class Pool {
 public:
  Pool(std::vector<Value>& values, std::size_t positions) : values_(values), at_(positions) {}
  int index(int position, const Value& value) {
    std::vector<int>& known = at_[as_index(position)];
    for (const int i : known)
      if (values_[as_index(i)] == value) return i;
    known.push_back(static_cast<int>(values_.size()));
    values_.push_back(value);
    return known.back();
  }

 private:
  std::vector<Value>& values_;
  std::vector<std::vector<int>> at_;
};

// Normals computed from the triangles: that of a corner is the sum of the area vectors of the triangles
// around its vertex that face almost the same way as its own triangle.
class CreaseNormals {
 public:
  explicit CreaseNormals(const TriangleMesh& mesh) : mesh_(mesh), around_(mesh.positions.size()) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      areas_.push_back(area_vector(mesh, t));
      for (const int v : mesh.triangles[t]) around_[as_index(v)].push_back(t);
    }
  }
  Vec3f at(std::size_t triangle, std::size_t k) const {
    const double crease = math::cos(40 * pi / 180);
    const Vec3& own = areas_[triangle];
    Vec3 sum = Vec3::Zero();
    for (const std::size_t t : around_[as_index(mesh_.triangles[triangle][k])])
      if (areas_[t].dot(own) >= crease * areas_[t].norm() * own.norm()) sum += areas_[t];
    const double length = sum.norm();
    return length > 0 ? Vec3f((sum / length).cast<float>()) : Vec3f(Vec3f::UnitY());
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<Vec3> areas_;
  std::vector<std::vector<std::size_t>> around_;
};

}  // namespace

Surface shape_surface(const LevelSet& shape, double detail) {
  DUET_ASSERT(detail > 0 && detail <= 1);
  return shape.kind == LevelSet::Kind::box ? box_surface(shape.half) : round_surface(shape, detail);
}

Surface mesh_surface(const TriangleMesh& mesh) {
  Surface surface;
  surface.positions = mesh.positions;
  Pool<Vec3f> normals(surface.normals, mesh.positions.size());
  Pool<Vec2f> uvs(surface.uvs, mesh.positions.size());
  const CreaseNormals creased(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 face = area_vector(mesh, t);
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const int v = mesh.triangles[t][k];
      const Vec3f normal = mesh.normals.empty() ? creased.at(t, k) : mesh.normals[t][k];
      const Vec2f uv = mesh.uvs.empty() ? planar_uv(mesh.corner(t, k), face) : mesh.uvs[t][k];
      corners[k] = {v, uvs.index(v, uv), normals.index(v, normal)};
    }
    surface.triangles.push_back(corners);
  }
  return surface;
}

}  // namespace duet
