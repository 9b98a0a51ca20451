#include "sim/geometry/queries/box_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::box_tree_test {
namespace {

// Returns small boxes, some huge ones, and some far away from all others.
std::vector<Eigen::AlignedBox3d> random_boxes(std::mt19937& random, int count) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (int i = 0; i < count; ++i) {
    const double size = i % 17 == 0 ? 5 : 0.3, place = i % 23 == 0 ? 1e6 : 10;
    const Vec3 center = place * test::random_vector(random);
    const Vec3 half = size * test::random_vector(random).cwiseAbs();
    boxes.emplace_back(center - half, center + half);
  }
  return boxes;
}

std::vector<int> found(const BoxTree& tree, const Eigen::AlignedBox3d& box) {
  std::vector<int> items;
  tree.query(box, [&](int item) { items.push_back(item); });
  std::sort(items.begin(), items.end());
  return items;
}

TEST(BoxTree, FindsExactlyTheBoxesThatMeet) {
  std::mt19937 random(5);
  BoxTree tree;
  for (const int count : {0, 1, 4, 5, 300, 299, 299, 40}) {  // One tree is built again for changing boxes.
    const std::vector<Eigen::AlignedBox3d> boxes = random_boxes(random, count);
    std::vector<int> items;
    for (int i = 0; i < count; ++i)
      if (i % 7 != 3) items.push_back(i);
    tree.build(boxes, items);
    for (const Eigen::AlignedBox3d& box : random_boxes(random, 100)) {
      std::vector<int> expected;
      for (int i : items)
        if (boxes[static_cast<std::size_t>(i)].intersects(box)) expected.push_back(i);
      EXPECT_EQ(found(tree, box), expected);
    }
  }
}

TEST(BoxTree, FindsThemWhereTheyHaveMovedTo) {
  std::mt19937 random(6);
  for (const int count : {3, 17, 1000}) {
    std::vector<Eigen::AlignedBox3d> boxes = random_boxes(random, count);
    std::vector<int> items;
    for (int i = 0; i < count; ++i)
      if (i % 5 != 1) items.push_back(i);
    BoxTree tree;
    tree.build(boxes, items);
    EXPECT_EQ(tree.items(), items);
    boxes = random_boxes(random, count);
    tree.refit(boxes);
    for (const Eigen::AlignedBox3d& box : random_boxes(random, 100)) {
      std::vector<int> expected;
      for (int i : items)
        if (boxes[static_cast<std::size_t>(i)].intersects(box)) expected.push_back(i);
      EXPECT_EQ(found(tree, box), expected);
    }
  }
}

// The search finds the nearest box. It does not visit boxes that are farther than the least distance known so
// far, and thus looks at fewer than 10 of 300 on average.
TEST(BoxTree, FindsTheNearestBox) {
  std::mt19937 random(7);
  for (const int count : {0, 1, 5, 300}) {
    const std::vector<Eigen::AlignedBox3d> boxes = random_boxes(random, count);
    std::vector<int> items(static_cast<std::size_t>(count));
    std::iota(items.begin(), items.end(), 0);
    BoxTree tree;
    tree.build(boxes, items);
    std::size_t looks = 0;
    for (int i = 0; i < 200; ++i) {
      const Vec3 x = 12 * test::random_vector(random);
      double expected = std::numeric_limits<double>::infinity(), least = expected;
      for (const auto& box : boxes) expected = std::min(expected, box.squaredExteriorDistance(x));
      tree.query_near(x, least, [&](int item) {
        const double squared = boxes[static_cast<std::size_t>(item)].squaredExteriorDistance(x);
        EXPECT_LT(squared, least * (1 + 1e-12) + 1e-12);
        least = std::min(least, squared);
        ++looks;
      });
      EXPECT_EQ(least, expected);
      tree.query_near(x, expected, [&](int) { FAIL() << "nothing is nearer than that"; });
    }
    EXPECT_LT(looks, 200U * 10);
  }
}

TEST(BoxTree, CopesWithEqualBoxes) {
  const Eigen::AlignedBox3d box(Vec3::Zero(), Vec3::Ones());
  const std::vector<Eigen::AlignedBox3d> boxes(100, box);
  std::vector<int> items(100);
  std::iota(items.begin(), items.end(), 0);
  BoxTree tree;
  tree.build(boxes, items);
  EXPECT_EQ(found(tree, box), items);
  EXPECT_TRUE(found(tree, Eigen::AlignedBox3d(Vec3::Constant(1.1), Vec3::Constant(2))).empty());
}

}  // namespace
}  // namespace duet::box_tree_test
