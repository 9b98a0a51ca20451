#include "sim/contact/detection/body_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t bodies_at_once = 64;  // for each task of a parallel loop

bool is_round_about_y(LevelSet::Kind kind) {
  return kind == LevelSet::Kind::capsule || kind == LevelSet::Kind::cylinder || kind == LevelSet::Kind::torus;
}

// Returns whether the center of mass of a body that is round about the axis y of its shape lies on that axis,
// so that no spin about it moves the surface.
bool turns_about_y(const RigidProperties& properties) {
  constexpr double on_axis = 1e-9;  // distance from the axis over the size of the shape: rounding
  if (!is_round_about_y(properties.shape.kind)) return false;
  if (!properties.shape_frame) return true;
  const Vec3 center = properties.shape_frame->to_body(Vec3::Zero());
  return std::max(std::abs(center.x()), std::abs(center.z())) <= on_axis * properties.shape.min_size();
}

BodyBounds bounds_of(const RigidState& state, const RigidProperties& properties) {
  const LevelSet& shape = properties.shape;
  BodyBounds bounds;
  const Pose pose = shape_pose(properties, state.pose);
  bounds.axes = pose.orientation.toRotationMatrix();
  bounds.center = pose.position;
  bounds.velocity = state.velocity;
  bounds.thickness = shape.min_size();
  bounds.is_static = !properties.moves();
  bounds.is_dynamic = properties.is_dynamic();
  bounds.is_half_space = shape.kind == LevelSet::Kind::half_space;
  if (bounds.is_half_space) return bounds;
  if (shape.kind == LevelSet::Kind::sphere || shape.kind == LevelSet::Kind::capsule)
    bounds.radius = shape.radius;
  const Vec3 middle = (shape.lower() + shape.upper()) / 2;
  bounds.half = ((shape.upper() - shape.lower()) / 2).array() - bounds.radius;
  bounds.center += bounds.axes * middle;
  const double to_middle =
      (properties.shape_frame ? properties.shape_frame->to_world(middle) : middle).norm();
  bounds.arm = to_middle + bounds.half.norm();
  if (properties.is_ball()) return bounds;  // no spin moves its surface
  bounds.spin = state.angular_velocity;
  if (turns_about_y(properties)) bounds.spin -= bounds.spin.dot(bounds.axes.col(1)) * bounds.axes.col(1);
  return bounds;
}

BodyBounds bounds_of(const Bodies& bodies, const DeformableBody& body) {
  const Particles& particles = bodies.particles;
  Eigen::AlignedBox3d x, v;
  for (int i = body.first_particle; i < body.first_particle + body.particle_count; ++i) {
    x.extend(particles.x[as_index(i)]);
    v.extend(particles.v[as_index(i)]);
  }
  if (touches_with_skin(bodies, body))  // its vertices may lie outside of the box around the particles
    for (int i = body.first_point; i < body.first_point + body.point_count; ++i) {
      x.extend(weighted(bodies.points[as_index(i)], particles.x));
      v.extend(weighted(bodies.points[as_index(i)], particles.v));
    }
  BodyBounds bounds;
  bounds.center = x.center();
  bounds.half = x.sizes() / 2;
  bounds.radius = body.thickness / 2;
  bounds.velocity = v.center();
  bounds.velocity_half = v.sizes() / 2;
  bounds.is_deformable = true;
  return bounds;
}

// Returns how far the body reaches from its center along the unit vector e, m.
double extent(const BodyBounds& body, const Vec3& e) {
  return body.half.dot((body.axes.transpose() * e).cwiseAbs()) + body.radius;
}

// Returns by how much the velocity along e of a point of the body can exceed that of its middle, m/s.
double excess_speed(const BodyBounds& body, const Vec3& e) {
  return body.velocity_half.dot(e.cwiseAbs()) + body.spin.cross(e).norm() * body.arm;
}

