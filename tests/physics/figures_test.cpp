// Events that figures 1, 4, 7 and 9 of Shinar et al. 2008 show, in coarse variants of their scenes, coarser
// in short runs than in long ones. Bounds are geometry where a comment derives them, else measurements with a
// margin.
#include <algorithm>
#include <cmath>

#include "tests/support/film.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

namespace duet::figures_test {
namespace {

using test::Film;
using test::turn_about_x;

// Adds settings of coarse solves to the overrides of a scene.
std::vector<std::string> coarse(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(),
                   {"solver.cg_tolerance=1e-3", "solver.contact_iterations=10", "solver.face_samples=2"});
  return overrides;
}

// Returns a setting that has one value in the long tests and another in the others.
std::string setting(const std::string& key, double full, double quick) {
  return fmt::format("{}={}", key, test::runs_in_full() ? full : quick);
}

// Figure 1. The last ring makes a turn within 1.5 s, and the chain passes it on from member to member. No
// member leaves its neighbors: rings of 1 m with tubes of 0.25 m do not touch if they are 2.5 m apart. (Round
// rings that are linked would be at most 2 m apart, but soft ones stretch.) A loop of six links of 1.2 m,
// pulled straight between two rings, adds its 3.6 m to the radii of their holes.
TEST(Figures, TheChainHoldsTogetherAndPassesTheTwistOn) {
  if (!test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  Film film("chain", coarse({setting("parameters.spacing", 0.23, 0.25),
                             "rigid.ring10.motion.keyframes=["
                             "{ time = 0, rotation = { axis = [1, 0, 0], degrees = 270 } }, "
                             "{ time = 1, rotation = { axis = [1, 0, 0], degrees = 270 } }, "
                             "{ time = 2.5, rotation = { axis = [1, 0, 0], degrees = 630 } }]"}));
  const double start4 = turn_about_x(film.pose("ring4")), start7 = turn_about_x(film.pose("ring7"));
  double longest_loop = 0, farthest = 0;
  for (int frame = 0; frame < 60; ++frame) {
    film.advance(1);
    std::vector<Vec3> members;
    for (const char* name : {"ring1", "soft3", "ring4", "soft6", "ring7", "soft9", "ring10"})
      members.push_back(film.centers(name).front());
    for (std::size_t i = 0; i + 1 < members.size(); ++i) {
      double& most = i % 2 == 0 ? longest_loop : farthest;
      most = std::max(most, (members[i + 1] - members[i]).norm());
    }
  }
  test::expect_below(longest_loop, 3.6 + 2 * 0.75, "over_a_loop_m");
  test::expect_below(farthest, 2.5, "from_ring_to_ring_m");
  const double turn4 = turn_about_x(film.pose("ring4")) - start4,
               turn7 = turn_about_x(film.pose("ring7")) - start7;
  test::expect_above(turn7, 1, "turn_of_ring_7_rad");
  test::expect_below(turn4, turn7, "turn_of_ring_4_rad");
  test::expect_below(turn7, 2 * EIGEN_PI, "turn_of_ring_7_rad");
  test::expect_below(film.gap, 1e-6, "gap_m");
}

// Figure 4. All bodies land on the cloth and sink it, the stroke of the rim tosses them up, and they fall
// back onto it.
TEST(Figures, TheTrampolineTossesAllUpAndCatchesThem) {
  if (!test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  Film film(
      "trampoline",
      coarse({"parameters.balls=3", "parameters.red=1", "parameters.orange=1", "parameters.yellow=1",
              "deformable.cloth.shape.disc.rings=14", "instances.ball.scatter.upper=[4.8, 8, 4.8]",
              "instances.red.scatter.upper=[4.8, 10, 4.8]", "instances.orange.scatter.upper=[4.8, 10, 4.8]",
              "instances.yellow.scatter.upper=[4.8, 11, 4.8]"}));
  const auto heights = [&] {
    std::vector<double> result;
    for (const char* name : {"ball", "red", "orange", "yellow"})
      for (const Vec3& center : film.centers(name)) {
        EXPECT_LT(std::hypot(center.x(), center.z()), 7) << name << " is beside the cloth";
        result.push_back(center.y());
      }
    return result;
  };
  film.advance(52);
  const std::vector<double> before = heights();
  ASSERT_EQ(before.size(), 6U);
  std::vector<double> apex = before;
  for (int frame = 52; frame < 104; ++frame) {
    film.advance(1);
    const std::vector<double> now = heights();
    for (std::size_t i = 0; i < now.size(); ++i) apex[i] = std::max(apex[i], now[i]);
  }
  const std::vector<double> after = heights();
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT(before[i], 3);  // m, height of the rim
    test::expect_above(apex[i] - before[i], 1.5, "apex_m");
    EXPECT_LT(after[i], 3);
  }
}

// Figure 7. The snake winds sideways and up the stairs, the lowest of which are 35 and 55 cm high.
TEST(Figures, TheSnakeWindsUpTheStairs) {
  if (!test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  Film film("snake", coarse({setting("prefabs.snake.parameters.spacing", 0.2, 0.28),
                             "prefabs.snake.parameters.start=0"}));
  film.advance(24);  // by now it has landed
  const Vec3 start = film.centers("snake-skin").front();
  film.advance(96);
  const Vec3 way = film.centers("snake-skin").front() - start;
  test::expect_above(-way.z(), 6, "way_to_the_stairs_m");
  test::expect_above(way.y(), 0.25, "climbed_m");
  test::expect_below(film.gap, 1e-6, "gap_m");
}

// Figure 9. Ten maggots, or four in short runs, fall into the bowl, which is hollow up to 4.2 m from its
// center, and stay there.
TEST(Figures, MaggotsStayInTheBowl) {
  if (!test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  Film film("bowl", coarse({"prefabs.maggot.parameters.spacing=0.22",
                            setting("instances.maggot.scatter.count", 10, 4),
                            "instances.maggot.scatter.upper=[2.6, 7, 2.6]"}));
  film.advance(36);
  for (int frame = 36; frame < 60; ++frame) {
    film.advance(1);
    for (const Vec3& part : film.centers("maggot")) {
      EXPECT_LT((part - Vec3(0, 5.1, 0)).norm(), 4.2) << "frame " << frame;
      EXPECT_LT(part.y(), 5.1) << "frame " << frame;
    }
  }
  test::expect_below(film.penetration, 0.002, "penetration_m");
}

}  // namespace
}  // namespace duet::figures_test
