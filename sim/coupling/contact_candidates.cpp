#include "sim/coupling/contact_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

// A rigid body's level set at its pose now, with the rotation as a matrix: what a loop over many points
// queries.
struct Host {
  const LevelSet& shape;
  Mat3 to_body;
  Vec3 center;
  double radius;  // bounding, infinite for the half space

  Host(const RigidState& state, const RigidProperties& properties)
      : shape(properties.shape),
        to_body(state.pose.orientation.toRotationMatrix().transpose()),
        center(state.pose.position),
        radius(properties.shape.bounding_radius()) {}
  double distance(const Vec3& x) const { return shape.distance(to_body * (x - center)); }
};

// How far off a point may be and still be reached, for a bound on its relative speed (m/s): its motion over
// the step with a margin for what other contacts add to it.
double reach(double relative_speed, double dt) { return dt * (1.5 * relative_speed + 0.05); }

class Finder {
 public:
  Finder(const Bodies& bodies, double dt, const VelocityState& difference, ContactSet& contacts)
      : bodies_(bodies), dt_(dt), difference_(difference), contacts_(contacts) {}

  void rigid_pair(int host, int guest) {
    const auto h = as_index(host), g = as_index(guest);
    const RigidBodies& rigid = bodies_.rigid;
    if (rigid.properties[h].is_static() && rigid.properties[g].is_static()) return;
    const Host level_set(rigid.state[h], rigid.properties[h]);
    const RigidState& state = rigid.state[g];
    const RigidProperties& properties = rigid.properties[g];
    const double radius = properties.shape.bounding_radius();
    if (!std::isfinite(radius)) return;  // a half space has no points of its own

    // Nothing of the guest can be nearer than its centre's distance less its radius.
    const double speed = (state.velocity - rigid.state[h].velocity).norm() +
                         (difference_.rigid[g] - difference_.rigid[h]).norm();
    const double spin =
        state.angular_velocity.norm() * radius +
        rigid.state[h].angular_velocity.norm() * (state.pose.position - level_set.center).norm();
    const double margin = reach(speed + spin, dt_);
    const double center_distance = level_set.distance(state.pose.position);
    if (center_distance - radius > margin) return;

    const int begin = static_cast<int>(contacts_.points.size());
    if (properties.shape.kind == LevelSet::Kind::sphere) {
      add_rigid(host, guest, -1);
    } else {
      for (std::size_t i = 0; i < properties.samples.size(); ++i)
        if (level_set.distance(state.pose.to_world(properties.samples[i])) < margin)
          add_rigid(host, guest, static_cast<int>(i));
    }
    close_pair({host, guest, -1, begin, 0, 0, false});
  }

  // `margin` bounds the reach of all of the body's points, `longest` is its longest boundary edge now (m).
  void deformable_pair(int host, int deformable, double margin, double longest) {
    const auto h = as_index(host);
    const Host level_set(bodies_.rigid.state[h], bodies_.rigid.properties[h]);
    const DeformableBody& body = bodies_.deformable[as_index(deformable)];
    std::vector<double>& distances = contacts_.particle_distance;
    distances.resize(as_index(body.particle_count));
    const int begin = static_cast<int>(contacts_.points.size());
    const int first_sample = body.first_point + body.point_count - body.sample_count;
    for (int i = body.first_point; i < first_sample; ++i) {
      const int particle = bodies_.points[as_index(i)].particle[0];
      const Vec3& x = bodies_.particles.x[as_index(particle)];
      const double distance = distances[as_index(particle - body.first_particle)] = level_set.distance(x);
      if (distance < margin) add_deformable(host, level_set, i, x);
    }
    for (int i = first_sample; i < first_sample + body.sample_count; ++i) {
      const SurfacePoint& point = bodies_.points[as_index(i)];
      // A sample is no farther from its particles than their edges are long, and distances have slope one.
      if (distances[as_index(point.particle[0] - body.first_particle)] - longest < margin)
        add_deformable(host, level_set, i, weighted(point, bodies_.particles.x));
    }
    close_pair({host, -1, deformable, begin, 0, 0, false});
  }

 private:
  void add_rigid(int host, int guest, int sample) {
    const RigidProperties& a = bodies_.rigid.properties[as_index(host)];
    const RigidProperties& b = bodies_.rigid.properties[as_index(guest)];
    ContactPoint contact;
    contact.host = host;
    contact.guest_rigid = guest;
    contact.guest_point = sample;
    contact.friction = std::min(a.friction, b.friction);
    contact.restitution = std::min(a.restitution, b.restitution);
    update_geometry(bodies_, contact);
    if (std::isfinite(contact.gap)) contacts_.points.push_back(contact);
  }

