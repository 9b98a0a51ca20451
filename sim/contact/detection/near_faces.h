// The faces of a deformable body that are near a rigid one, as a search for places on them looks at them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/state/bodies.h"

namespace duet {

// In the space of the rigid body.
struct NearFace {
  int number = 0;         // among the boundaries' triangles
  std::array<Vec3, 3> x;  // m
  Vec3 normal;            // unit, outward
  Eigen::AlignedBox3d box;
  double size = 0;  // m
};

// Cosine of the angle between a face's outward normal and the way into a host that touches it, at least: from
// a cube's corner it is 0.58 to its faces.
constexpr double least_facing = 0.2;

// How deep below a face of `size` (m) what touches it may be, half the way between its points, m: what moves
// is found before it is inside.
inline double most_below(const DeformableBody& guest, double size) {
  return 0.5 * size / guest.parts_per_edge;
}

// Faces of particles that move with a dynamic body are left to the body.
inline bool touches_by_itself(const Particles& particles, const Triangle& face) {
  const auto is_left_out = [&](int p) { return particles.mass[as_index(p)] == 0; };
  return std::none_of(face.begin(), face.end(), is_left_out);
}

// Calls visit(face) for those faces of `guest` that meet the box `near` (m, in the world) and come nearer to
// rigid body `host` than `margin` (m), and for some others.
template <class Visit>
void visit_near_faces(const Bodies& bodies, const DeformableBody& guest, int host,
                      const Eigen::AlignedBox3d& near, double margin, Visit&& visit) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const Pose& pose = bodies.rigid.state[as_index(host)].pose;
  const LevelSet& shape = bodies.rigid.properties[as_index(host)].shape;
  const Eigen::AlignedBox3d bounds(shape.lower(), shape.upper());
  const Mat3 to_body = pose.orientation.toRotationMatrix().transpose();
  for (int t = guest.first_triangle; t < guest.first_triangle + guest.triangle_count; ++t) {
    const Triangle& triangle = bodies.triangles[as_index(t)];
    const Vec3 &a = x[as_index(triangle[0])], &b = x[as_index(triangle[1])], &c = x[as_index(triangle[2])];
    if (!near.intersects(Eigen::AlignedBox3d(a).extend(b).extend(c))) continue;
    if (!touches_by_itself(bodies.particles, triangle)) continue;
    NearFace face;
    face.number = t;
    for (std::size_t i = 0; i < 3; ++i) face.x[i] = to_body * (x[as_index(triangle[i])] - pose.position);
    face.box = Eigen::AlignedBox3d(face.x[0]).extend(face.x[1]).extend(face.x[2]);
    face.size = face.box.diagonal().norm();
    // What touches it is nearer to the host than the margin, or inside of it.
    const double far = face.size / 2 + margin + shape.tolerance();
    const Vec3 middle = face.box.center();
    if (bounds.squaredExteriorDistance(middle) > far * far || shape.distance(middle) > far) continue;
    face.normal = (face.x[1] - face.x[0]).cross(face.x[2] - face.x[0]).normalized();
    visit(face);
  }
}

}  // namespace duet