// Calls visit(e) for the unit normals of all planes that are tried, directed from `a` to `b`: the axes of
// both boxes and the line between the centers, or the normal of a half space.
template <class Visit>
void for_each_direction(const BodyBounds& a, const BodyBounds& b, Visit&& visit) {
  if (a.is_half_space || b.is_half_space) {
    visit(a.is_half_space ? Vec3(a.axes.col(1)) : Vec3(-b.axes.col(1)));
    return;
  }
  const Vec3 across = b.center - a.center;
  const double length = across.norm();
  if (length > 0) visit(Vec3(across / length));
  for (const Mat3* axes : {&a.axes, &b.axes})
    for (int i = 0; i < 3; ++i) {
      const Vec3 e = axes->col(i);
      visit(Vec3(e.dot(across) < 0 ? Vec3(-e) : e));
    }
}

// Returns the distance along e (from a to b) between the planes across e that bound the two bodies, m. It is
// negative if these overlap.
double gap_along(const BodyBounds& a, const BodyBounds& b, const Vec3& e) {
  return e.dot(b.center - a.center) - (a.is_half_space ? 0 : extent(a, e)) -
         (b.is_half_space ? 0 : extent(b, e));
}

// Returns the time t (s) at which speed t + acceleration t^2 = way, where way > 0 (m), acceleration >= 0. The
// form of the root avoids cancellation. The result is infinite if the distance is never covered.
double time_for(double way, double speed, double acceleration) {
  const double root = std::sqrt(speed * speed + 4 * acceleration * way);
  if (speed > 0) return 2 * way / (speed + root);
  return acceleration > 0 ? (root - speed) / (2 * acceleration) : infinity;
}

}  // namespace

void bound_bodies(const Bodies& bodies, std::vector<BodyBounds>& bounds) {
  const std::size_t rigid_count = bodies.rigid.size();
  bounds.resize(rigid_count + bodies.deformable.size());
  parallel_for(rigid_count, bodies_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      bounds[i] = bounds_of(bodies.rigid.state[i], bodies.rigid.properties[i]);
  });
  parallel_for(bodies.deformable.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      bounds[rigid_count + i] = bounds_of(bodies, bodies.deformable[i]);
  });
}

bool touches_with_skin(const Bodies& bodies, const DeformableBody& body) {
  return body.triangle_count > 0 && body.point_count > 0 &&
         bodies.points[as_index(body.first_point)].count == 4;
}

Eigen::AlignedBox3d world_box(const BodyBounds& body, double margin) {
  const Vec3 half = (body.axes.cwiseAbs() * body.half).array() + (body.radius + margin);
  return {body.center - half, body.center + half};
}

double fastest(const BodyBounds& body) {
  return body.velocity.norm() + body.velocity_half.norm() + body.spin.norm() * body.arm;
}

double separation(const BodyBounds& a, const BodyBounds& b) {
  double largest = -infinity;
  for_each_direction(a, b, [&](const Vec3& e) { largest = std::max(largest, gap_along(a, b, e)); });
  return largest;
}

double time_apart(const BodyBounds& a, const BodyBounds& b, double depth, const Vec3& gravity) {
  const Vec3 relative = b.velocity - a.velocity;
  // This bound holds also for bodies that interlock, which no plane separates: no point moves farther than
  // the depth.
  const double all_ways = relative.norm() + a.velocity_half.norm() + b.velocity_half.norm() +
                          a.spin.norm() * a.arm + b.spin.norm() * b.arm;
  double longest = time_for(depth, all_ways, gravity.norm());
  for_each_direction(a, b, [&](const Vec3& e) {
    const double gap = gap_along(a, b, e);
    if (gap < -depth) return;
    const double approach = -relative.dot(e) + excess_speed(a, e) + excess_speed(b, e);
    longest =
        std::max(longest, time_for(std::max(gap - depth / 2, depth), approach, std::abs(gravity.dot(e))));
  });
  return longest;
}

}  // namespace duet
