#include "sim/deformable/self_contact/self_collision.h"

#include "tests/support/sheets.h"
#include <gtest/gtest.h>

#include "sim/base/parallel.h"

namespace duet::self_collision_test {
namespace {

using test::Sheets;

// Two sheets that lie over each other with a small gap.
Sheets two_sheets() {
  Sheets sheets;
  sheets.add(6, 0.1, Vec3(0, 0, 0), 0.01);
  sheets.add(5, 0.1, Vec3(0.03, 0.02, 0.04), 0.01);
  return sheets;
}

// Returns the positions with random displacements of up to `size` (m) along each axis.
std::vector<Vec3> displaced(const std::vector<Vec3>& x, double size, std::mt19937& random) {
  std::vector<Vec3> moved = x;
  for (Vec3& position : moved) position += size * test::random_vector(random);
  return moved;
}

// Random displacements of all particles, up to several edges long, crumple two sheets: nothing crosses, and
// momentum is that of the wanted displacements.
TEST(SelfCollision, NothingCrossesHoweverParticlesMove) {
  std::mt19937 random(11);
  Sheets sheets = two_sheets();
  CollisionCandidates candidates;
  SelfCollision collision;
  std::int64_t impulses = 0, zone_particles = 0;
  double mass = 0;
  for (const double inverse : sheets.inverse_mass) mass += 1 / inverse;
  for (int step = 0; step < 30; ++step) {
    const double size = std::array{0.005, 0.03, 0.3}[static_cast<std::size_t>(step % 3)];
    const std::vector<Vec3> start = sheets.x, wanted = displaced(start, size, random);
    sheets.x = wanted;
    const SelfCollision::Outcome outcome =
        collision.resolve(sheets.surface, start, sheets.inverse_mass, candidates, sheets.x);
    ASSERT_FALSE(outcome.unresolved);
    ASSERT_EQ(sheets.intersections(), 0U) << "step " << step;
    impulses += outcome.impulses;
    zone_particles += outcome.zone_particles;
    const auto [linear, angular] = test::momentum_of(start, sheets.x, sheets.inverse_mass);
    const auto [wanted_linear, wanted_angular] = test::momentum_of(start, wanted, sheets.inverse_mass);
    EXPECT_LE((linear - wanted_linear).norm(), 1e-13);
    // Impulses act where elements meet, a displacement away from their starting positions, so the defect of
    // angular momentum is of second order in the displacements.
    EXPECT_LE((angular - wanted_angular).norm(), 0.05 * mass * size * size);
  }
  EXPECT_GT(impulses, 100);
  EXPECT_GT(zone_particles, 0);
}

// The end positions have the same bits for any number of threads, and for candidates that were kept or found
// afresh.
TEST(SelfCollision, DoesNotDependOnThreadsOrOnEarlierSearches) {
  std::mt19937 random(12);
  Sheets sheets = two_sheets();
  CollisionCandidates kept;
  for (int step = 0; step < 6; ++step) {
    const std::vector<Vec3> start = sheets.x, wanted = displaced(start, 0.01, random);
    std::vector<Vec3> ends[2] = {wanted, wanted};
    SelfCollision collision;
    set_thread_count(1);
    collision.resolve(sheets.surface, start, sheets.inverse_mass, kept, ends[0]);
    set_thread_count(4);
    CollisionCandidates fresh;
    collision.resolve(sheets.surface, start, sheets.inverse_mass, fresh, ends[1]);
    EXPECT_EQ(ends[0], ends[1]);
    sheets.x = ends[0];
  }
  set_thread_count(0);
}

// One particle falls on a triangle with three times its mass, and both end up a tenth of the thickness apart.
struct Drop {
  CollisionSurface surface;
  std::vector<Vec3> start{Vec3(0.3, 1, 0.3), Vec3(0, 0, 0),     Vec3(1, 0, 0),
                          Vec3(0, 0, 1),     Vec3(0.3, 5, 0.3), Vec3(1.3, 5, 0.3)};
  std::vector<double> inverse_mass = std::vector<double>(6, 1.0);
  static constexpr double thickness = 0.01;
  Drop() {
    surface.add({false, thickness, 0}, std::vector<Triangle>{{1, 2, 3}}, {});
    surface.add({false, thickness, 0}, std::vector<Triangle>{{0, 4, 5}}, {});
    surface.finish(start);
  }
  SelfCollision::Outcome resolve(std::vector<Vec3>& end) const {
    CollisionCandidates candidates;
    return SelfCollision().resolve(surface, start, inverse_mass, candidates, end);
  }
};

// One impulse stops the particle at the tenth of the thickness above the triangle, and the sum of momenta
// stays.
TEST(SelfCollision, AParticleStopsAtATenthOfTheThickness) {
  const Drop drop;
  std::vector<Vec3> end = drop.start;
  end[0].y() = -1;
  const SelfCollision::Outcome outcome = drop.resolve(end);
  EXPECT_EQ(outcome.impulses, 1);
  EXPECT_EQ(outcome.zone_particles, 0);
  const double height = 0.4 * end[1].y() + 0.3 * end[2].y() + 0.3 * end[3].y();
  EXPECT_NEAR(end[0].y() - height, 0.1 * Drop::thickness, 1e-14);
  EXPECT_NEAR(end[0].y() + end[1].y() + end[2].y() + end[3].y(), -1, 1e-14);
}

// Held particles do not move, and the free one takes the whole correction. If all are held, the outcome names
// the pair.
TEST(SelfCollision, HeldParticlesStayWhereTheyAreTold) {
  Drop drop;
  for (const std::size_t p : {1, 2, 3}) drop.inverse_mass[p] = 0;
  std::vector<Vec3> end = drop.start;
  end[0].y() = -1;
  EXPECT_FALSE(drop.resolve(end).unresolved);
  EXPECT_NEAR(end[0].y(), 0.1 * Drop::thickness, 1e-14);
  for (const std::size_t p : {1, 2, 3}) EXPECT_EQ(end[p], drop.start[p]);

  drop.inverse_mass[0] = 0;  // now no particle can give way
  end = drop.start;
  end[0].y() = -1;
  const auto outcome = drop.resolve(end);
  ASSERT_TRUE(outcome.unresolved);
  EXPECT_EQ(*outcome.unresolved, (std::array<int, 4>{0, 1, 2, 3}));
}

// Zones that share a particle become one, zones move rigidly with the momentum of their particles, and
// particles outside of zones stay as they are.
TEST(ImpactZones, KeepMomentumAndDistances) {
  std::mt19937 random(13);
  std::vector<Vec3> start(12);
  std::vector<double> inverse_mass(start.size());
  for (std::size_t p = 0; p < start.size(); ++p) {
    start[p] = test::random_vector(random);
    inverse_mass[p] = 1.5 + test::random_vector(random).x();
  }
  for (std::size_t p = 8; p < 12; ++p) start[p] = static_cast<double>(p) * Vec3(1, 2, -1);  // on a line
  std::vector<Vec3> end = displaced(start, 0.5, random);
  const std::vector<Vec3> wanted = end;
  ImpactZones zones;
  zones.clear(start.size());
  EXPECT_TRUE(zones.join(std::array{0, 1, 2, 3}));
  EXPECT_TRUE(zones.join(std::array{5, 3, 4, 1}));
  EXPECT_FALSE(zones.join(std::array{0, 5}));
  EXPECT_TRUE(zones.join(std::array{8, 9, 10, 11}));
  EXPECT_TRUE(zones.together(std::array{0, 5}));
  EXPECT_FALSE(zones.together(std::array{0, 8}));
  EXPECT_EQ(zones.particle_count(), 10);
  ASSERT_TRUE(zones.move(start, inverse_mass, end));
  for (const std::size_t p : {6, 7}) EXPECT_EQ(end[p], wanted[p]);
  const auto [linear, angular] = test::momentum_of(start, end, inverse_mass);
  const auto [wanted_linear, wanted_angular] = test::momentum_of(start, wanted, inverse_mass);
  EXPECT_LE((linear - wanted_linear).norm(), 1e-13);
  // The particles 8 to 11 lie on a line. The angular momentum about that line is zero anyway, so nothing is
  // lost there.
  EXPECT_LE((angular - wanted_angular).norm(), 1e-12 * 100);
  for (std::size_t p = 0; p < 6; ++p)
    for (std::size_t q = 0; q < p; ++q)
      EXPECT_GE((end[p] - end[q]).norm(), (start[p] - start[q]).norm() * (1 - 1e-14));
}

}  // namespace
}  // namespace duet::self_collision_test
