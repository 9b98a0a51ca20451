#include "sim/coupling/faces_around.h"

#include <algorithm>

#include "sim/coupling/contact_plane.h"
#include "sim/coupling/deepest_point.h"
#include "sim/geometry/grid_level_set.h"

namespace duet {
namespace {

constexpr double other_plane = 0.9962;   // cosine of the angle between faces, at most: 5 degrees
constexpr double same_plane = 1 - 1e-9;  // cosine
constexpr double beyond_edge = 1e-9;     // barycentric: rounding
constexpr double same_point = 0.002;     // of the way inwards: how much deeper another point may lie

// Whether the foot of the perpendicular on the face's plane lies in the face.
bool is_opposite(const MeshDistance::Face& face, const Vec3& x) {
  const double twice_area =
      face.normal.dot((face.corner[1] - face.corner[0]).cross(face.corner[2] - face.corner[0]));
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = face.corner[k], &b = face.corner[(k + 1) % 3];
    if (face.normal.dot((b - a).cross(x - a)) < -beyond_edge * twice_area) return false;
  }
  return true;
}

}  // namespace

void find_faces_around(const LevelSet& host, const LevelSet& guest, const Pose& in_host, double margin,
                       std::vector<NearPoint>& touches, std::vector<NearRidge>& places) {
  if (host.kind != LevelSet::Kind::grid) return;
  const Mat3 turn = in_host.orientation.toRotationMatrix();
  const Vec3 center = in_host.to_world((guest.lower() + guest.upper()) / 2);
  const Vec3 half = (turn.cwiseAbs() * ((guest.upper() - guest.lower()) / 2)).array() + margin;
  const Eigen::AlignedBox3d around(center - half, center + half);
  const auto add = [&](int k, int face, const Vec3& x, const Vec3& normal, double gap) {
    touches.push_back({.point = against_face(guest, k, face),
                       .position = x,
                       .normal = normal,
                       .gap = gap,
                       .ridge = static_cast<int>(places.size())});
    NearRidge& place = places.emplace_back();
    place.lowest.normal = normal;
    place.lowest.foot = x - gap * normal;
    place.distance = gap;
  };
  for (int k = 0; k < deepest_point_count(guest); ++k) {
    const DeepestPoint nearest = deepest_point(guest, k, in_host, host);
    const ContactPlane plane = contact_plane(host, nearest.position, nearest.inside);
    const std::size_t first = places.size();
    host.grid->exact().for_each_face(around, [&](int number, const MeshDistance::Face& face) {
      const Vec3& n = face.normal;
      if (n.isZero(0) || n.dot(plane.normal) > other_plane) return;
      const DeepestPoint deepest = deepest_point(guest, k, turn.transpose() * n);
      const Vec3 x = in_host.to_world(deepest.position);
      const double gap = n.dot(x - face.corner[0]);
      if (!(gap < margin) || n.dot(in_host.to_world(deepest.inside) - face.corner[0]) <= 0 ||
          !is_opposite(face, x))
        return;
      const auto is_same = [&](const NearRidge& found) {
        return found.lowest.normal.dot(n) > same_plane &&
               std::abs(found.distance - gap) <= beyond_edge * host.smallest_size();
      };
      if (std::any_of(places.begin() + static_cast<std::ptrdiff_t>(first), places.end(), is_same)) return;
      add(k, 1 + number, x, n, gap);
    });
    if (places.size() == first) continue;
    const DeepestPoint towards = deepest_point(guest, k, turn.transpose() * plane.normal);
    const double gap = plane.normal.dot(in_host.to_world(towards.position) - plane.foot);
    if (plane.gap - gap <= same_point * (nearest.inside - nearest.position).norm())
      add(k, 0, nearest.position, plane.normal, plane.gap);
  }
}

}  // namespace duet
