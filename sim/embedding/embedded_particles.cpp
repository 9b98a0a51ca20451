#include "sim/embedding/embedded_particles.h"

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"
#include "sim/deformable/spin.h"

namespace duet {
namespace {

// Shift of a center of mass over the radius of gyration, and product of inertia over the trace of the
// tensor, that count as none: a thousand times their rounding. Symmetric loads leave no more.
constexpr double no_change = 1e-12;

// Returns the moments of a body, with the bound particles that number `body` carries, in its body space.
MassMoments moments_with_bound(const RigidProperties& properties, std::size_t body,
                               const std::vector<EmbeddedParticle>& bound) {
  MassMoments moments = moments_of_masses([&](auto&& visit) {
    visit(properties.mass, Vec3::Zero());
    for (const EmbeddedParticle& b : bound)
      if (b.body == body) visit(b.mass, b.arm);
  });
  moments.inertia.diagonal() += properties.inertia;
  return moments;
}

// Returns the center of mass and the principal axes of `moments` as a pose, and sets `inertia` to the
// principal moments, in the order of these axes. Changes that are rounding are left out.
Pose principal_frame(const MassMoments& moments, Vec3& inertia) {
  const Mat3& I = moments.inertia;
  const double trace = I.trace();
  Pose frame;
  if (moments.center.squaredNorm() > no_change * no_change * trace / moments.mass)
    frame.position = moments.center;
  inertia = I.diagonal();
  if (Vec3(I(1, 0), I(2, 0), I(2, 1)).cwiseAbs().maxCoeff() <= no_change * trace) return frame;
  const SymmetricEigen<3> axes = symmetric_eigen<3>(I);
  Mat3 rotation = axes.vectors;
  if (rotation.determinant() < 0) rotation.col(2) = -rotation.col(2);
  frame.orientation = Quat(rotation).normalized();
  inertia = axes.values;
  return frame;
}

}  // namespace

EmbeddedParticle embed_particle(std::size_t p, std::size_t body, const RigidBodies& rigid,
                                Particles& particles) {
  DUET_ASSERT(rigid.properties[body].is_dynamic());
  const Pose& pose = rigid.state[body].pose;
  const double mass = particles.mass[p];
  particles.mass[p] = particles.inverse_mass[p] = 0;
  return {p, body, p, mass, pose.to_body(particles.x[p]), particles.x[p] - pose.position};
}

void take_over_masses(RigidBodies& rigid, std::vector<EmbeddedParticle>& bound, const Particles& particles) {
  std::vector<double> load(rigid.size(), 0);  // kg
  for (const EmbeddedParticle& b : bound) load[b.body] += b.mass;
  for (std::size_t body = 0; body < rigid.size(); ++body) {
    if (load[body] == 0) continue;
    RigidProperties& properties = rigid.properties[body];
    RigidState& state = rigid.state[body];
    const Vec3 angular_velocity = state.angular_velocity;
    const MassMoments moments = moments_with_bound(properties, body, bound);
    const Pose frame = principal_frame(moments, properties.inertia);
    properties.mass = moments.mass;
    properties.inverse_mass = 1 / moments.mass;
    if (!frame.position.isZero(0) || !frame.orientation.vec().isZero(0)) {
      move_body_space(frame, state, properties);
      for (EmbeddedParticle& b : bound) {
        if (b.body != body) continue;
        b.arm = frame.to_body(b.arm);
        b.offset = particles.x[b.at] - state.pose.position;
      }
    }
    set_angular_velocity(state, properties, angular_velocity);
  }
}

void follow_bodies(const RigidBodies& rigid, std::vector<EmbeddedParticle>& bound, Particles& particles) {
  for (EmbeddedParticle& b : bound) {
    const RigidState& state = rigid.state[b.body];
    particles.x[b.particle] = state.pose.to_world(b.arm);
    b.offset = particles.x[b.at] - state.pose.position;
    particles.v[b.particle] = point_velocity(state, b.offset);
  }
}

void follow_twists(const std::vector<EmbeddedParticle>& bound, const std::vector<Vec3>& linear,
                   const std::vector<Vec3>& angular, std::vector<Vec3>& velocity) {
  DUET_ASSERT(linear.size() == angular.size());
  for (const EmbeddedParticle& b : bound)
    velocity[b.particle] = linear[b.body] + angular[b.body].cross(b.offset);
}

void add_force_twists(const RigidBodies& rigid, const std::vector<EmbeddedParticle>& bound,
                      const std::vector<Vec3>& force, double scale, std::vector<Vec3>& linear,
                      std::vector<Vec3>& angular) {
  DUET_ASSERT(linear.size() == rigid.size() && angular.size() == rigid.size());
  for (const EmbeddedParticle& b : bound) {
    linear[b.body] += scale * rigid.properties[b.body].inverse_mass * force[b.particle];
    angular[b.body] += scale * (rigid.state[b.body].inverse_inertia * b.offset.cross(force[b.particle]));
  }
}

double equivalent_mass(const RigidProperties& body, const std::vector<EmbeddedParticle>& bound,
                       std::size_t number) {
  // The result is the largest c with M >= c sum J^T J, where J maps the body's twist to the velocity of a
  // particle. That is the inverse of the largest eigenvalue of M^-1/2 (sum J^T J) M^-1/2; M is diagonal in
  // the body's axes. `root` is the diagonal of M^-1/2.
  Vec6 root;
  root << Vec3::Constant(1 / std::sqrt(body.mass)), body.inertia.cwiseSqrt().cwiseInverse();
  Mat6 unit = Mat6::Zero();
  for (const EmbeddedParticle& b : bound) {
    if (b.body != number) continue;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Mat3::Identity(), -skew(b.arm);
    unit += jacobian.transpose() * jacobian;
  }
  DUET_ASSERT(unit(0, 0) > 0);  // the body has a bound particle
  return 1 / symmetric_eigen<6>(root.asDiagonal() * unit * root.asDiagonal()).values[5];
}

}  // namespace duet