  void add_deformable(int host, const Host& level_set, int index, const Vec3& x) {
    const auto h = as_index(host);
    const SurfacePoint& point = bodies_.points[as_index(index)];
    const double distance = level_set.distance(x) + point.allowance;
    const Vec3 v =
        weighted(point, bodies_.particles.v) - point_velocity(bodies_.rigid.state[h], x - level_set.center);
    const Vec3 change = weighted(point, difference_.particle) - difference_.rigid[h];
    if (distance >= reach(v.norm() + change.norm(), dt_)) return;
    ContactPoint contact;
    contact.host = host;
    contact.guest_point = index;
    contact.friction = bodies_.rigid.properties[h].friction;
    contact.restitution = 0;  // deformable bodies store and return energy by themselves (paper section 4)
    update_geometry(bodies_, contact);
    contacts_.points.push_back(contact);
  }

  void close_pair(ContactPair pair) {
    pair.end = static_cast<int>(contacts_.points.size());
    if (pair.end > pair.begin) contacts_.pairs.push_back(pair);
  }

  const Bodies& bodies_;
  double dt_;
  const VelocityState& difference_;
  ContactSet& contacts_;
};

// Axis-aligned bounds of a deformable body's particles.
Eigen::AlignedBox3d bounds(const Bodies& bodies, const DeformableBody& body) {
  Eigen::AlignedBox3d box;
  for (int p = body.first_particle; p < body.first_particle + body.particle_count; ++p)
    box.extend(bodies.particles.x[as_index(p)]);
  return box;
}

double longest_edge(const Bodies& bodies, const DeformableBody& body) {
  const std::vector<Vec3>& x = bodies.particles.x;
  double squared = 0;
  for (int i = body.first_triangle; i < body.first_triangle + body.triangle_count; ++i) {
    const Triangle& t = bodies.triangles[as_index(i)];
    for (std::size_t k = 0; k < 3; ++k)
      squared = std::max(squared, (x[as_index(t[k])] - x[as_index(t[(k + 1) % 3])]).squaredNorm());
  }
  return std::sqrt(squared);
}

double max_norm(const std::vector<Vec3>& values, const DeformableBody& body) {
  double squared = 0;
  for (int p = body.first_particle; p < body.first_particle + body.particle_count; ++p)
    squared = std::max(squared, values[as_index(p)].squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

void find_candidates(const Bodies& bodies, const CandidateFilter& filter, double dt,
                     const VelocityState& difference, ContactSet& contacts) {
  contacts.points.clear();
  contacts.pairs.clear();
  Finder finder(bodies, dt, difference, contacts);
  const int rigid_count = static_cast<int>(bodies.rigid.size());
  if (filter.rigid_pairs)
    for (int host = 0; host < rigid_count; ++host)
      for (int guest = 0; guest < rigid_count; ++guest)
        if (host != guest) finder.rigid_pair(host, guest);
  if (!filter.rigid_deformable) return;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) {
    const Eigen::AlignedBox3d box = bounds(bodies, bodies.deformable[d]);
    const double speed = max_norm(bodies.particles.v, bodies.deformable[d]) +
                         max_norm(difference.particle, bodies.deformable[d]);
    const double longest = longest_edge(bodies, bodies.deformable[d]);
    for (int host = 0; host < rigid_count; ++host) {
      const RigidState& state = bodies.rigid.state[as_index(host)];
      const RigidProperties& properties = bodies.rigid.properties[as_index(host)];
      const Vec3 middle = box.center();
      const double half_diagonal = box.sizes().norm() / 2;
      const double spin =
          state.angular_velocity.norm() * (half_diagonal + (middle - state.pose.position).norm());
      const double margin =
          reach(speed + state.velocity.norm() + difference.rigid[as_index(host)].norm() + spin, dt);
      const Host level_set(state, properties);
      // A box that the bounding sphere misses cannot touch; where there is no sphere, the level set at the
      // middle decides.
      const bool near =
          std::isfinite(level_set.radius)
              ? std::sqrt(box.squaredExteriorDistance(level_set.center)) < level_set.radius + margin
              : level_set.distance(middle) < half_diagonal + margin;
      if (near) finder.deformable_pair(host, static_cast<int>(d), margin, longest);
    }
  }
}

double max_penetration(const Bodies& bodies, const CandidateFilter& filter) {
  double least = 0;
  const RigidBodies& rigid = bodies.rigid;
  for (std::size_t h = 0; h < rigid.size(); ++h) {
    const Host level_set(rigid.state[h], rigid.properties[h]);
    for (std::size_t g = 0; filter.rigid_pairs && g < rigid.size(); ++g) {
      const RigidProperties& guest = rigid.properties[g];
      if (g == h || (guest.is_static() && rigid.properties[h].is_static())) continue;
      if (guest.shape.kind == LevelSet::Kind::sphere)
        least = std::min(least, level_set.distance(rigid.state[g].pose.position) - guest.shape.radius);
      for (const Vec3& sample : guest.samples)
        least = std::min(least, level_set.distance(rigid.state[g].pose.to_world(sample)));
    }
    if (filter.rigid_deformable)
      for (const SurfacePoint& point : bodies.points)
        least = std::min(least, level_set.distance(weighted(point, bodies.particles.x)));
  }
  return std::abs(least);  // not -0
}

}  // namespace duet
