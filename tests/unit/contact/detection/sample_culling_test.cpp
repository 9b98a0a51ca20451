#include "sim/contact/detection/sample_culling.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/contact/detection/shape_support_point.h"
#include "sim/geometry/level_set/shape_samples.h"

namespace duet::sample_culling_test {
namespace {

constexpr double pi = std::numbers::pi;

// A rigid guest with samples 0.05 m apart.
struct Guest {
  RigidProperties properties;
  Pose pose;

  Guest(const LevelSet& shape, const Vec3& position, const Quat& orientation = Quat::Identity()) {
    properties.shape = shape;
    properties.samples = surface_samples(shape, 0.05);
    properties.inside = points_inside(shape, properties.samples);
    pose = {position, orientation};
  }
};

// A contact and its touch, as SampleCulling is asked about it.
struct Asked {
  ContactPoint contact;
  Touch touch;
};

// Returns the place `feature` of the guest (body 1) on the ground (body 0).
Asked on_ground(const Guest& guest, const FeatureId& feature) {
  RigidProperties ground;
  ground.shape = LevelSet::half_space();
  Asked asked;
  asked.touch = touch(ground, Pose(), guest.properties, guest.pose, feature);
  asked.contact.host = 0;
  asked.contact.guest_rigid = 1;
  asked.contact.feature = feature;
  asked.contact.guest_arm = asked.touch.position - guest.pose.position;
  return asked;
}

// Returns a SampleCulling that has recorded the support points of the guest.
SampleCulling told(const Guest& guest) {
  SampleCulling deepest;
  for (int k = 0; k < support_point_count(guest.properties.shape); ++k) {
    const Asked asked = on_ground(guest, FeatureId::support(k));
    EXPECT_FALSE(deepest.carry_for(asked.contact, asked.touch)) << "deepest points always count";
  }
  return deepest;
}

const Quat upright(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitX()));
const LevelSet torus = LevelSet::torus(0.5, 0.1);

// A body in a funnel touches many faces with its support points. The samples beside the last of them are
// dropped as those beside the first.
TEST(SampleCulling, KnowsTheSupportPointsOfManyFaces) {
  for (const int faces : {1, 8, 9, 16, 32}) {
    SampleCulling deepest;
    for (int i = 0; i < faces; ++i) {
      ContactPoint contact;
      contact.host = 0;
      contact.guest_rigid = 1;
      contact.guest_arm = Vec3(std::cos(0.19 * i), 0, std::sin(0.19 * i));
      const Touch touch{contact.guest_arm, -contact.guest_arm, 0, Vec3::Zero()};
      contact.feature = FeatureId::support(i);
      EXPECT_FALSE(deepest.carry_for(contact, touch));
      contact.feature = FeatureId::point(i);
      EXPECT_TRUE(deepest.carry_for(contact, touch)) << i;
    }
  }
}

// On the rim at the angle p from the lowest point, the slope up from the support point is sin(p / 2). It is
// above the limit of 0.02 from 2.3 degrees on, and within 5.7 degrees the sample is nearer than a tenth of
// the radius. So no sample of a wheel acts, however it is turned: a sample that takes load would brake the
// rolling.
TEST(SampleCulling, DropsAllSamplesOfARollingWheel) {
  for (int i = 0; i < 20; ++i) {
    const Quat turned = upright * Quat(Eigen::AngleAxisd(0.1 * i, Vec3::UnitY()));
    const Guest wheel(torus, Vec3(3, 0.6, 1), turned);
    SampleCulling deepest = told(wheel);
    int near = 0;
    for (int sample = 0; sample < static_cast<int>(wheel.properties.samples.size()); ++sample) {
      const Asked asked = on_ground(wheel, FeatureId::point(sample));
      if (asked.touch.normal.y() < 0.5 || asked.touch.gap > 0.2) continue;
      near += asked.touch.gap < 0.02;
      EXPECT_TRUE(deepest.carry_for(asked.contact, asked.touch)) << asked.touch.position.transpose();
    }
    EXPECT_GT(near, 3);
  }
}

// A torus that lies flat has one support point, which acts only for the samples within a tenth of the size.
// The other samples of the circle must act, or the ring would tip over.
TEST(SampleCulling, OnAFlatTorusDropsSamplesNearTheSupport) {
  const Guest ring(torus, Vec3(3, 0.1, 1));
  SampleCulling deepest = told(ring);
  const Vec3 lowest = on_ground(ring, FeatureId::support(0)).touch.position;
  int beside = 0, away = 0;
  for (int sample = 0; sample < static_cast<int>(ring.properties.samples.size()); ++sample) {
    const Asked asked = on_ground(ring, FeatureId::point(sample));
    if (std::abs(asked.touch.gap) > 1e-12) continue;  // only the circle of samples on which it lies
    const double distance = (asked.touch.position - lowest).norm();
    // The limit is a tenth of the distance from the center of mass, hypot(0.5, 0.1) for all of them.
    const bool is_beside = distance < 0.1 * std::hypot(0.5, 0.1);
    (is_beside ? beside : away) += 1;
    EXPECT_EQ(deepest.carry_for(asked.contact, asked.touch), is_beside) << distance;
  }
  EXPECT_GE(beside, 1);
  EXPECT_GT(away, 50);
}

// A support point acts for samples with the same host and a normal within 11.5 degrees of its own. It does
// not act for other hosts, other sides, or points of deformable bodies.
TEST(SampleCulling, NeedsTheSameHostAndNormal) {
  const Guest wheel(torus, Vec3(0, 0.6, 0), upright);
  SampleCulling deepest = told(wheel);
  Asked beside = on_ground(wheel, FeatureId::support(0));
  beside.contact.feature = FeatureId::point(0);
  beside.touch.position.x() += 0.05;
  beside.touch.gap += 0.002;
  EXPECT_TRUE(deepest.carry_for(beside.contact, beside.touch));

  Asked other_host = beside;
  other_host.contact.host = 2;
  EXPECT_FALSE(deepest.carry_for(other_host.contact, other_host.touch));

  Asked tilted = beside;  // a cosine of 0.98 is 11.5 degrees
  tilted.touch.normal = Vec3(std::sin(11 * pi / 180), std::cos(11 * pi / 180), 0);
  EXPECT_TRUE(deepest.carry_for(tilted.contact, tilted.touch));
  tilted.touch.normal = Vec3(std::sin(12 * pi / 180), std::cos(12 * pi / 180), 0);
  EXPECT_FALSE(deepest.carry_for(tilted.contact, tilted.touch));

  Asked deformable = beside;
  deformable.contact.guest_rigid = -1;
  EXPECT_FALSE(deepest.carry_for(deformable.contact, deformable.touch));

  EXPECT_FALSE(SampleCulling().carry_for(beside.contact, beside.touch)) << "nothing was told";
}

// A sample that is deeper than the support point acts. It can be: the fixed-point steps do not find the
// support point on every host.
TEST(SampleCulling, KeepsSamplesDeeperThanTheSupportPoint) {
  const Guest wheel(torus, Vec3(0, 0.6, 0), upright);
  SampleCulling deepest = told(wheel);
  Asked deeper = on_ground(wheel, FeatureId::support(0));
  deeper.contact.feature = FeatureId::point(0);
  deeper.touch.position.x() += 0.3;
  deeper.touch.gap -= 0.01;
  EXPECT_FALSE(deepest.carry_for(deeper.contact, deeper.touch));
}

}  // namespace
}  // namespace duet::sample_culling_test
