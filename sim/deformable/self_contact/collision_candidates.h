// The pairs of surface elements that are near enough to touch, found by a tree of boxes, kept from step to
// step, and left alone for as long as they cannot have come near.
#pragma once

#include <array>
#include <vector>

#include "sim/deformable/self_contact/collision_surface.h"
#include "sim/geometry/queries/box_tree.h"
#include "sim/geometry/queries/continuous_collision.h"

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

// Every particle has a box, larger than where it is and is going by as far as it goes in some steps, in a
// frame that moves with the mean of all, so that what falls as a whole stays where it is. As long as all stay
// in theirs, the pairs whose boxes come within repulsion_range h of each other are all that can meet. When
// one leaves its box, it and those that are about to get new ones, and only the pairs of their elements are
// sought again.
//
// Most pairs do not meet soon. How far an element's corners have moved in that frame is added up, and a pair
// that was farther apart than repulsion_range h by some distance sleeps until its two elements have travelled
// that distance together.
//
// There are more pairs than those that do come near, and which ones depends on when they were sought; what is
// near is decided by distances, and the order of the pairs is always the same: so no result depends on it.
class CollisionCandidates {
 public:
  // To be called whenever the particles move on straight lines from `start` to `end`, before `near`.
  void update(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  // The pairs that may come within repulsion_range h of each other on the way, of points and triangles first,
  // then in the order of their elements.
  const std::vector<CandidatePair>& near() const { return near_; }
  std::size_t kept() const { return kept_.size(); }  // pairs, asleep and awake
  std::int64_t searches() const { return searches_; }

 private:
  using Box = Eigen::AlignedBox3d;
  struct Elements {         // points, edges or triangles
    std::size_t first = 0;  // number of the first one: all elements are numbered, in this order
    std::vector<Box> box;
    // Another body's element, or one of their own body's, may be near; and it was not sought with this box.
    std::vector<char> is_active, is_anew;
    std::vector<int> active, anew;  // those, of the active ones
    bool few_anew = false;
    BoxTree tree, tree_anew;  // over all, and if they are few, over those
  };
  // What an element may meet, one of a larger number, and up to which sum of their travels (m) it cannot.
  struct Kept {
    double until = 0;
    int second = 0;
    bool is_examined = false, repels = true;  // see CandidatePair; known once they have been near
  };
  struct Row {  // of `kept_`, an element's; ascending
    std::size_t begin = 0, end = 0;
  };
  struct Chunk {  // of the elements that ask
    std::vector<int> found;
    std::vector<Kept> kept;
    std::vector<CandidatePair> near;
  };
  struct Travel {          // m, since the first search
    double before = 0;     // to the start of the motion that is looked at
    double including = 0;  // the farthest that it leads
  };

  bool hold(const CollisionSurface& surface, const std::vector<Vec3>& start,
            const std::vector<Vec3>& end) const;
  void begin(const CollisionSurface& surface, const std::vector<Vec3>& start);
  void search(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  void renew_boxes(const CollisionSurface& surface, const std::vector<Vec3>& start,
                   const std::vector<Vec3>& end);
  template <std::size_t N>
  void renew(const std::vector<std::array<int, N>>& corners, const std::vector<int>& body_of,
             const CollisionSurface& surface, Elements& elements) const;
  void split(Elements& elements) const;
  void find_neighbours();
  void find_active(const std::vector<int>& body_of, const CollisionSurface& surface,
                   Elements& elements) const;
  template <std::size_t N, std::size_t M>
  void find_rows(const std::vector<std::array<int, N>>& first, const std::vector<int>& first_body,
                 const Elements& asking, const std::vector<std::array<int, M>>& second,
                 const std::vector<int>& second_body, const Elements& asked, const CollisionSurface& surface);
  void merge_row(const Row& old, bool is_anew, const Elements& asked, Chunk& chunk) const;
  void add_travels(const CollisionSurface& surface, const std::vector<Vec3>& start,
                   const std::vector<Vec3>& end);
  void wake_pairs(const CollisionSurface& surface, const std::vector<Vec3>& start);

  Vec3 mean_ = Vec3::Zero();       // m, of the particles' positions when the frame was where their boxes are
  std::vector<Box> particle_box_;  // m
  std::vector<double> room_;       // m, that it leaves a particle on all sides
  std::vector<char> is_renewed_;   // in this search
  std::vector<Box> body_box_;
  std::vector<std::vector<int>> neighbours_;  // bodies whose boxes meet one's
  Elements points_, edges_, triangles_;
  std::vector<Chunk> chunks_;
  std::vector<Kept> kept_, next_;
  std::vector<Row> rows_, next_rows_;  // of points and edges, by their numbers
  std::vector<CandidatePair> near_;
  std::vector<Travel> travel_;             // of all elements
  std::vector<Vec3> last_;                 // m, of the particles, where the travels have been added up to
  std::vector<double> stretch_, further_;  // m, of the particles, to the start and on to the end
  std::vector<double> edge_length_;        // m, of the bodies, the mean
  std::int64_t searches_ = 0;
};

}  // namespace duet
