#include "sim/geometry/queries/triangle_pack.h"

#include <array>
#include <vector>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/base/dot_in_order.h"
#include "sim/geometry/queries/closest_points.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet::triangle_pack_test {
namespace {

using test::random_vector;

// Distances of a pack equal those of its single triangles to the last bit, so that no result depends on which
// of them a search uses. The points lie all around: faces, edges and corners are nearest. Some of the
// triangles degenerate to edges or points.
TEST(TrianglePack, HasTheDistancesOfItsTriangles) {
  std::mt19937 random(21);
  int regions[3] = {};
  for (int i = 0; i < 400; ++i) {
    std::vector<std::array<Vec3, 3>> triangles;
    TrianglePack pack;
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      std::array<Vec3, 3> t = {random_vector(random), random_vector(random), random_vector(random)};
      if (lane == 2 && i % 3 == 0) t[2] = 0.5 * (t[0] + t[1]);
      if (lane == 5 && i % 5 == 0) t[1] = t[2] = t[0];
      pack.set(lane, t[0], t[1], t[2]);
      triangles.push_back(t);
    }
    for (int k = 0; k < 30; ++k) {
      // The first point is a corner of a triangle, where squared distances are zero.
      const Vec3 x = k == 0 ? triangles[1][0] : Vec3(1.5 * random_vector(random));
      const double8 squared = pack.squared_distances(x);
      for (std::size_t lane = 0; lane < pack_width; ++lane) {
        const auto& [a, b, c] = triangles[lane];
        EXPECT_EQ(squared[lane], square_in_order(nearest_point(a, b, c, x) - x)) << i << ' ' << lane;
        const Vec3 weight = nearest_weights(a, b, c, x);
        ++regions[(weight.array() == 0).count()];
      }
    }
  }
  for (const int count : regions) EXPECT_GT(count, 5000);
}

}  // namespace
}  // namespace duet::triangle_pack_test
