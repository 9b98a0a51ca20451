#include "sim/embedding/carried_surface.h"

#include <algorithm>
#include <limits>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/geometry/queries/box_tree.h"

namespace duet {
namespace {

// Number of positions in a chunk of a parallel loop.
constexpr std::size_t grain = 256;

Eigen::AlignedBox3d box_of(const TetMesh& mesh, const Tet& tet) {
  Eigen::AlignedBox3d box;
  for (const int i : tet) box.extend(mesh.nodes[as_index(i)]);
  return box;
}

// Returns the barycentric weights of `x` in a tetrahedron. They add up to 1, and all of them are in [0, 1] if
// and only if the point is inside.
std::array<double, 4> barycentric_weights(const TetMesh& mesh, const Tet& tet, const Vec3& x) {
  const Vec3& origin = mesh.nodes[as_index(tet[0])];
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes[as_index(tet[as_index(k + 1)])] - origin;
  const Vec3 w = edges.inverse() * (x - origin);
  return {1 - w.sum(), w.x(), w.y(), w.z()};
}

double least_of(const std::array<double, 4>& weights) {
  return *std::min_element(weights.begin(), weights.end());
}

}  // namespace

CarriedSurface::CarriedSurface(const Surface& surface, const TetMesh& mesh) {
  DUET_ASSERT(!mesh.tets.empty());
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<int> items;
  double longest = 0;
  for (const Tet& tet : mesh.tets) {
    items.push_back(static_cast<int>(boxes.size()));
    boxes.push_back(box_of(mesh, tet));
    longest = std::max(longest, boxes.back().sizes().maxCoeff());
  }
  BoxTree tree;
  tree.build(boxes, items);
  carriers_.resize(surface.positions.size());
  parallel_for(carriers_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& x = surface.positions[i];
      double best = -std::numeric_limits<double>::infinity();
      int best_tet = -1;
      // Points farther outside make the search distance grow until it meets a tetrahedron's box: first to a
      // quarter of the largest box, then by factors of 2.
      for (double reach = 0; best_tet < 0; reach = std::max(2 * reach, longest / 4)) {
        const Eigen::AlignedBox3d near(x - Vec3::Constant(reach), x + Vec3::Constant(reach));
        tree.query(near, [&](int t) {
          const std::array<double, 4> weights = barycentric_weights(mesh, mesh.tets[as_index(t)], x);
          const double least = least_of(weights);
          // Choosing the smaller index among equals makes the result independent of the order of the visits.
          if (least > best || (least == best && t < best_tet)) {
            best = least;
            best_tet = t;
            carriers_[i] = {mesh.tets[as_index(t)], weights};
          }
        });
      }
    }
  });
}

Vec3 CarriedSurface::position(std::size_t i, const Vec3* nodes) const {
  const Carrier& carrier = carriers_[i];
  Vec3 x = Vec3::Zero();
  for (std::size_t k = 0; k < 4; ++k) x += carrier.weights[k] * nodes[carrier.nodes[k]];
  return x;
}

void CarriedSurface::update(const Vec3* nodes, Surface& surface) const {
  DUET_ASSERT(surface.positions.size() == carriers_.size());
  parallel_for(carriers_.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) surface.positions[i] = position(i, nodes);
  });
  update_normals(surface);
}

void CarriedSurface::interpolate(const float* of_nodes, std::vector<float>& values) const {
  values.resize(carriers_.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Carrier& carrier = carriers_[i];
    float sum = 0, weights = 0, least = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const float value = of_nodes[carrier.nodes[k]];
      const float weight = std::max(static_cast<float>(carrier.weights[k]), 0.0F);
      sum += weight * value;
      weights += weight;
      least = std::min(least, value);
    }
    values[i] = least < 0 ? least : sum / weights;
  }
}

double CarriedSurface::farthest_outside() const {
  double least = 0;
  for (const Carrier& carrier : carriers_) least = std::min(least, least_of(carrier.weights));
  return -least;
}

}  // namespace duet
