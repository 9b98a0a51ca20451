// Strain statistics of tetrahedra.
#include "sim/deformable/forces/tet_strain.h"

#include "tests/support/scenes.h"
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::tet_strain_test {
namespace {

// A tetrahedron with the stretches 3, 0.5 and 1 has the determinant 1.5; after a reflection with a stretch of
// 2 it has -3 and counts as inverted.
TEST(TetStrain, OfATetThatIsStretchedAndOneThatIsReflected) {
  const std::vector<Vec3> rest{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 1)};
  const std::vector<Tet> tets{{0, 1, 2, 3}};
  const std::vector<Mat3> inverse_rest{edge_matrix(tets[0], rest).inverse()};
  std::vector<Vec3> x = rest;
  for (Vec3& p : x) p = Vec3(3 * p.x(), 0.5 * p.y(), p.z()) + Vec3(7, 8, 9);
  FiniteElements::Strain strain;
  take_strain(tets, inverse_rest, x, strain);
  std::vector<float> drawn(4, 0.5);
  raise_strain(tets, inverse_rest, x, drawn);
  EXPECT_EQ(drawn, std::vector<float>(4, 2));  // the largest of |3 - 1|, |0.5 - 1| and the value before, 0.5
  EXPECT_NEAR(strain.min_det, 1.5, 1e-14);
  EXPECT_NEAR(strain.max_stretch, 3, 1e-14);
  EXPECT_EQ(strain.inverted, 0);
  for (Vec3& p : x) p.z() = -2 * p.z();
  take_strain(tets, inverse_rest, x, strain);  // in addition to the first result
  EXPECT_NEAR(strain.min_det, -3, 1e-13);
  EXPECT_NEAR(strain.max_stretch, 3, 1e-14);
  EXPECT_EQ(strain.inverted, 1);
  raise_strain(tets, inverse_rest, x, drawn);
  EXPECT_EQ(drawn, std::vector<float>(4, FiniteElements::inverted));
}

// The statistics count the tetrahedra of spring bodies as well as finite elements: all tetrahedra of a
// reflected spring body are inverted.
TEST(TetStrain, StatisticsKnowOfSpringBodies) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "elements", Vec3::Zero(), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "springs", Vec3(5, 0, 0), Vec3(1, 1, 1), 3);
  scene.materials[1].has_springs = true;
  scene.fps = 1e6;  // so that nothing moves far in a frame
  Simulation simulation(scene, test::plan(scene));
  EXPECT_EQ(simulation.stats().inverted, 0);
  EXPECT_NEAR(simulation.stats().min_det_F, 1, 1e-12);
  Bodies& bodies = simulation.world().bodies;
  for_each_particle(bodies.deformable[1], [&](std::size_t p) { bodies.particles.x[p].y() *= -1; });
  simulation.advance_frame();
  EXPECT_EQ(static_cast<std::size_t>(simulation.stats().inverted),
            bodies.tets.size() - bodies.forces.elements.size());
  EXPECT_GT(simulation.stats().inverted, 0);
  EXPECT_NEAR(simulation.stats().min_det_F, -1, 1e-3);
}

}  // namespace
}  // namespace duet::tet_strain_test
