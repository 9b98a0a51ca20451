// A body that lies on its side touches at four points whose load fractions make the forces and moments of an
// even line load, whatever it lies on.
#include "sim/contact/detection/line_contact.h"

#include <cmath>
#include <map>
#include <memory>
#include <numbers>

#include "tests/support/contacts.h"
#include "tests/support/everyday.h"
#include "tests/support/groove.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/contact/detection/shape_support_point.h"

namespace duet::line_contact_test {
namespace {

using scene::ShapeKind;
using test::Support;

constexpr double half_length = 0.5;
const Quat along_x = exponential(Vec3(0, 0, std::numbers::pi / 2));

std::vector<scene::Shape> shapes() {
  return {{.kind = ShapeKind::cylinder, .radius = 0.1, .length = 2 * half_length},
          {.kind = ShapeKind::capsule, .radius = 0.1, .length = 2 * half_length}};
}

// Returns the contacts of each patch of the scene that are support points and no samples.
std::map<int, std::vector<ContactPoint>> lines_in(const scene::Scene& scene) {
  test::ContactScene found(scene, 0.01);
  std::map<int, std::vector<ContactPoint>> lines;
  for (const ContactPoint& point : found.contacts.points)
    if (point.patch >= 0 && point.feature.is_support()) lines[point.patch].push_back(point);
  return lines;
}

// Expects that the load fractions of the four points have the moments of an even line load: with x along the
// line from its middle, in half lengths, the means of 1, x, x^2 and |x| are 1, 0, 1/3 and 1/2. The means give
// the force, the moments of even pressure, and the moment with which friction brakes spinning. The bounds are
// rounding of places up to 10 m away.
void expect_even_line(const std::vector<ContactPoint>& line, const std::string& name) {
  ASSERT_EQ(line.size(), 4U) << name;
  Vec3 middle = Vec3::Zero();
  for (const ContactPoint& point : line) middle += point.guest_arm / 4;
  double sum = 0, first = 0, second = 0, lever = 0;
  for (const ContactPoint& point : line) {
    const Vec3 way = (point.guest_arm - middle) / half_length;
    const double x = std::copysign(way.norm(), way.x() + 0.5 * way.z());
    sum += point.share;
    first += point.share * x;
    second += point.share * x * x;
    lever += point.share * std::abs(x);
    EXPECT_NEAR(point.gap, line[0].gap, 1e-13) << name;
  }
  EXPECT_NEAR(sum, 1, 1e-15) << name;
  EXPECT_NEAR(first, 0, 1e-14) << name;
  EXPECT_NEAR(second, 1.0 / 3, 1e-13) << name;
  EXPECT_NEAR(lever, 1.0 / 2, 1e-14) << name;
}

// Cylinders and capsules on their sides have one patch of four points on every kind of flat support, whatever
// their direction.
TEST(LineContact, LiesOnFacesOfAllKinds) {
  for (const scene::Shape& shape : shapes())
    for (const Support support :
         {Support::ground, Support::static_box, Support::mesh, Support::kinematic_box, Support::dynamic_box})
      for (const double turned : {0.0, 0.4, 2.0}) {
        scene::Scene scene;
        test::add_support(scene, support, 1);
        scene::RigidBody& body = test::add_shape(scene, {"log", shape, along_x, 0.1}, 1, 0);
        body.placement.orientation = exponential(Vec3(0, turned, 0)) * body.placement.orientation;
        const auto lines = lines_in(scene);
        const std::string name = fmt::format("{}, {}", name_of(support), turned);
        ASSERT_EQ(lines.size(), 1U) << name;
        expect_even_line(lines.begin()->second, name);
      }
}

// In a groove the same body has a line contact with each side.
TEST(LineContact, LiesOnBothSidesOfAGroove) {
  for (const scene::Shape& shape : shapes()) {
    scene::Scene scene;
    const double angle = 0.6;
    scene::RigidBody& host =
        test::add_mesh(scene, "groove", std::make_shared<TriangleMesh>(test::groove(angle)), 1, 1);
    host.shape.cells = 32;
    host.is_static = true;
    host.mass.reset();
    scene::RigidBody& body = test::add_ball(scene, "log", Vec3(0.2, 0.1 / std::cos(angle), 0), 0.1, 1);
    body.shape = shape;
    body.placement.orientation = along_x;
    const auto lines = lines_in(scene);
    ASSERT_EQ(lines.size(), 2U);
    for (const auto& [number, line] : lines) expect_even_line(line, "groove");
  }
}

// There is no line contact if the body stands, tilts by 0.05 rad, or lies on a round body. A coin has at most
// its rims and never four points.
TEST(LineContact, IsNoneWhereTheBodyStandsTiltsOrLiesOnARoundOne) {
  const auto count = [](const scene::Shape& shape, const Quat& orientation, Support support, double above) {
    scene::Scene scene;
    test::add_support(scene, support, 1);
    test::add_shape(scene, {"log", shape, orientation, above}, 1, 0);
    return lines_in(scene).size();
  };
  for (const scene::Shape& shape : shapes()) {
    EXPECT_EQ(count(shape, along_x, Support::ground, 0.1), 1U);
    const double tilt = 0.05;
    EXPECT_EQ(count(shape, exponential(Vec3(0, 0, tilt)) * along_x, Support::ground,
                    0.1 + half_length * std::sin(tilt)),
              0U);
    scene::Scene scene;
    test::add_ball(scene, "ball", Vec3::Zero(), 20, 1);
    scene::RigidBody& body = test::add_ball(scene, "log", Vec3(0, 20.1, 0), 0.1, 1);
    body.shape = shape;
    body.placement.orientation = along_x;
    EXPECT_EQ(lines_in(scene).size(), 0U);
  }
  const scene::Shape coin{.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.005};
  scene::Scene scene;
  test::add_support(scene, Support::ground, 1);
  test::add_shape(scene, {"coin", coin, Quat::Identity(), 0.0025}, 1, 0);
  for (const auto& [number, line] : lines_in(scene)) EXPECT_LT(line.size(), 4U);
}

// The numbers of the two inner points come after those of the ends.
TEST(LineContact, HasNumbersForItsInnerPoints) {
  for (const LevelSet& shape : {LevelSet::capsule(0.1, 1), LevelSet::cylinder(0.1, 1)}) {
    EXPECT_EQ(support_point_count(shape), 2);
    EXPECT_EQ(support_numbers(shape), 4);
  }
  EXPECT_EQ(support_numbers(LevelSet::sphere(1)), 1);
}

}  // namespace
}  // namespace duet::line_contact_test
