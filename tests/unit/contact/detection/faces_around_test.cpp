// The support points and samples of a body touch several faces of a mesh beside the nearest one, with the
// gaps that the contact then finds there.
#include "sim/contact/detection/faces_around.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "tests/support/groove.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/contact/detection/contact_plane.h"
#include "sim/contact/detection/contact_point.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/step/world.h"

namespace duet::faces_around_test {
namespace {

Vec3 random_vector(std::mt19937& random) {
  const auto number = [&] { return 2 * (static_cast<double>(random()) / 4294967295.0) - 1; };
  const double x = number(), y = number(), z = number();
  return {x, y, z};
}

// Returns the properties of a static mesh. They are in its body space, whose origin in the space of `mesh` is
// `middle`.
RigidProperties static_mesh(const TriangleMesh& mesh, Vec3* middle = nullptr) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& body = test::add_mesh(scene, "mesh", std::make_shared<TriangleMesh>(mesh), 1, 1);
  body.is_static = true;
  body.mass.reset();
  const Simulation simulation(scene, test::plan(scene));
  const RigidBodies& rigid = simulation.world().bodies.rigid;
  if (middle) *middle = rigid.state[0].pose.position;
  return rigid.properties[0];
}

// Random bodies lie in a groove and around edges and corners of a box, at any orientation. The gap of each
// contact with a face is the one that touch() finds for it later. A rim near an edge may have another support
// point towards the nearest face, far below that face: when the search took it, the gaps differed by 0.15 m,
// which threw the body into the air.
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
          for (int k = 0; k < support_point_count(shape); ++k)
            least = std::min(least, host.shape.distance(support_point(shape, k, pose, host.shape).position));
          return least;
        };
        for (int step = 0; step < 3; ++step) pose.position -= distance() * host.shape.normal(pose.position);
        if (std::abs(distance()) > 0.01) continue;
        std::vector<NearPoint> touches;
        std::vector<EdgeContact> places;
        find_faces_around(host.shape, shape, pose, 0.05, touches, places);
        for (const NearPoint& near : touches) {
          ++found;
          const EdgePoint& face = places[as_index(near.plane_index)].edge;
          const double later = touch(host, Pose(), guest, pose, near.feature, face).gap;
          EXPECT_NEAR(later, near.gap, 0.002 * 0.25) << i;  // 0.25 m: greatest depth of inner points
        }
      }
    }
  }
  EXPECT_GT(found, 1000);
}

// Returns the normals and gaps of the planes that one sample of a body gets, the nearest first. The list is
// empty if one plane is enough.
std::vector<std::pair<Vec3, double>> planes_of(const RigidProperties& host, const Vec3& x,
                                               const Vec3& inwards) {
  RigidProperties guest;
  guest.samples = {x};
  guest.inside = {x + 0.1 * inwards.normalized()};
  NearPoint own;
  own.feature = FeatureId::point(0);
  own.position = x;
  const ContactPlane plane = contact_plane(host.shape, x, guest.inside[0]);
  own.normal = plane.normal;
  own.gap = plane.gap;
  std::vector<NearPoint> touches{own};
  std::vector<EdgeContact> places;
  find_faces_around_sample(host.shape, guest, Pose(), 0.05, 0, touches, places);
  std::vector<std::pair<Vec3, double>> planes;
  for (const NearPoint& near : touches)
    if (near.plane_index >= 0) planes.emplace_back(near.normal, near.gap);
  return planes;
}

