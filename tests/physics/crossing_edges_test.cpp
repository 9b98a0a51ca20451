// Rigid bodies touch where their edges cross, anywhere between the samples of their surfaces.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>

#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/geometry/level_set/mesh_distance.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/step/world.h"

namespace duet::crossing_edges_test {
namespace {

// Two equal boxes meet with the middles of two edges at right angles, halfway between two samples. The normal
// passes through both centers of mass, so the result is that of a central impact, v' = v (1 +- e) / 2,
// without spin. Contact at samples alone lets the edges pass through each other until a sample is inside.
TEST(CrossingEdges, OfTwoBoxesBounceLikeACentralImpact) {
  const double speed = 2, restitution = 0.5, half = std::sqrt(0.5);
  scene::Scene scene = test::free_space();
  auto& lower = test::add_box(scene, "lower", Vec3::Zero(), Vec3(1, 1, 1.1), 3);
  lower.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitZ()));
  lower.restitution = restitution;
  auto& upper = test::add_box(scene, "upper", Vec3(0, 2 * half + 0.1, 0), Vec3(1.1, 1, 1), 3);
  upper.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitX()));
  upper.restitution = restitution;
  upper.placement.velocity = Vec3(0, -speed, 0);
  Simulation simulation(scene, test::plan(scene));
  const auto& state = simulation.world().bodies.rigid.state;
  for (const RigidProperties& box : simulation.world().bodies.rigid.properties)
    for (const Vec3& sample : box.samples)
      ASSERT_GT(std::abs(sample.x()) + std::abs(sample.z()), 0.04) << "a sample in the middle of an edge";
  double overlap = 0;
  for (int frame = 0; frame < 4; ++frame) {
    simulation.advance_frame();
    overlap = std::max(overlap, 2 * half - (state[1].pose.position - state[0].pose.position).y());
  }
  EXPECT_LT(overlap, 1e-12);
  // The place of an edge contact is known to half a hundredth of the distance between two nodes of the edge.
  // An impulse that far from the center turns the box, and friction takes a part of the slip that the turn
  // brings.
  const double change = speed * (1 + restitution) / 2, off = 0.005 * 1.1 / 9, inertia = (1.1 * 1.1 + 1) / 12,
               spin = change * off / inertia;
  for (const RigidState& box : state) {
    EXPECT_LT(box.angular_velocity.norm(), 1.01 * spin);
    EXPECT_LT(std::hypot(box.velocity.x(), box.velocity.z()), spin * half);
  }
  EXPECT_NEAR(state[0].velocity.y(), -change, spin * off);
  EXPECT_NEAR(state[1].velocity.y(), change - speed, spin * off);
}

// Returns how deep (m) the edges of `edges` are inside of `other`, which `box` bounds. It looks at nine
// points of every edge, an eighth of its length apart.
double depth(const TriangleMesh& edges, const MeshDistance& other, const Eigen::AlignedBox3d& box) {
  double deepest = 0;
  for (const auto& triangle : edges.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(triangle[static_cast<std::size_t>(k)]),
                 b = static_cast<std::size_t>(triangle[static_cast<std::size_t>((k + 1) % 3)]);
      if (a > b) continue;  // the triangle on its other side has it
      for (int i = 0; i <= 8; ++i) {
        const Vec3 x = edges.positions[a] + i / 8.0 * (edges.positions[b] - edges.positions[a]);
        if (box.contains(x)) deepest = std::max(deepest, -other.at(x).distance);
      }
    }
  return deepest;
}

// Rings of a mesh, 30 cm thick and with sharp edges, fall on each other from random poses. The depth is
// measured along all edges, independently of the places at which contact detection looks.
TEST(CrossingEdges, OfRingsInAHeapStayOutOfEachOther) {
  const int count = 6;
  scene::Scene scene = test::on_ground(0.3);
  const auto mesh = test::asset("ring.obj");
  std::mt19937 random(7);
  for (int i = 0; i < count; ++i) {
    scene::RigidBody& ring = test::add_mesh(scene, fmt::format("ring{}", i), mesh, 0.3, 100);
    ring.placement.position = Vec3(0, 1.2 + 2.3 * i, 0) + 0.2 * test::random_vector(random);
    ring.placement.orientation = test::random_rotation(random);
    ring.restitution = 0.5;
  }
  Simulation simulation(scene, test::plan(scene));
  std::vector<BodySurface> surfaces;
  double deepest = 0;
  int touching = 0;
  for (int frame = 0; frame < 48; ++frame) {
    simulation.advance_frame();
    simulation.surfaces(surfaces);
    std::vector<TriangleMesh> rings;
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const BodySurface& ring : surfaces) {
      TriangleMesh& mesh_now = rings.emplace_back(test::mesh_of(ring.surface));
      repair(mesh_now);  // pictures have the vertices of sharp edges twice
      Eigen::AlignedBox3d& box = boxes.emplace_back();
      for (const Vec3& x : mesh_now.positions) box.extend(x);
    }
    for (std::size_t host = 0; host < rings.size(); ++host) {
      std::optional<MeshDistance> distance;
      for (std::size_t guest = 0; guest < rings.size(); ++guest) {
        if (guest == host || !boxes[host].intersects(boxes[guest])) continue;
        if (!distance) distance.emplace(rings[host]);
        deepest = std::max(deepest, depth(rings[guest], *distance, boxes[host]));
      }
    }
    touching += simulation.stats().contacts;
  }
  // The rings must have met. How many contacts press at the ends of frames is left to chance; there are some
  // 100.
  EXPECT_GT(touching, 50);
  // Without edge contacts the depth was 13.4 mm. The bound is above what samples leave: they look up a grid
  // of distances with cells of 11 mm, which rounds edges off.
  test::expect_below(deepest, 2e-3, "overlap_m");
}

}  // namespace
}  // namespace duet::crossing_edges_test
