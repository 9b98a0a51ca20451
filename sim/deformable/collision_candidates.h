// The pairs of surface elements that are near enough to touch, found by a tree of boxes and kept from step to
// step.
#pragma once

#include <vector>

#include "sim/deformable/collision_surface.h"
#include "sim/geometry/box_tree.h"
#include "sim/geometry/continuous_collision.h"

namespace duet {

// A particle and a triangle, or two edges, that share no particle.
struct CandidatePair {
  ElementPair kind = ElementPair::point_triangle;
  std::array<int, 4> particle{};
  double thickness = 0;  // m, h of this pair
  double friction = 0;
  // Whether repulsions keep them h apart: parts of one body that were nearer than 1.5 h at time 0 belong so
  // near each other (Bridson et al. 2002, section 6.1).
  bool repels = true;
};

inline FourPoints corners(const std::array<int, 4>& particle, const std::vector<Vec3>& x) {
  return {x[static_cast<std::size_t>(particle[0])], x[static_cast<std::size_t>(particle[1])],
          x[static_cast<std::size_t>(particle[2])], x[static_cast<std::size_t>(particle[3])]};
}

inline constexpr double repulsion_range = 1.1;  // times h: pairs farther apart are no concern of repulsions

// Every particle has a box, larger than where it is and is going. As long as all stay in theirs, the pairs
// whose boxes come within repulsion_range h of each other are all that can meet, and need not be sought
// again. There are more of them than those that do come near, and which ones depends on when they were
// sought; what is near is decided by distances, and the order of the pairs is always the same: so no result
// depends on it.
class CollisionCandidates {
 public:
  // To be called whenever the particles move on straight lines from `start` to `end`, before `pairs`.
  void update(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  // In ascending order, point-triangle pairs first.
  const std::vector<CandidatePair>& pairs() const { return pairs_; }
  std::int64_t searches() const { return searches_; }

 private:
  struct Elements {  // triangles, points or edges
    std::vector<Eigen::AlignedBox3d> box;
    std::vector<int> active;  // those that another body's element, or one of their own body's, may be near
  };
  struct Chunk {  // what a range of the elements that ask found
    std::vector<int> near;
    std::vector<CandidatePair> pairs;
  };

  bool hold(const CollisionSurface& surface, const std::vector<Vec3>& start,
            const std::vector<Vec3>& end) const;
  void enlarge_boxes(const CollisionSurface& surface, const std::vector<Vec3>& start,
                     const std::vector<Vec3>& end);
  void find_active(const std::vector<int>& body_of, const CollisionSurface& surface,
                   Elements& elements) const;
  template <std::size_t N, std::size_t M>
  void find_pairs(ElementPair kind, const std::vector<std::array<int, N>>& first,
                  const std::vector<int>& first_body, const Elements& asking,
                  const std::vector<std::array<int, M>>& second, const std::vector<int>& second_body,
                  const BoxTree& tree, const CollisionSurface& surface);

  std::vector<Eigen::AlignedBox3d> particle_box_;
  std::vector<Eigen::AlignedBox3d> body_box_;
  Elements points_, edges_, triangles_;
  BoxTree edge_tree_, triangle_tree_;
  std::vector<Chunk> chunks_;
  std::vector<CandidatePair> pairs_;
  std::int64_t searches_ = 0;
};

}  // namespace duet
