// Bodies with bound particles are composite bodies: mass, center of mass and inertia are known on paper.
#include "sim/embedding/embedded_particles.h"

#include <gtest/gtest.h>

#include "sim/base/rotation.h"

namespace duet::embedded_particles_test {
namespace {

// A body of 2 kg with the principal moments 1, 2 and 3 kg m^2, in motion, and the particles bound to it.
struct Loaded {
  RigidBodies rigid;
  Particles particles;
  std::vector<EmbeddedParticle> bound;
  Vec3 v, w;      // m/s and rad/s, of the body before it has a load
  Pose at_first;  // its pose then

  Loaded() {
    RigidProperties properties;
    properties.shape = LevelSet::box(Vec3(1, 2, 3));
    properties.mass = 2;
    properties.inverse_mass = 0.5;
    properties.inertia = Vec3(1, 2, 3);
    RigidState state;
    state.pose = {Vec3(5, -3, 2), exponential(Vec3(0.3, -0.7, 0.4))};
    state.velocity = Vec3(1, 2, -3);
    set_angular_velocity(state, properties, Vec3(-1, 0.5, 2));
    v = state.velocity;
    w = state.angular_velocity;
    at_first = state.pose;
    rigid.name = {"bone"};
    rigid.properties = {properties};
    rigid.state = {state};
  }
  // Binds a particle of `mass` (kg) at `arm` (m, in the frame of the body without a load).
  void bind(double mass, const Vec3& arm) {
    const std::size_t p = particles.size();
    particles.x.push_back(at_first.to_world(arm));
    particles.v.push_back(Vec3::Zero());
    particles.mass.push_back(mass);
    particles.inverse_mass.push_back(1 / mass);
    bound.push_back(embed_particle(p, 0, rigid, particles));
  }
  void take_over() { take_over_masses(rigid, bound, particles); }
  RigidState& state() { return rigid.state[0]; }
  RigidProperties& properties() { return rigid.properties[0]; }
  // Returns the inertia (kg m^2) about the center of mass in the frame of the body without a load.
  Mat3 inertia() {
    const Mat3 R = (at_first.orientation.conjugate() * state().pose.orientation).toRotationMatrix();
    return R * properties().inertia.asDiagonal() * R.transpose();
  }
};

// 2 kg at the origin and 2 kg at 1 m along x: M = 4 kg, c = 0.5 m, and the parallel axes add 4 * 0.5^2 = 1 kg
// m^2 about y and z.
TEST(EmbeddedParticles, ALoadOnAnAxisShiftsTheCenter) {
  Loaded loaded;
  loaded.bind(2, Vec3(1, 0, 0));
  loaded.take_over();
  EXPECT_DOUBLE_EQ(loaded.properties().mass, 4);
  EXPECT_DOUBLE_EQ(loaded.properties().inverse_mass, 0.25);
  EXPECT_LT((loaded.properties().inertia - Vec3(1, 3, 4)).norm(), 1e-14);
  EXPECT_LT((loaded.state().pose.position - loaded.at_first.to_world(Vec3(0.5, 0, 0))).norm(), 1e-14);
  EXPECT_EQ(loaded.state().pose.orientation.coeffs(), loaded.at_first.orientation.coeffs());
  ASSERT_TRUE(loaded.properties().shape_frame.has_value());
  EXPECT_LT((loaded.properties().shape_frame->position - Vec3(-0.5, 0, 0)).norm(), 1e-15);
  EXPECT_LT((loaded.bound[0].arm - Vec3(0.5, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(loaded.particles.mass[0], 0);
  EXPECT_EQ(loaded.particles.inverse_mass[0], 0);
}

// Two particles off the axes, 1 kg at (1, 1, 0) and 4 kg at (0, 0.5, -1): M = 7 kg and c = (1, 3, -4) / 7.
// The tensor about the old center is diag(1, 2, 3) plus
//     [1 -1 0; -1 1 0; 0 0 2] + 4 [1.25 0 0; 0 1 0.5; 0 0.5 0.25],
// and that about c has 7 (c.c 1 - c c^T) less.
TEST(EmbeddedParticles, LoadsOffTheAxesTurnThePrincipalAxes) {
  Loaded loaded;
  loaded.bind(1, Vec3(1, 1, 0));
  loaded.bind(4, Vec3(0, 0.5, -1));
  loaded.take_over();
  Mat3 expected;
  expected << 7, -1, 0, -1, 7, 2, 0, 2, 6;
  const Vec3 c = Vec3(1, 3, -4) / 7;
  expected -= 7 * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
  EXPECT_LT((loaded.inertia() - expected).norm(), 1e-13);
  EXPECT_LT((loaded.state().pose.position - loaded.at_first.to_world(c)).norm(), 1e-14);
  EXPECT_GT(loaded.state().pose.orientation.angularDistance(loaded.at_first.orientation), 0.1);
  for (int i = 0; i < 2; ++i) {  // the particles stay
    const EmbeddedParticle& b = loaded.bound[static_cast<std::size_t>(i)];
    EXPECT_LT((loaded.state().pose.to_world(b.arm) - loaded.particles.x[b.particle]).norm(), 1e-14);
    EXPECT_LT((loaded.state().pose.position + b.offset - loaded.particles.x[b.particle]).norm(), 1e-14);
  }
}

// The shape stays where it is, and every point of it has the velocity that it had: v' = v + w x (c' - c).
TEST(EmbeddedParticles, ALoadLeavesShapeAndRigidMotion) {
  Loaded loaded;
  loaded.bind(1, Vec3(1, 1, 0));
  loaded.bind(4, Vec3(0, 0.5, -1));
  loaded.take_over();
  const Pose shape = shape_pose(loaded.rigid, 0);
  EXPECT_LT((shape.position - loaded.at_first.position).norm(), 1e-14);
  EXPECT_LT(shape.orientation.angularDistance(loaded.at_first.orientation), 1e-14);
  EXPECT_LT((shape_velocity(loaded.state(), loaded.properties()) - loaded.v).norm(), 1e-14);
  EXPECT_LT((loaded.state().angular_velocity - loaded.w).norm(), 1e-14);
  const Mat3 R = loaded.at_first.orientation.toRotationMatrix();
  const Vec3 L = R * loaded.inertia() * R.transpose() * loaded.w;
  EXPECT_LT((loaded.state().angular_momentum - L).norm(), 1e-13);
}

// Equal loads on both sides leave center and axes: body space and shape space stay one. Two particles of 1.5
// kg at 2 m add 2 * 1.5 * 4 = 12 kg m^2 about two axes.
TEST(EmbeddedParticles, SymmetricLoadsLeaveTheFrame) {
  Loaded loaded;
  loaded.bind(1.5, Vec3(0, 2, 0));
  loaded.bind(1.5, Vec3(0, -2, 0));
  loaded.take_over();
  EXPECT_FALSE(loaded.properties().shape_frame.has_value());
  EXPECT_EQ(loaded.state().pose.position, loaded.at_first.position);
  EXPECT_DOUBLE_EQ(loaded.properties().mass, 5);
  EXPECT_LT((loaded.properties().inertia - Vec3(13, 2, 15)).norm(), 1e-13);
  EXPECT_LT((loaded.state().angular_velocity - loaded.w).norm(), 1e-14);
}

// Anchors of springs have no mass and leave the body as it is.
TEST(EmbeddedParticles, ParticlesWithoutMassLeaveTheBody) {
  Loaded loaded;
  loaded.bind(1, Vec3(1, 1, 0));
  loaded.bound[0].mass = 0;
  loaded.take_over();
  EXPECT_FALSE(loaded.properties().shape_frame.has_value());
  EXPECT_EQ(loaded.properties().mass, 2);
  EXPECT_EQ(loaded.properties().inertia, Vec3(1, 2, 3));
}

}  // namespace
}  // namespace duet::embedded_particles_test
