#include "sim/contact/detection/contact_reduction.h"

#include <algorithm>
#include <set>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/shape_samples.h"

namespace duet::contact_reduction_test {
namespace {

// Returns the samples of a guest that are nearer than `margin` (m) to a host.
std::vector<NearPoint> touches(const LevelSet& host, const LevelSet& guest, const Pose& pose, double margin,
                               double spacing = 0.1) {
  std::vector<NearPoint> found;
  const std::vector<Vec3> samples = surface_samples(guest, spacing);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vec3 x = pose.to_world(samples[i]);
    if (host.distance(x) < margin)
      found.push_back({FeatureId::point(static_cast<int>(i)), false, x, host.normal(x), host.distance(x)});
  }
  return found;
}

// Returns what the reduction keeps of `all`, for a guest of `size` (m).
std::vector<NearPoint> reduced(double size, std::vector<NearPoint> all) {
  ReductionScratch scratch;
  reduce_contacts(size, 0, all, scratch);
  return all;
}

// Returns the numbers of the points.
std::set<int> names(const std::vector<NearPoint>& list) {
  std::set<int> result;
  for (const NearPoint& touch : list) result.insert(touch.feature.index);
  return result;
}

Pose at(const Vec3& position, const Quat& orientation = Quat::Identity()) { return {position, orientation}; }

bool keeps(const std::vector<NearPoint>& kept, const Vec3& position) {
  return std::any_of(kept.begin(), kept.end(),
                     [&](const NearPoint& touch) { return (touch.position - position).norm() < 1e-12; });
}

// A cube of samples 0.1 m apart on a face keeps its four corners and four points that carry the load, whether
// the face is the ground or the top of a plate.
TEST(ContactReduction, ABoxOnAFaceKeepsCornersAndFourLoadPoints) {
  const LevelSet box = LevelSet::box(Vec3(1, 1, 1)), plate = LevelSet::box(Vec3(4, 1, 4));
  for (const LevelSet& host : {LevelSet::half_space(), plate}) {
    const double top = host.kind == LevelSet::Kind::half_space ? 0 : 0.5;
    const auto all = touches(host, box, at(Vec3(0.2, top + 0.5, 0.1)), 0.25);
    EXPECT_EQ(all.size(), 121u + 2 * 40u);  // the bottom and two rows of the sides
    const auto kept = reduced(1, all);
    EXPECT_EQ(kept.size(), 8u);
    EXPECT_EQ(names(kept).size(), 8u);
    for (const double x : {-0.3, 0.7})
      for (const double z : {-0.4, 0.6}) EXPECT_TRUE(keeps(kept, Vec3(x, top, z)));
  }
}

// Only points above a flat face form a patch. If points beside the rim belonged to it, the hull would reach
// beyond the plate, and the box would not tip over.
TEST(ContactReduction, PatchesHoldOnlyPointsAboveTheFace) {
  // Half of the box stands on a plate. Points beyond the plate's rim are above no face and are kept.
  const LevelSet plate = LevelSet::box(Vec3(2, 1, 2));
  const auto all = touches(plate, LevelSet::box(Vec3(1, 1, 1)), at(Vec3(1.03, 1, 0)), 0.04);
  const auto kept = reduced(1, all);
  for (const NearPoint& touch : all) {
    const bool above_face = touch.position.x() <= 1;
    if (!above_face) {
      EXPECT_TRUE(keeps(kept, touch.position));
    }
  }
  // The corners of the part that stands on the plate are kept.
  EXPECT_TRUE(keeps(kept, Vec3(0.53, 0.5, -0.5)));
  EXPECT_TRUE(keeps(kept, Vec3(0.93, 0.5, 0.5)));
}

// Points on a curved host and fewer than five points are all kept: nothing else stands for them.
TEST(ContactReduction, CurvedHostsAndFewPointsKeepAll) {
  const LevelSet ball = LevelSet::sphere(1), box = LevelSet::box(Vec3(1, 1, 1));
  const auto on_ball = touches(ball, box, at(Vec3(0, 1.5, 0)), 0.3);
  ASSERT_GT(on_ball.size(), 20u);
  EXPECT_EQ(reduced(1, on_ball).size(), on_ball.size());
  const auto corner =
      touches(LevelSet::half_space(), box, at(Vec3(0, 0.82, 0), Quat(1, 0.3, 0.2, 0.4).normalized()), 0.05);
  ASSERT_LT(corner.size(), 5u);
  EXPECT_EQ(reduced(1, corner).size(), corner.size());
}

// A ring that lies flat keeps the whole circle on which it lies, so that it rests on it in every direction.
TEST(ContactReduction, ARingKeepsItsRim) {
  const LevelSet ring = LevelSet::torus(0.5, 0.1);
  const auto all = touches(LevelSet::half_space(), ring, at(Vec3(0, 0.1, 0)), 0.01, 0.05);
  const auto kept = reduced(0.6, all);
  // The samples of one circle lie lowest. All of them are corners of their convex hull, and are kept.
  std::size_t lowest = 0;
  for (const NearPoint& touch : all)
    if (touch.gap < 1e-12) {
      ++lowest;
      EXPECT_TRUE(keeps(kept, touch.position));
    }
  EXPECT_GE(lowest, 24u);
}

// Checks the promise of reduce_contacts(): however the guest turns by up to 45 degrees within a step, no
// dropped point lies deeper below the face than the deepest one kept, to within a few millionths of the
// guest's size.
TEST(ContactReduction, NoDroppedPointCanSinkBelowTheKeptOnes) {
  std::mt19937 random(3);
  std::size_t dropped = 0;
  const std::vector<LevelSet> guests = {LevelSet::box(Vec3(1, 0.4, 0.7)), LevelSet::cylinder(0.4, 0.6),
                                        LevelSet::torus(0.4, 0.1)};
  for (int i = 0; i < 400; ++i) {
    const LevelSet& guest = guests[static_cast<std::size_t>(i) % guests.size()];
    // The guest lies on a face, is tilted slightly, lies on an edge, or has a random orientation.
    Quat turn = Quat::Identity();
    if (i % 5 == 1) turn = Quat(Eigen::AngleAxisd(1e-3, test::random_vector(random).normalized()));
    if (i % 5 == 2) turn = Quat(Eigen::AngleAxisd(0.4, Vec3::UnitX()));
    if (i % 5 == 3) turn = test::random_rotation(random);
    if (i % 5 == 4) turn = Quat(Eigen::AngleAxisd(1.5707963267948966, Vec3::UnitZ()));
    double lowest = 0;
    for (const Vec3& x : surface_samples(guest, 0.1)) lowest = std::min(lowest, (turn * x).y());
    const auto all = touches(LevelSet::half_space(), guest, at(Vec3(0, -lowest - 0.01, 0), turn), 0.15);
    const auto kept = reduced(0.7, all);
    dropped += all.size() - kept.size();
    ASSERT_FALSE(kept.empty());
    for (int k = 0; k < 20; ++k) {
      const Quat further(Eigen::AngleAxisd(EIGEN_PI / 4 * test::random_vector(random).x(),
                                           test::random_vector(random).normalized()));
      const auto deepest = [&](const std::vector<NearPoint>& list) {
        double least = 1e9;
        for (const NearPoint& touch : list) least = std::min(least, (further * touch.position).y());
        return least;
      };
      EXPECT_GE(deepest(all), deepest(kept) - 3e-6);  // a few millionths of the guest's size
    }
  }
  EXPECT_GT(dropped, 5000u);
}

}  // namespace
}  // namespace duet::contact_reduction_test
