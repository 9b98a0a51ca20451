// The pairs of surface elements that are near enough to touch, found by a tree of boxes, kept from step to
// step, and left alone for as long as they cannot have come near.
#pragma once

#include <array>
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
  // near each other (Bridson et al. 2002, section 6.1). Holds once the pair has been `examined`, as near ones
  // have.
  bool repels = true;
  bool of_one_body = false, examined = false;
};

inline FourPoints corners(const std::array<int, 4>& particle, const std::vector<Vec3>& x) {
  return {x[static_cast<std::size_t>(particle[0])], x[static_cast<std::size_t>(particle[1])],
          x[static_cast<std::size_t>(particle[2])], x[static_cast<std::size_t>(particle[3])]};
}

inline constexpr double repulsion_range = 1.1;  // times h: pairs farther apart are no concern of repulsions

// Every particle has a box, larger than where it is and is going, in a frame that moves with the mean of all,
// so that what falls as a whole stays where it is. As long as all stay in theirs, the pairs whose boxes come
// within repulsion_range h of each other are all that can meet, and need not be sought again.
//
// Most of them do not meet soon. How far an element's corners have moved in that frame is added up, and a
// pair that was farther apart than repulsion_range h by some distance sleeps until its two elements have
// travelled that distance together.
//
// There are more pairs than those that do come near, and which ones depends on when they were sought; what is
// near is decided by distances, and the order of the pairs is always the same: so no result depends on it.
class CollisionCandidates {
 public:
  // To be called whenever the particles move on straight lines from `start` to `end`, before `near`.
  void update(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  const std::vector<CandidatePair>& pairs() const { return pairs_; }
  // The pairs that may come within repulsion_range h of each other on the way: indices of pairs(), ascending,
  // of points and triangles first.
  const std::vector<int>& near() const { return near_; }
  std::int64_t searches() const { return searches_; }

 private:
  struct Elements {  // triangles, points or edges
    std::vector<Eigen::AlignedBox3d> box;
    std::vector<int> active;  // those that another body's element, or one of their own body's, may be near
  };
  struct Sleep {                // of a pair
    int first = 0, second = 0;  // elements, numbered as in travel_
    double until = 0;           // m, the sum of their travels up to which they cannot be near
  };
  struct Chunk {  // what a range of the elements that ask found, or of the pairs that are awake
    std::vector<int> near;
    std::vector<CandidatePair> pairs;
    std::vector<Sleep> sleeps;
  };

  void search(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
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
                  const BoxTree& tree, const CollisionSurface& surface, std::size_t first_number,
                  std::size_t second_number);
  void begin_travels(const CollisionSurface& surface, const std::vector<Vec3>& start);
  void add_travels(const CollisionSurface& surface, const std::vector<Vec3>& start,
                   const std::vector<Vec3>& end);
  void wake_pairs(const CollisionSurface& surface, const std::vector<Vec3>& start);

  Vec3 mean_ = Vec3::Zero();  // m, of the particles' positions when the pairs were sought
  std::vector<Eigen::AlignedBox3d> particle_box_;
  std::vector<Eigen::AlignedBox3d> body_box_;
  Elements points_, edges_, triangles_;
  BoxTree edge_tree_, triangle_tree_;
  std::vector<Chunk> chunks_;
  std::vector<CandidatePair> pairs_;
  std::vector<Sleep> sleeps_;  // of the pairs
  std::vector<int> near_;
  struct Travel {          // m, since the pairs were sought
    double before = 0;     // to the start of the motion that is looked at
    double including = 0;  // the farthest that it leads
  };
  std::vector<Travel> travel_;             // of points, edges and triangles, in this order
  std::vector<Vec3> last_;                 // m, of the particles, where the travels have been added up to
  std::vector<double> stretch_, further_;  // m, of the particles, to the start and on to the end
  std::int64_t searches_ = 0;
};

}  // namespace duet
