#include "sim/deformable/support_point.h"

#include <cmath>

#include <gtest/gtest.h>

namespace duet::support_point_test {
namespace {

// Four triangles around the particle 0 at (0, height, 0). The other particles are at y = 0, 1 m from the
// axis.
struct Pyramid {
  explicit Pyramid(double height)
      : x{Vec3(0, height, 0), Vec3::UnitX(), -Vec3::UnitZ(), -Vec3::UnitX(), Vec3::UnitZ()},
        triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}},
        around(elements_around(5, triangles)) {}
  FacesAround look(const SurfacePoint& point, const Vec3& toward) const {
    return look_around(around, triangles, x, point, weighted(point, x), toward);
  }
  std::vector<Vec3> x;
  std::vector<Triangle> triangles;
  ElementLists around;
};

SurfacePoint at_particle(int p) { return {.particle = {p, 0, 0, 0}}; }

// On a plane every direction but the normal rises, by the sine of its angle from the normal.
TEST(SupportPoint, OfAPlaneIsEveryPointInTheDirectionOfItsNormal) {
  const Pyramid plane(0);
  const SurfacePoint middle_of_edge{.particle = {0, 1, 0, 0}, .weight = {0.5, 0.5, 0, 0}, .count = 2};
  const SurfacePoint in_face{.particle = {0, 1, 2, 0}, .weight = {0.2, 0.3, 0.5, 0}, .count = 3};
  for (const SurfacePoint& point : {at_particle(0), middle_of_edge, in_face})
    for (const double angle : {0.0, 0.1, 1.0, 1.5})
      for (const double turn : {0.0, 0.3, 2.0}) {
        const Vec3 toward(std::sin(angle) * std::cos(turn), std::cos(angle),
                          std::sin(angle) * std::sin(turn));
        const FacesAround faces = plane.look(point, toward);
        EXPECT_NEAR(faces.rise, std::sin(angle), 1e-15) << point.count << ' ' << angle << ' ' << turn;
        EXPECT_NEAR(faces.max_facing, std::cos(angle), 1e-15);
      }
  EXPECT_EQ(plane.look(at_particle(0), Vec3::UnitY()).count, 4);
  EXPECT_EQ(plane.look(middle_of_edge, Vec3::UnitY()).count, 2);
  EXPECT_EQ(plane.look(in_face, Vec3::UnitY()).count, 1);
}

// The top of a pyramid is a support point for all directions between the normals of its sides, from which its
// faces fall away by their slope. The bottom of a dent rises by that slope and is none.
TEST(SupportPoint, OfATopIsTheTopAndOfADentNone) {
  for (const double height : {0.2, 1.0, 5.0}) {
    const double steep = height / std::sqrt(0.5 + height * height);  // sine of the slope of a side
    EXPECT_LT(Pyramid(height).look(at_particle(0), Vec3::UnitY()).rise, 0);
    EXPECT_NEAR(Pyramid(-height).look(at_particle(0), Vec3::UnitY()).rise, steep, 1e-15);
    const Vec3 sideways = Vec3(1, 0.9 * height, 0).normalized();
    EXPECT_LT(Pyramid(height).look(at_particle(0), Vec3(height, 1, 0).normalized()).rise, 1e-15);
    EXPECT_GT(Pyramid(height).look(at_particle(1), sideways).rise, -1);
  }
}

// A point on no boundary face has no faces around it and rises nowhere.
TEST(SupportPoint, OnNoFaceThereIsNothingThatRises) {
  const Pyramid plane(0);
  const SurfacePoint across{.particle = {1, 3, 0, 0}, .weight = {0.5, 0.5, 0, 0}, .count = 2};
  const FacesAround none = plane.look(across, Vec3::UnitX());
  EXPECT_EQ(none.count, 0);
  EXPECT_EQ(none.rise, -1);
}

}  // namespace
}  // namespace duet::support_point_test
