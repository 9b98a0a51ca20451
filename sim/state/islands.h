// Islands: sets of bodies that move each other in a velocity solve. Each island is a linear system by itself,
// so that a heap need not wait for a body that flies above it, nor work on it.
#pragma once

#include <vector>

#include "sim/base/assert.h"
#include "sim/base/disjoint_sets.h"
#include "sim/deformable/particle_mask.h"
#include "sim/state/bodies.h"

namespace duet {

/// The partition of all bodies into islands, and the islands that a solve still works on. Use: begin(), any
/// number of joins, finish(), then queries and leave(). Bodies are numbered with the rigid ones first, then
/// the deformable ones. Static and kinematic bodies belong to no island, because they pass no motion on.
class Islands {
 public:
  /// Some particles of one body, few enough (at most 1024) to be one of many parallel tasks.
  struct Range {
    std::size_t begin = 0,  ///< First particle.
        end = 0,            ///< One past the last particle.
        island = 0;         ///< Island of the body.
  };

  /// Starts a partition in which each body is alone, except that joints, soft bindings and embedded particles
  /// join their bodies.
  void begin(const Bodies& bodies);
  /// Joins the islands of two rigid bodies. Does nothing if one of them is static or kinematic.
  void join_rigid(int a, int b) { join(static_cast<std::size_t>(a), static_cast<std::size_t>(b)); }
  /// Joins the islands of a rigid body and of the body of a particle.
  void join_particle(int rigid, int particle) { join(static_cast<std::size_t>(rigid), node_of(particle)); }
  /// Joins the islands of the bodies of two particles.
  void join_particles(int a, int b) { join(node_of(a), node_of(b)); }
  /// Numbers the islands after the last join, and marks all of them as searched.
  void finish();

  /// Returns the number of islands.
  std::size_t size() const { return searched_.size(); }
  /// Returns the island of a rigid body; -1: none, the body is static or kinematic.
  int of_rigid(std::size_t body) const { return island_[body]; }
  /// Returns the island of the body of a particle.
  int of_particle(int particle) const { return island_[node_of(particle)]; }

  /// Returns whether a joint holds a body of `island`.
  bool has_joints(std::size_t island) const { return jointed_[island] != 0; }
  /// Returns whether a joint holds a body of any searched island.
  bool has_joints() const;

  /// Returns whether a solve still works on `island`.
  bool is_searched(std::size_t island) const { return searched_[island]; }
  /// Returns whether a solve still works on the island of a rigid body; false for static and kinematic
  /// bodies.
  bool is_searched_rigid(std::size_t body) const {
    return island_[body] >= 0 && searched_[static_cast<std::size_t>(island_[body])];
  }
  /// Returns the number of searched islands.
  std::size_t searched() const { return left_; }
  /// Takes a searched `island` out of the search, which must not be repeated. ranges() and mask() change with
  /// the next update().
  void leave(std::size_t island) {
    DUET_ASSERT(searched_[island] != 0);
    searched_[island] = false;
    --left_;
  }
  /// Brings ranges() and mask() up to date after leave().
  void update();
  /// Returns the particles of the searched islands, in ranges of ascending order.
  const std::vector<Range>& ranges() const { return ranges_; }
  /// Returns the mask of the particles of the searched islands.
  const ParticleMask& mask() const { return mask_; }

 private:
  // Returns the number of the body that a particle belongs to.
  std::size_t node_of(int particle) const {
    return static_cast<std::size_t>(node_of_[static_cast<std::size_t>(particle)]);
  }
  // Finds the parts of the partition that do not change in a run: the bodies of particles and their ranges.
  void find_structure(const Bodies& bodies);
  // Joins the islands of two bodies, unless one of them is static or kinematic.
  void join(std::size_t a, std::size_t b);

  std::size_t left_ = 0;            // number of searched islands
  DisjointSets sets_;               // of the bodies: the islands
  std::vector<char> is_fixed_;      // for every body: whether it is static or kinematic
  std::vector<char> body_jointed_;  // for every body: whether it has a joint
  std::vector<char> jointed_;       // for every island: whether it has a joint
  std::vector<int> island_;         // for every body: its island; -1: none
  std::vector<int> node_of_;   // for every particle: its body; for anchors of soft bindings that of the flesh
  std::vector<Range> bodies_;  // ranges of all bodies, with the number of the body in place of the island
  std::vector<char> searched_;  // for every island: whether a solve still works on it
  std::size_t in_ranges_ = 0;   // number of islands when ranges_ was last brought up to date
  std::vector<Range> ranges_;   // ranges of the searched islands
  ParticleMask mask_;           // particles of the searched islands
};

}  // namespace duet
