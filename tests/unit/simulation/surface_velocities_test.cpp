// The velocities of drawn surfaces are the rates at which their positions change, for boundaries, skins,
// cloth and rods.
#include "tests/support/meshes.h"
#include "tests/support/recorded_run.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::test::surface_velocities_test {
namespace {

// Returns the surface positions of all bodies from number `rigid` on.
std::vector<Vec3> deformable_positions(const Simulation& simulation, std::size_t rigid) {
  std::vector<BodySurface> bodies;
  simulation.surfaces(bodies);
  std::vector<Vec3> positions;
  for (std::size_t i = rigid; i < bodies.size(); ++i)
    positions.insert(positions.end(), bodies[i].surface.positions.begin(), bodies[i].surface.positions.end());
  return positions;
}

// The velocities agree with central differences of the drawn positions while all particles move with theirs.
TEST(SurfaceVelocities, AreThoseOfThePositions) {
  for (const bool has_skin : {false, true}) {
    scene::Scene scene = one_of_each();
    if (has_skin) {
      scene.deformable[0].skin.emplace();
      scene.deformable[0].skin->mesh =
          std::make_shared<TriangleMesh>(box_mesh(Vec3::Constant(-0.15), Vec3(0.1, 0.15, 0.12)));
    }
    Simulation simulation(scene, plan(scene));
    Particles& particles = simulation.world().bodies.particles;
    // Bodies turn, stretch and shear, so that every particle moves differently from its neighbors.
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const Vec3& x = particles.x[i];
      particles.v[i] = Vec3(1, 2, 3).cross(x) + Vec3(x.y() * x.z(), -x.x(), 0.3 * x.x() * x.x());
    }
    std::vector<Vec3f> velocities;
    simulation.surface_velocities(velocities);
    constexpr double h = 1e-4;  // central differences err by h^2, floats by 1e-7
    for (std::size_t i = 0; i < particles.size(); ++i) particles.x[i] += h * particles.v[i];
    const std::vector<Vec3> after = deformable_positions(simulation, scene.rigid.size());
    for (std::size_t i = 0; i < particles.size(); ++i) particles.x[i] -= 2 * h * particles.v[i];
    const std::vector<Vec3> before = deformable_positions(simulation, scene.rigid.size());
    ASSERT_EQ(velocities.size(), after.size());
    double fastest = 0;
    for (std::size_t i = 0; i < after.size(); ++i) {
      const Vec3 expected = (after[i] - before[i]) / (2 * h);
      fastest = std::max(fastest, expected.norm());
      EXPECT_LT((velocities[i].cast<double>() - expected).norm(), 1e-4 * (1 + expected.norm())) << i;
    }
    EXPECT_GT(fastest, 0.1);
  }
}

}  // namespace
}  // namespace duet::test::surface_velocities_test
