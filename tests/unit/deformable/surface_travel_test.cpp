#include "sim/deformable/surface_travel.h"

#include <algorithm>
#include <random>

#include "tests/support/sheets.h"
#include <gtest/gtest.h>

namespace duet {
namespace {

using test::Sheets;

constexpr double thickness = 0.03;

// Sheets of 36, 16 and 9 particles.
Sheets three_sheets() {
  Sheets sheets;
  sheets.add(5, 0.1, Vec3(0, 0, 0), thickness);
  sheets.add(3, 0.1, Vec3(0, 0.2, 0), thickness);
  sheets.add(2, 0.1, Vec3(0, 0.4, 0), thickness);
  return sheets;
}

// Every body moved by its own vector.
std::vector<Vec3> moved(const Sheets& sheets, const std::array<Vec3, 3>& by) {
  std::vector<Vec3> x = sheets.x;
  const CollisionSurface& surface = sheets.surface;
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    x[static_cast<std::size_t>(surface.points[i][0])] += by[static_cast<std::size_t>(surface.point_body[i])];
  return x;
}

TEST(SurfaceTravel, TheFrameStaysWithHalfOfTheParticlesAndWholeBodiesDoNotTravelWithinThemselves) {
  const Sheets sheets = three_sheets();
  SurfaceTravel travel;
  travel.begin(sheets.surface, sheets.x);
  const Vec3 up(0, 0.5, 0), aside(0.25, 0, 0), rest = Vec3::Zero();
  // The larger body and the smallest one, 45 of 61, rise; then the two smaller ones go aside.
  travel.add(sheets.surface, moved(sheets, {up, rest, up}), moved(sheets, {up, aside, up + aside}));
  EXPECT_NEAR((travel.frame_start() - up).norm(), 0, 1e-15);
  EXPECT_NEAR((travel.frame_end() - up).norm(), 0, 1e-15) << "36 of 61 stay";
  const auto expect_ways = [&](std::size_t point, double before, double including) {
    EXPECT_NEAR(travel.shared(point).before, before, 1e-15);
    EXPECT_NEAR(travel.shared(point).including, including, 1e-15);
    EXPECT_NEAR(travel.within_body(point).including, 0, 1e-15);
  };
  expect_ways(0, 0, 0);
  expect_ways(36, 0.5, 0.75);
  expect_ways(52, 0, 0.25);
  EXPECT_NEAR(travel.longest().before, 0.5, 1e-15);
  EXPECT_NEAR(travel.longest().including, 0.75, 1e-15);
  EXPECT_NEAR(travel.pace(36, 1), 0.5, 1e-15);
  // The next motion starts elsewhere: what was looked at last does not count.
  travel.add(sheets.surface, moved(sheets, {up, rest, up}), moved(sheets, {up, rest, up}));
  expect_ways(0, 0, 0);
  expect_ways(36, 0.5, 0.5);
  expect_ways(52, 0, 0);
}

// What sleeping relies on, for any motion: since a time, two elements have come nearer by no more than their
// ways have grown together, and no way has grown by more than the longest.
TEST(SurfaceTravel, NoTwoParticlesComeNearerThanTheirWaysAllow) {
  const Sheets sheets = three_sheets();
  const CollisionSurface& surface = sheets.surface;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jump(-0.02, 0.02);
  SurfaceTravel travel;
  travel.begin(surface, sheets.x);
  std::vector<Vec3> start = sheets.x, end, first;
  std::vector<SurfaceTravel::Way> within, shared, longest;
  const std::size_t points = surface.points.size();
  for (int motion = 0; motion < 40; ++motion) {
    std::array<Vec3, 3> drift;
    for (Vec3& d : drift) d = Vec3(jump(random), jump(random), jump(random) - 0.1);
    end = start;
    for (std::size_t i = 0; i < points; ++i)
      end[static_cast<std::size_t>(surface.points[i][0])] +=
          drift[static_cast<std::size_t>(surface.point_body[i])] + 0.2 * Vec3(jump(random), jump(random), 0);
    travel.add(surface, start, end);
    if (motion == 10) {
      first = start;
      for (std::size_t i = 0; i < points; ++i) {
        within.push_back(travel.within_body(i));
        shared.push_back(travel.shared(i));
      }
      for (std::size_t body = 0; body < 3; ++body) longest.push_back(travel.longest_within(body));
      longest.push_back(travel.longest());
    }
    if (motion > 10) {
      for (std::size_t i = 0; i < points; ++i) {
        const auto body = static_cast<std::size_t>(surface.point_body[i]);
        ASSERT_LE(travel.within_body(i).including - within[i].before,
                  travel.longest_within(body).including - longest[body].before + 1e-15);
        ASSERT_LE(travel.shared(i).including - shared[i].before,
                  travel.longest().including - longest[3].before + 1e-15);
        for (std::size_t k = 0; k < i; ++k) {
          const auto distance = [&](const std::vector<Vec3>& x) {
            return (x[static_cast<std::size_t>(surface.points[i][0])] -
                    x[static_cast<std::size_t>(surface.points[k][0])])
                .norm();
          };
          const bool of_one = surface.point_body[i] == surface.point_body[k];
          const auto way = [&](std::size_t e) {
            return of_one ? travel.within_body(e).including - within[e].before
                          : travel.shared(e).including - shared[e].before;
          };
          ASSERT_GE(std::min(distance(start), distance(end)), distance(first) - way(i) - way(k) - 1e-15);
        }
      }
    }
    // Some motions are only looked at.
    if (motion % 3 != 0) start = end;
  }
}

}  // namespace
}  // namespace duet
