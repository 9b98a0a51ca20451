// What a round body touches of a mesh beside the nearest face is where the contact will look for it.
#include "sim/coupling/faces_around.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "tests/support/groove.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/coupling/contact_point.h"
#include "sim/coupling/deepest_point.h"
#include "sim/step/world.h"

namespace duet {
namespace {

Vec3 random_vector(std::mt19937& random) {
  const auto number = [&] { return 2 * (static_cast<double>(random()) / 4294967295.0) - 1; };
  const double x = number(), y = number(), z = number();
  return {x, y, z};
}

RigidProperties static_mesh(const TriangleMesh& mesh) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& body = test::add_mesh(scene, "mesh", std::make_shared<TriangleMesh>(mesh), 1, 1);
  body.is_static = true;
  body.mass.reset();
  const Simulation simulation(scene, test::plan(scene));
  return simulation.world().bodies.rigid.properties[0];
}

// In a groove and around edges and corners, at any orientation. Of a rim that comes near an edge another
// point may be deepest towards the nearest face, and far below it: by 0.15 m, which threw the body into the
// air.
TEST(FacesAround, HaveTheGapsThatTheContactFinds) {
  std::mt19937 random(1);
  int found = 0;
  for (const TriangleMesh& mesh :
       {test::box_mesh(-Vec3(0.4, 0.3, 0.5), Vec3(0.4, 0.3, 0.5)), test::groove(0.6)}) {
    const RigidProperties host = static_mesh(mesh);
    for (const LevelSet& shape :
         {LevelSet::sphere(0.2), LevelSet::capsule(0.15, 0.5), LevelSet::cylinder(0.3, 0.4),
          LevelSet::cylinder(0.3, 0.05), LevelSet::torus(0.25, 0.07)}) {
      RigidProperties guest;
      guest.shape = shape;
      for (int i = 0; i < 4000; ++i) {
        Pose pose{0.8 * random_vector(random), exponential(3 * random_vector(random))};
        const auto distance = [&] {
          double least = 1;
          for (int k = 0; k < deepest_point_count(shape); ++k)
            least = std::min(least, host.shape.distance(deepest_point(shape, k, pose, host.shape).position));
          return least;
        };
        for (int step = 0; step < 3; ++step) pose.position -= distance() * host.shape.normal(pose.position);
        if (std::abs(distance()) > 0.01) continue;
        std::vector<NearPoint> touches;
        std::vector<NearRidge> places;
        find_faces_around(host.shape, shape, pose, 0.05, touches, places);
        for (const NearPoint& near : touches) {
          ++found;
          const LowestPlace& face = places[as_index(near.ridge)].lowest;
          const double later = touch(host, Pose(), guest, pose, near.point, face).gap;
          EXPECT_NEAR(later, near.gap, 0.002 * 0.25) << i;  // inner points lie up to 0.25 m in
        }
      }
    }
  }
  EXPECT_GT(found, 1000);
}

}  // namespace
}  // namespace duet
