#include "sim/contact/detection/faces_around.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "sim/contact/detection/contact_plane.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

// Greatest cosine of the angle between the normals of a face and of the nearest surface for which a support
// point touches both: 5 degrees. With a greater angle grooves lose a side; with a smaller one the facets of a
// round mesh become contacts of their own.
constexpr double other_plane = 0.9962;
constexpr double same_face_normal =
    1 - 1e-9;                         // least cosine of the angle between normals of one plane: rounding
constexpr double beyond_edge = 1e-9;  // rounding, relative to a face's area or the host's smallest size
// Least height by which a face rises above the nearest plane, relative to the host's smallest size: rounding.
constexpr double rise = 1e-6;
constexpr int planes_of_sample = 4;  // most planes that one sample touches
// Greatest depth of another point of the guest below a support point at which the plane of the nearest
// surface counts, relative to the distance from the support point to ShapeSupportPoint::inside.
constexpr double same_point = 0.002;

// Returns whether the foot of the perpendicular from `x` (m, host's shape space) on the face's plane lies in
// the face, or beyond edges from a to b for which is_open(a, b) says that the plane goes on.
template <class IsOpen>
bool is_opposite(const MeshDistance::Face& face, const Vec3& x, IsOpen&& is_open) {
  const double twice_area =
      face.normal.dot((face.corner[1] - face.corner[0]).cross(face.corner[2] - face.corner[0]));
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = face.corner[k], &b = face.corner[(k + 1) % 3];
    if (face.normal.dot((b - a).cross(x - a)) < -beyond_edge * twice_area && !is_open(a, b)) return false;
  }
  return true;
}

// Returns whether the foot of the perpendicular from `x` on the face's plane lies in the face.
bool is_opposite(const MeshDistance::Face& face, const Vec3& x) {
  return is_opposite(face, x, [](const Vec3&, const Vec3&) { return false; });
}

// Returns whether `x` lies in the plane of `place`, to within `tolerance` (m).
bool lies_in(const EdgePoint& place, const Vec3& x, double tolerance) {
  return std::abs(place.normal.dot(x - place.foot)) <= tolerance;
}

// Returns whether a corner of the face is more than `least` (m) above the plane of `place`.
bool rises(const MeshDistance::Face& face, const EdgePoint& place, double least) {
  return std::any_of(std::begin(face.corner), std::end(face.corner),
                     [&](const Vec3& corner) { return place.normal.dot(corner - place.foot) > least; });
}

// Replaces the touch of a sample by one for each of the places from `first` on. The first place is the plane
// of that touch; only its touch stays in the sample's patch.
void put_planes(std::size_t touch, std::size_t first, std::vector<NearPoint>& touches,
                const std::vector<EdgeContact>& places) {
  for (std::size_t i = first; i < places.size(); ++i) {
    NearPoint plane = touches[touch];
    plane.feature = places[i].feature;
    plane.normal = places[i].edge.normal;
    plane.gap = places[i].distance;
    plane.plane_index = static_cast<int>(i);
    if (i == first) {
      touches[touch] = plane;
      continue;
    }
    plane.patch = -1;
    plane.share = 0;
    touches.push_back(plane);
  }
}

}  // namespace

