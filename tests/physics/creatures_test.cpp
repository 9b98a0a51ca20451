// The first moments of the scenes of figures 1, 5, 7, 9 and 10 of Shinar et al. 2008: joints hold, flesh is
// not inverted, and bodies move as the figures show. Bounds are measurements with a margin, except where a
// comment says otherwise.
#include <algorithm>
#include <cmath>

#include "tests/support/film.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/base/rotation.h"

namespace duet::creatures_test {
namespace {

using test::Film;
using test::turn_about_x;

// When the crank has turned by 135 degrees, the soft bar has passed on a part of that twist, and the hinged
// box has tipped. The twist of the parent lies between a noticeable angle and the whole 135 degrees.
TEST(Creatures, TheBarTurnsTheHingedBox) {
  std::vector<std::string> coarser;
  if (!test::runs_in_full()) coarser.push_back("deformable.bar.shape.cells=[16,2,2]");
  Film film("bar", coarser);
  film.advance(60);
  const double parent = turn_about_x(film.pose("parent"));
  test::expect_above(parent, 0.35, "turn_of_the_parent_rad");
  test::expect_below(parent, 135 * EIGEN_PI / 180, "turn_of_the_parent_rad");
  test::expect_below(film.gap, 1e-6, "gap_of_the_hinge");
  test::expect_above(film.least_det, 0.5, "least_det_F");
  test::expect_below(film.penetration, 0.04, "penetration");
}

// The maggot lies on the ground and bends to and fro by 57 degrees (1 rad) at each joint.
TEST(Creatures, TheMaggotWriggles) {
  std::vector<std::string> coarser;
  if (!test::runs_in_full()) coarser.push_back("prefabs.maggot.parameters.spacing=0.2");
  Film film("maggot", coarser);
  const auto bend = [&] {
    return logarithm(film.pose("maggot-bone1").orientation.conjugate() *
                     film.pose("maggot-bone2").orientation)
        .norm();
  };
  film.advance(36);
  test::expect_below(bend(), 0.01, "bend_before_it_starts");
  double most = 0;
  for (int i = 0; i < 12; ++i) {
    film.advance(1);
    most = std::max(most, bend());
  }
  test::expect_above(most, 0.9, "largest_bend_rad");
  test::expect_below(most, 1.05, "largest_bend_rad");
  test::expect_below(film.gap, 1e-6, "gap");
  test::expect_above(film.least_det, 0.05, "least_det_F");
  test::expect_below(film.penetration, 0.01, "penetration");
}

// The first contacts and motions of both must not open joints or invert flesh.
TEST(Creatures, TheSnakeAndTheFishHoldTogether) {
  if (!test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  for (const auto& [body, frames] : {std::pair("snake", 16), {"fish", 6}}) {
    Film film(body);
    film.advance(frames);
    test::expect_below(film.gap, 1e-6, fmt::format("gap_{}", body));
    test::expect_above(film.least_det, 0.05, fmt::format("least_det_F_{}", body));
    test::expect_below(film.penetration, 0.01, fmt::format("penetration_{}", body));
  }
}

// The scene has coarser flesh than the figure, to save time.
TEST(Creatures, TheChainHangs) {
  std::vector<std::string> coarser;
  for (const char* ring : {"soft3", "soft6", "soft9"})
    coarser.push_back(
        fmt::format("deformable.{}.shape.spacing={}", ring, test::runs_in_full() ? 0.16 : 0.23));
  Film film("chain", coarser);
  film.advance(8);
  test::expect_below(film.gap, 1e-6, "gap");
  test::expect_above(film.least_det, 0.3, "least_det_F");
  test::expect_below(film.penetration, 0.02, "penetration");
}

}  // namespace
}  // namespace duet::creatures_test
