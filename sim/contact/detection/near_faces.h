// Visits the faces of a deformable body that are near a rigid one, for searches of contacts in these faces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/state/bodies.h"

namespace duet {

/// A face of a deformable body, in the shape space of a rigid one.
struct NearFace {
  int number = 0;           ///< Index of the face in Bodies::triangles.
  std::array<Vec3, 3> x;    ///< m: its corners.
  Vec3 normal;              ///< Unit: its outward normal.
  Eigen::AlignedBox3d box;  ///< m: the axis-aligned box around it.
  double size = 0;          ///< m: diagonal of `box`.
};

/// Least cosine of the angle between a face's outward normal and the direction into a host that touches the
/// face. At a cube's corner the cosine is 0.58 towards its faces. A larger value would lose contacts of blunt
/// corners that touch at a slant; a smaller one would let a host touch a face from behind.
constexpr double min_facing = 0.2;

/// Returns how deep below a face of the size `size` (m) a point that touches it may be, m. It is half the
/// distance between the surface points of the face. Nothing deeper is looked for, because bodies that move
/// are found before they are inside.
inline double max_below(const DeformableBody& guest, double size) {
  return 0.5 * size / guest.parts_per_edge;
}

/// Returns whether a face touches others by itself. Faces with a particle without mass, which moves with a
/// dynamic body, are left to that body.
inline bool touches_by_itself(const Particles& particles, const Triangle& face) {
  const auto is_left_out = [&](int p) { return particles.mass[as_index(p)] == 0; };
  return std::none_of(face.begin(), face.end(), is_left_out);
}

/// Calls visit(face), with a NearFace, for all faces of `guest` that meet the box `near` (m, world) and come
/// nearer to the rigid body `host` than `margin` (m), and for some others.
template <class Visit>
void visit_near_faces(const Bodies& bodies, const DeformableBody& guest, int host,
                      const Eigen::AlignedBox3d& near, double margin, Visit&& visit) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const Pose pose = shape_pose(bodies.rigid, as_index(host));
  const LevelSet& shape = bodies.rigid.properties[as_index(host)].shape;
  const Eigen::AlignedBox3d bounds(shape.lower(), shape.upper());
  const Mat3 to_shape = pose.orientation.toRotationMatrix().transpose();
  for (int t = guest.first_triangle; t < guest.first_triangle + guest.triangle_count; ++t) {
    const Triangle& triangle = bodies.triangles[as_index(t)];
    const Vec3 &a = x[as_index(triangle[0])], &b = x[as_index(triangle[1])], &c = x[as_index(triangle[2])];
    if (!near.intersects(Eigen::AlignedBox3d(a).extend(b).extend(c))) continue;
    if (!touches_by_itself(bodies.particles, triangle)) continue;
    NearFace face;
    face.number = t;
    for (std::size_t i = 0; i < 3; ++i) face.x[i] = to_shape * (x[as_index(triangle[i])] - pose.position);
    face.box = Eigen::AlignedBox3d(face.x[0]).extend(face.x[1]).extend(face.x[2]);
    face.size = face.box.diagonal().norm();
    // A place of the face that touches is nearer to the host than the margin or inside of the host, and no
    // farther from the middle of the box than half its diagonal.
    const double far = face.size / 2 + margin + shape.tolerance();
    const Vec3 middle = face.box.center();
    if (bounds.squaredExteriorDistance(middle) > far * far || shape.distance(middle) > far) continue;
    face.normal = (face.x[1] - face.x[0]).cross(face.x[2] - face.x[0]).normalized();
    visit(face);
  }
}

}  // namespace duet