void find_faces_around(const LevelSet& host, const LevelSet& guest, const Pose& in_host, double margin,
                       std::vector<NearPoint>& touches, std::vector<EdgeContact>& places) {
  if (host.kind != LevelSet::Kind::grid) return;
  const Mat3 turn = in_host.orientation.toRotationMatrix();
  const Vec3 center = in_host.to_world((guest.lower() + guest.upper()) / 2);
  const Vec3 half = (turn.cwiseAbs() * ((guest.upper() - guest.lower()) / 2)).array() + margin;
  const Eigen::AlignedBox3d around(center - half, center + half);
  const auto add = [&](int k, int plane, const Vec3& x, const Vec3& normal, double gap) {
    touches.push_back({.feature = FeatureId::support(k, plane),
                       .position = x,
                       .normal = normal,
                       .gap = gap,
                       .plane_index = static_cast<int>(places.size())});
    EdgeContact& place = places.emplace_back();
    place.edge.normal = normal;
    place.edge.foot = x - gap * normal;
    place.distance = gap;
  };
  for (int k = 0; k < support_point_count(guest); ++k) {
    const ShapeSupportPoint nearest = support_point(guest, k, in_host, host);
    const ContactPlane plane = contact_plane(host, nearest.position, nearest.inside);
    const std::size_t first = places.size();
    host.grid->exact().for_each_face(around, [&](int number, const MeshDistance::Face& face) {
      const Vec3& n = face.normal;
      if (n.isZero(0) || n.dot(plane.normal) > other_plane) return;
      const ShapeSupportPoint support = support_point(guest, k, turn.transpose() * n);
      const Vec3 x = in_host.to_world(support.position);
      const double gap = n.dot(x - face.corner[0]);
      const Vec3 inside = in_host.to_world(support.inside);
      if (!(gap < margin) || n.dot(inside - face.corner[0]) <= 0 || !is_opposite(face, x) ||
          ends_at(host, x - gap * n, n, inside - x))
        return;
      const auto is_same = [&](const EdgeContact& found) {
        return found.edge.normal.dot(n) > same_face_normal &&
               std::abs(found.distance - gap) <= beyond_edge * host.min_size();
      };
      if (std::any_of(places.begin() + static_cast<std::ptrdiff_t>(first), places.end(), is_same)) return;
      add(k, 1 + number, x, n, gap);
    });
    if (places.size() == first) continue;
    const ShapeSupportPoint towards = support_point(guest, k, turn.transpose() * plane.normal);
    const double gap = plane.normal.dot(in_host.to_world(towards.position) - plane.foot);
    if (plane.gap - gap <= same_point * (nearest.inside - nearest.position).norm())
      add(k, 0, nearest.position, plane.normal, plane.gap);
  }
}

void find_faces_around_sample(const LevelSet& host, const RigidProperties& guest, const Pose& in_host,
                              double margin, std::size_t touch, std::vector<NearPoint>& touches,
                              std::vector<EdgeContact>& places) {
  const NearPoint own = touches[touch];
  const Vec3 x = own.position;
  if (host.kind != LevelSet::Kind::grid || !std::isfinite(own.gap) || !host.grid->is_exact(x)) return;
  const auto sample = as_index(own.feature.index);
  const Vec3 inside = in_host.to_world(guest.inside[sample]);
  const std::size_t first = places.size();
  const auto add = [&](const Vec3& normal, double gap) {
    EdgeContact& place = places.emplace_back();
    place.feature = {FeatureId::Kind::point_on_plane, own.feature.index,
                     static_cast<int>(places.size() - 1 - first)};
    place.edge.place = guest.samples[sample];
    place.edge.normal = normal;
    place.edge.foot = x - gap * normal;
    place.distance = gap;
  };
  const double min_rise = rise * host.min_size();
  add(own.normal, own.gap);
  const auto visit = [&](int, const MeshDistance::Face& face) {
    const Vec3& n = face.normal;
    if (n.isZero(0) || static_cast<int>(places.size() - first) == planes_of_sample) return;
    const double gap = n.dot(x - face.corner[0]);
    if (!(std::abs(gap) < margin) || n.dot(inside - face.corner[0]) <= 0) return;
    const auto known = places.begin() + static_cast<std::ptrdiff_t>(first);
    const bool is_other = std::none_of(known, places.end(), [&](const EdgeContact& found) {
      return found.edge.normal.dot(n) > (found.feature.sub == 0 ? sharp_edge : same_face_normal);
    });
    if (!is_other || !rises(face, places[first].edge, min_rise)) return;
    const auto is_crease = [&](const Vec3& a, const Vec3& b) {
      return std::any_of(known, places.end(), [&](const EdgeContact& found) {
        return lies_in(found.edge, a, min_rise) && lies_in(found.edge, b, min_rise);
      });
    };
    if (is_opposite(face, x, is_crease)) add(n, gap);
  };
  const Eigen::AlignedBox3d around(x.array() - margin, x.array() + margin);
  for (std::size_t known = 0;
       known != places.size();) {  // repeated, because walls of a corner end at each other
    known = places.size();
    host.grid->exact().for_each_face(around, visit);
  }
  if (places.size() == first + 1) {
    places.pop_back();
    return;
  }
  put_planes(touch, first, touches, places);
}

}  // namespace duet
