// Broad phase of self-contact: finds the pairs of surface elements that are near enough to touch by a tree of
// boxes, keeps them from step to step, and does not test a pair again until it can have come near.
#pragma once

#include <array>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/deformable/self_contact/collision_surface.h"
#include "sim/geometry/queries/box_tree.h"
#include "sim/geometry/queries/continuous_collision.h"

namespace duet {

/// A particle and a triangle, or two edges, that share no particle.
struct CandidatePair {
  ElementPair kind = ElementPair::point_triangle;  ///< point and triangle, or edge and edge
  std::array<int, 4> particle{};  ///< the particles of the first element, then those of the second
  /// m, the distance h that the pair keeps: mean of the bodies' thicknesses, or the distance at time 0 of
  /// parts of one body that lay nearer to each other than that, see initial_proximity()
  double thickness = 0;
  double friction = 0;  ///< Coulomb coefficient, the smaller one of the two bodies
  /// whether repulsions keep the elements h apart; false for parts of one body that belong near each other,
  /// see initial_proximity()
  bool repels = true;
};

/// Returns the values (positions, velocities) of the four particles of a pair.
inline FourPoints corners(const std::array<int, 4>& particle, const std::vector<Vec3>& x) {
  return {x[static_cast<std::size_t>(particle[0])], x[static_cast<std::size_t>(particle[1])],
          x[static_cast<std::size_t>(particle[2])], x[static_cast<std::size_t>(particle[3])]};
}

/// Distance beyond which pairs are no concern of repulsions, relative to h.
///
/// A larger value adds pairs that approach without touching yet.
inline constexpr double repulsion_range = 1.1;

/// Finds the pairs of elements that may come within repulsion_range h of each other.
///
/// Every particle has a box that contains its present position and the end of its motion, with room for
/// several more steps. The boxes are in a frame that moves with the mean of all particles, so what falls as a
/// whole stays in its boxes. As long as all particles stay in their boxes, only the pairs whose boxes come
/// within repulsion_range h of each other can meet. When a particle leaves its box, it gets a new one, as do
/// those that are about to leave theirs, and only the pairs of their elements are searched for again.
///
/// Most pairs do not meet soon. The distance that an element's corners have moved in that frame is
/// accumulated (its travel). A pair that was farther apart than repulsion_range h by some distance sleeps
/// until its two elements have traveled that distance together.
///
/// The set of kept pairs depends on the times of the searches. No result depends on it: all pairs that come
/// near are among them, distances decide what is near, and the order of the pairs is always the same.
class CollisionCandidates {
 public:
  /// Brings near() up to date for particles that move on straight lines from `start` to `end` (m).
  ///
  /// Must be called before near() whenever the particles are to move.
  void update(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  /// Returns the pairs that may come within repulsion_range h of each other during the motion: points and
  /// triangles first, then pairs of edges, each in the order of their elements.
  const std::vector<CandidatePair>& near() const { return near_; }
  /// Returns the number of pairs that are kept, asleep and awake.
  std::size_t kept() const { return kept_.size(); }
  /// Returns the number of searches so far.
  std::int64_t searches() const { return searches_; }

 private:
  using Box = Eigen::AlignedBox3d;
  // The points, the edges or the triangles.
  struct Elements {
    std::size_t first = 0;  // number of the first one: points, edges and triangles are numbered in this order
    std::vector<Box> box;   // by element: hull of its particles' boxes, grown by half of repulsion_range h
    // For each element: `is_active` if an element that it may touch can be near, and `is_anew` if its pairs
    // must be searched for again because its box is new or its activity has changed.
    std::vector<char> is_active, is_anew;
    std::vector<int> active, anew;  // the active elements; those of them that are also marked in is_anew
    bool few_anew = false;          // whether `anew` is short enough to have a tree of its own
    BoxTree tree, tree_anew;        // over all elements; over `anew` if there are few
  };
  // A pair, in the row of its first element.
  struct Kept {
    double until = 0;  // m, sum of the elements' travels up to which the pair cannot come near
    int second = 0;    // number of the second element, larger than that of the first
    // `repels` is that of CandidatePair, and `was_near` tells whether its thickness is the distance at time
    // 0. Both are known (`is_examined`) once the pair has been near.
    bool is_examined = false, repels = true, was_near = false;
  };
  // Range of kept_ with the pairs of one first element, in ascending order of the second.
  struct Row {
    std::size_t begin = 0, end = 0;
  };
  // Results of one chunk of first elements.
  struct Chunk {
    std::vector<int> found;
    std::vector<Kept> kept;
  };
  // Distance that the corners of an element have moved since the first search, an upper bound in m.
  struct Travel {
    double before = 0;     // up to the start of the present motion
    double including = 0;  // including the present motion
  };

  // Returns whether all particles stay in their boxes during the motion.
  bool hold(const CollisionSurface& surface, const std::vector<Vec3>& start,
            const std::vector<Vec3>& end) const;
  // Starts anew with boxes that contain nothing, for a new number of particles.
  void begin(const CollisionSurface& surface, const std::vector<Vec3>& start);
  // Renews boxes and finds the pairs of the elements whose boxes are new.
  void search(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);
  // Gives new boxes to the particles that leave theirs, or will do so soon.
  void renew_boxes(const CollisionSurface& surface, const std::vector<Vec3>& start,
                   const std::vector<Vec3>& end);
  // Renews the boxes of the elements whose particles have new ones.
  template <std::size_t N>
  void renew(const std::vector<std::array<int, N>>& corners, const std::vector<int>& body_of,
             const CollisionSurface& surface, Elements& elements) const;
  // Builds or refits the trees over the elements.
  void split(Elements& elements) const;
  // Finds for each body the others whose boxes meet its own.
  void find_neighbors();
  // Determines which elements are active.
  void find_active(const std::vector<int>& body_of, const CollisionSurface& surface,
                   Elements& elements) const;
  // Finds the pairs of the elements `asking` with the elements `asked` and appends their rows to next_.
  template <std::size_t N, std::size_t M>
  void find_rows(const std::vector<std::array<int, N>>& first, const std::vector<int>& first_body,
                 const Elements& asking, const std::vector<std::array<int, M>>& second,
                 const std::vector<int>& second_body, const Elements& asked, const CollisionSurface& surface);
  // Merges the pairs that were found for an element with those of its old row that remain.
  void merge_row(const Row& old, bool is_anew, const Elements& asked, Chunk& chunk) const;
  // Adds the motion to the travels of all elements.
  void add_travels(const CollisionSurface& surface, const std::vector<Vec3>& start,
                   const std::vector<Vec3>& end);
  // Tests the pairs that can have come near and puts those that may into near_.
  void wake_pairs(const CollisionSurface& surface, const std::vector<Vec3>& start);
  // Tests one of them, a pair of the element `first`, and appends it to `near` if it may come near.
  void wake(const CollisionSurface& surface, const std::vector<Vec3>& start, std::size_t first, Kept& kept,
            std::vector<CandidatePair>& near) const;

  Vec3 mean_ = Vec3::Zero();       // m, mean position of the particles that the boxes' frame refers to
  std::vector<Box> particle_box_;  // m, by particle, in that frame
  std::vector<double> room_;       // m, by particle: room that its box leaves it on all sides
  std::vector<char> is_renewed_;   // by particle: whether it got a new box in this search
  std::vector<Box> body_box_;      // m, by body: hull of its particles' boxes
  std::vector<std::vector<int>> neighbors_;  // by body: the bodies whose boxes meet its own
  Elements points_, edges_, triangles_;
  std::vector<Chunk> chunks_;
  std::vector<Kept> kept_, next_;      // all pairs; those of the search in progress
  std::vector<Row> rows_, next_rows_;  // by point and edge, by their numbers
  std::vector<CandidatePair> near_;
  CollectScratch<CandidatePair> near_of_ranges_;
  std::vector<Travel> travel_;  // by element
  std::vector<Vec3> last_;      // m, by particle: position up to which its travel has been added
  // In m, by particle: distance from last_ to the start, and from the start to the end.
  std::vector<double> stretch_, further_;
  std::vector<double> edge_length_;  // m, by body: mean length of its edges at time 0
  std::int64_t searches_ = 0;
};

}  // namespace duet