// A sample in a concave crease has a plane for each side, at its distance, also where the sample is beside
// the bottom of the crease, from which one side rises. On one side of the groove alone one plane is enough.
TEST(FacesAround, ASampleInACreaseHasThePlanesOfBothSides) {
  for (const double angle : {0.4, 0.8, 1.2}) {
    Vec3 middle;
    const RigidProperties host = static_mesh(test::groove(angle), &middle);
    for (const double sideways : {-0.005, 0.0, 0.002}) {
      const Vec3 x(0.3, 0.015, sideways);
      const auto planes = planes_of(host, x - middle, Vec3::UnitY());
      ASSERT_EQ(planes.size(), 2U) << angle << ", " << sideways;
      for (const auto& [normal, gap] : planes) {
        const Vec3 side(0, std::cos(angle), normal.z() > 0 ? std::sin(angle) : -std::sin(angle));
        EXPECT_LT((normal - side).norm(), 1e-6);
        EXPECT_NEAR(gap, side.dot(x), 1e-9);
      }
      EXPECT_LE(planes[0].second, planes[1].second + 1e-12);
    }
    EXPECT_TRUE(planes_of(host, Vec3(0.3, 0.5 * std::tan(angle) + 0.01, 0.5) - middle, Vec3::UnitY()).empty())
        << "on one side";
  }
}

// A sample in the corner of a room, where three walls meet, has three planes. A box has convex edges and
// corners alone, and a sample beside them has no further planes.
TEST(FacesAround, ASampleInTheCornerOfARoomHasThreePlanes) {
  TriangleMesh room = test::box_mesh(-Vec3(1, 1, 1), Vec3(1, 1, 1)),
               hole = test::box_mesh(-Vec3(0.8, 0.8, 0.8), Vec3(0.8, 0.8, 0.8));
  for (Triangle& corners : hole.triangles) std::swap(corners[0], corners[1]);
  const auto first = static_cast<int>(room.positions.size());
  room.positions.insert(room.positions.end(), hole.positions.begin(), hole.positions.end());
  for (const Triangle& corners : hole.triangles)
    room.triangles.push_back({first + corners[0], first + corners[1], first + corners[2]});
  const RigidProperties host = static_mesh(room);
  const auto planes = planes_of(host, Vec3(-0.79, -0.785, 0.795), Vec3(1, 1, -1));
  ASSERT_EQ(planes.size(), 3U);
  for (const auto& [normal, gap] : planes)
    EXPECT_NEAR(gap, normal.dot(Vec3(-0.79, -0.785, 0.795)) + 0.8, 1e-9);
  const RigidProperties box = static_mesh(test::box_mesh(-Vec3(1, 1, 1), Vec3(1, 1, 1)));
  EXPECT_TRUE(planes_of(box, Vec3(1.01, 1.005, 1.002), Vec3(1, 1, 1)).empty());
  EXPECT_TRUE(planes_of(box, Vec3(1.01, 0.999, 0), Vec3(1, 0, 0)).empty());
}

// A cylinder lies on a box of triangles, reaches over its side, and is level with the top but for rounding.
// The side of the box ends at the cylinder's bottom: it is no wall that the cylinder has run into, or it
// would be thrown back by the depth to which it reaches over the side. A cylinder that has run into the side
// touches it.
TEST(FacesAround, ASideThatEndsBelowTheGuestIsNoWall) {
  const RigidProperties host = static_mesh(test::box_mesh(-Vec3(1, 0.5, 1), Vec3(1, 0.5, 1)));
  const LevelSet cylinder = LevelSet::cylinder(0.5, 0.6);
  const auto touches_side = [&](double over, double height) {
    std::vector<NearPoint> touches;
    std::vector<EdgeContact> places;
    const Pose pose{Vec3(1.5 - over, 0.5 + 0.3 + height, 0.13), Quat::Identity()};
    find_faces_around(host.shape, cylinder, pose, 0.1, touches, places);
    return std::any_of(touches.begin(), touches.end(),
                       [](const NearPoint& touch) { return touch.normal.x() > 0.99 && touch.gap < 0; });
  };
  for (const double over : {1e-4, 1e-3, 1e-2, 0.1, 0.3})
    for (const double rounding : {-1e-9, -1e-12, -1e-16, 0.0, 1e-16, 1e-12, 1e-9})
      EXPECT_FALSE(touches_side(over, rounding)) << over << " " << rounding;
  EXPECT_TRUE(touches_side(0.05, -0.02));
}

}  // namespace
}  // namespace duet::faces_around_test
