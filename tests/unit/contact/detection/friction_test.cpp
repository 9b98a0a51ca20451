#include "sim/contact/detection/friction.h"

#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::friction_test {
namespace {

// Returns a contact with the normal y and the response matrix K (1/kg).
FrictionContact contact_with(const Mat3& K, double friction) {
  return {Vec3::UnitY(), ContactResponse(K, Vec3::UnitY()), friction};
}

// The matrix sticking() maps a tangential velocity to the tangential impulse that stops it, and a normal
// velocity to zero, for eccentric contacts of bodies with very different masses as well. The bounds are
// rounding; an inverse of K itself would lose the digits of the ratio 1e6.
TEST(ContactResponse, StickingStopsTangentialVelocities) {
  std::mt19937 random(3);
  for (const double ratio : {1.0, 1e6}) {
    const Mat3 A = Mat3::NullaryExpr([&] { return test::random_vector(random).x(); });
    const Mat3 K = A * A.transpose() + (0.1 * Vec3(1, ratio, 1)).asDiagonal().toDenseMatrix();
    const Vec3 n = test::random_vector(random).normalized();
    const ContactResponse response(K, n);
    const Vec3 tangential = n.cross(test::random_vector(random));
    const Vec3 impulse = response.sticking() * tangential;
    EXPECT_LT(std::abs(impulse.dot(n)), 1e-13 * impulse.norm());
    EXPECT_LT(n.cross(tangential - K * impulse).norm(), 1e-12 * (K * impulse).norm());
    EXPECT_LT((response.sticking() * n).norm(), 1e-13 * response.sticking().norm());
  }
}

// A contact gets no impulse if its normal velocity is above its target, however it slides.
TEST(Friction, SeparatingContactGetsNothing) {
  const FrictionContact contact = contact_with(Mat3::Identity(), 0.5);
  EXPECT_TRUE(friction_impulse(contact, Vec3(1, 0.1, 0), 0).isZero(0));
  // This contact closes more slowly than its target: its gap lasts for the step.
  EXPECT_TRUE(friction_impulse(contact, Vec3(1, -0.4, 0), -0.5).isZero(0));
}

// With K = 1/m, the impulse that stops the contact is within the cone, or it slides with the normal impulse m
// v_n and friction mu m v_n against the direction (0.6, 0.8) of the tangential velocity.
TEST(Friction, SticksWithinTheConeAndSlidesOutside) {
  const Mat3 K = 0.5 * Mat3::Identity();  // 2 kg against the world
  const Vec3 sticking = friction_impulse(contact_with(K, 0.5), Vec3(0.4, -1, 0), 0);
  EXPECT_TRUE((Vec3(0.4, -1, 0) + K * sticking).isZero(1e-15));
  const Vec3 sliding = friction_impulse(contact_with(K, 0.5), Vec3(3, -1, 4), 0);
  EXPECT_TRUE(sliding.isApprox(Vec3(-0.5 * 2 * 0.6, 2, -0.5 * 2 * 0.8), 1e-14));
}

// Without friction the impulse is normal and reaches the target: 1 + 0.25 with K = 1.
TEST(Friction, WithoutFrictionOnlyTheNormalActs) {
  const Vec3 impulse = friction_impulse(contact_with(Mat3::Identity(), 0), Vec3(3, -1, 4), 0.25);
  EXPECT_TRUE(impulse.isApprox(Vec3(0, 1.25, 0)));
}

// For any symmetric positive definite K the normal velocity after the impulse is the target, and the impulse
// lies in the cone. Coupling between normal and tangential directions that is left out would miss the target.
TEST(Friction, ReachesTheTargetInsideTheConeForCoupledContacts) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 200; ++i) {
    Mat3 A;
    for (int k = 0; k < 9; ++k) A(k / 3, k % 3) = uniform(random);
    const Mat3 K = A * A.transpose() + 0.3 * Mat3::Identity();
    const Vec3 velocity(uniform(random), -1 - uniform(random), uniform(random));
    const double friction = 0.3 + 0.3 * uniform(random), target = 0.5 * uniform(random) - 0.5;
    const Vec3 impulse = friction_impulse(contact_with(K, friction), velocity, target);
    if (velocity.y() >= target) continue;
    EXPECT_NEAR((velocity + K * impulse).y(), target, 1e-13);
    EXPECT_LE(Vec3(impulse.x(), 0, impulse.z()).norm(), friction * impulse.y() * (1 + 1e-12));
  }
}

// The energy that an impulse j adds is j . v + j . K j / 2. The limit scales j such that it adds none, leaves
// an impulse alone that takes energy out, and drops one that pushes in the direction of the motion.
TEST(Friction, EnergyLimitNeverLetsAnImpulseAddEnergy) {
  const Mat3 K = Vec3(1, 2, 3).asDiagonal();
  const Vec3 velocity(0.5, -1, 0);
  const auto gain = [&](const Vec3& j) { return j.dot(velocity) + 0.5 * j.dot(K * j); };
  const Vec3 strong(0, 5, 1);
  EXPECT_GT(gain(strong), 0);
  EXPECT_LE(gain(limit_energy(K, velocity, strong)), 1e-12);
  const Vec3 fair(0, 0.5, 0);
  EXPECT_EQ(limit_energy(K, velocity, fair), fair);
  EXPECT_TRUE(limit_energy(K, velocity, Vec3(1, 0, 0)).isZero());  // pushes in the direction of the motion
}

}  // namespace
}  // namespace duet::friction_test
