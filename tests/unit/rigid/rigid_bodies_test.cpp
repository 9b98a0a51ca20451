#include "sim/rigid/rigid_bodies.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace duet::rigid_bodies_test {
namespace {

// Returns the properties of a box of the given size (m) and mass (kg).
RigidProperties box_properties(const Vec3& size, double mass) {
  RigidProperties properties;
  properties.shape = LevelSet::box(size);
  properties.mass = mass;
  properties.inverse_mass = 1 / mass;
  properties.inertia = mass * unit_inertia(properties.shape);
  return properties;
}

// Returns the state after a free rotation of `time` (s) about nearly the middle axis, in `steps` steps.
RigidState spin(int steps, double time, OrientationUpdate update) {
  const RigidProperties properties = box_properties(Vec3(1, 2, 3), 5);
  RigidState state;
  set_angular_velocity(state, properties, Vec3(0.1, 2, 0.05));
  for (int i = 0; i < steps; ++i) {
    state.pose = evolved_pose(state, time / steps, update);
    update_orientation_dependents(state, properties);
  }
  return state;
}

// Returns the angle between two orientations, rad.
double angle_between(const Quat& a, const Quat& b) { return a.angularDistance(b); }

// Halving the step divides the error of the orientation by four with the second-order update (Shinar et al.
// 2008, section 4.1), and by two with the first-order update.
TEST(RigidBodies, OrientationUpdateConvergesAtItsOrder) {
  const RigidState exact = spin(100, 2, OrientationUpdate::exact);
  const auto slope = [&](OrientationUpdate update) {
    const double coarse = angle_between(spin(500, 2, update).pose.orientation, exact.pose.orientation);
    const double fine = angle_between(spin(1000, 2, update).pose.orientation, exact.pose.orientation);
    return std::log2(coarse / fine);
  };
  EXPECT_NEAR(slope(OrientationUpdate::second_order), 2, 0.1);
  EXPECT_NEAR(slope(OrientationUpdate::first_order), 1, 0.1);
  // The exact update gives the same motion in long and short steps, to the rounding of 200 steps.
  EXPECT_LT(angle_between(spin(7, 2, OrientationUpdate::exact).pose.orientation, exact.pose.orientation),
            1e-13);
}

// Angular momentum stays to the bit. Energy stays to rounding with the exact update, and with the
// second-order one its error is less than a tenth of that with the first-order one.
TEST(RigidBodies, FreeRotationKeepsMomentumAndNearlyEnergy) {
  const RigidProperties properties = box_properties(Vec3(1, 2, 3), 5);
  const RigidState start = spin(0, 2, OrientationUpdate::exact),
                   exact = spin(50, 2, OrientationUpdate::exact),
                   second = spin(500, 2, OrientationUpdate::second_order),
                   first = spin(500, 2, OrientationUpdate::first_order);
  // The angular momentum is the variable that is stored.
  EXPECT_EQ(second.angular_momentum, start.angular_momentum);
  const double energy = kinetic_energy(start, properties);
  const double error = std::abs(kinetic_energy(second, properties) - energy);
  EXPECT_LT(error, 0.1 * std::abs(kinetic_energy(first, properties) - energy));
  EXPECT_NEAR(kinetic_energy(exact, properties), energy, 1e-14 * energy);
}

// Half a second at (1, 2, 3) m/s and pi rad/s moves and turns the pose by known amounts, and to_body() undoes
// to_world().
TEST(RigidBodies, PoseAfterAQuarterTurn) {
  const RigidProperties properties = box_properties(Vec3(1, 1, 1), 1);
  RigidState state;
  state.velocity = Vec3(1, 2, 3);
  set_angular_velocity(state, properties, Vec3(0, std::numbers::pi, 0));
  const Pose pose = evolved_pose(state, 0.5, OrientationUpdate::exact);
  EXPECT_TRUE(pose.to_world(Vec3::UnitX()).isApprox(Vec3(0.5, 1, 1.5) - Vec3::UnitZ(), 1e-14));
  EXPECT_TRUE(pose.to_body(pose.to_world(Vec3(3, 2, 1))).isApprox(Vec3(3, 2, 1), 1e-14));
}

// A rotation of 1e-9 rad keeps its relative precision: sin(a) / a from a difference would lose it.
TEST(RigidBodies, TinyRotationsKeepTheirDigits) {
  const RigidProperties properties = box_properties(Vec3(1, 1, 1), 1);
  RigidState state;
  set_angular_velocity(state, properties, Vec3(0, 1e-9, 0));
  EXPECT_NEAR(evolved_pose(state, 1, OrientationUpdate::exact).orientation.y(), 0.5e-9, 1e-24);
}

// Kinematic bodies have no inertia, and turn at their prescribed rate with every update.
TEST(RigidBodies, ABodyWithoutInertiaTurnsAtItsRate) {
  RigidState state;
  state.angular_velocity = Vec3(0, 0, 2);
  for (const auto update :
       {OrientationUpdate::first_order, OrientationUpdate::second_order, OrientationUpdate::exact})
    EXPECT_LT(angle_between(evolved_pose(state, 0.25, update).orientation,
                            Quat(std::cos(0.25), 0, 0, std::sin(0.25))),
              1e-15);
}

// The energy is m v^2 / 2 + I_z w^2 / 2 with I_z = m (a^2 + b^2) / 12.
TEST(RigidBodies, KineticEnergyOfASpinningBox) {
  const RigidProperties properties = box_properties(Vec3(2, 3, 4), 12);
  RigidState state;
  state.velocity = Vec3(3, 0, 0);
  set_angular_velocity(state, properties, Vec3(0, 0, 2));
  EXPECT_DOUBLE_EQ(kinetic_energy(state, properties), 0.5 * 12 * 9 + 0.5 * 13 * 4);  // I_z = 12 (4 + 9) / 12
}

}  // namespace
}  // namespace duet::rigid_bodies_test
