// Code that tests share gives equal numbers with every compiler, and fails where a test is wrong.
#include <stdexcept>

#include "tests/support/everyday.h"
#include "tests/support/film.h"
#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::test::support_test {
namespace {

TEST(Support, RotationsDrawTheAxisFirst) {
  std::mt19937 random(5), again(5);
  for (int i = 0; i < 10; ++i) {
    const Quat rotation = random_rotation(random);
    const Vec3 axis = random_vector(again).normalized();
    const double angle = 3 * random_vector(again).x();
    EXPECT_EQ(rotation.coeffs(), Quat(Eigen::AngleAxisd(angle, axis)).coeffs());
  }
}

TEST(Support, NamesOfNoBodyFailWithTheName) {
  Film film("stack");
  try {
    film.body("misspelled");
    ADD_FAILURE() << "a body was found";
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "no body is called `misspelled`");
  }
  EXPECT_THROW(index_of_shape(film.bodies()), std::out_of_range);
  EXPECT_EQ(&film.body(film.bodies().rigid.name[1]), &film.bodies().rigid.state[1]);
}

}  // namespace
}  // namespace duet::test::support_test
