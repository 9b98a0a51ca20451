// Free islands: bodies that joints, bones and springs hold together and that nothing else touches in a step.
// They keep their angular momentum about their center of mass, or, if they turn about one joint that a static
// body holds, about that joint (sim/step/keep_spin.cpp).
#pragma once

#include <vector>

#include "sim/state/islands.h"

namespace duet {

/// The islands of deformable bodies that nothing touches in a step.
///
/// Use: find(), then touch_rigid() and touch_particle() for everything that is touched, then finish().
class FreeIslands {
 public:
  /// Finds the islands of bodies that joints, bones and springs hold together.
  ///
  /// Islands that bodies of infinite mass hold by joints or bindings count as touched, all others as
  /// untouched, and those that a static body holds by a single hinge or point joint.
  void find(const Bodies& bodies);

  /// Marks the island of a rigid body as touched; bodies of infinite mass belong to no island.
  void touch_rigid(int body) { touch(islands_.of_rigid(as_index(body))); }
  /// Marks the island of a particle as touched.
  void touch_particle(int particle) { touch(islands_.of_particle(particle)); }

  /// Collects the untouched islands that hold a deformable body.
  void finish();
  /// Returns the first deformable body of each untouched island, ascending, as of finish().
  const std::vector<std::size_t>& untouched() const { return untouched_; }

  /// Returns the joint by which a static body holds the island of deformable body `first`; -1: none.
  int pivot(std::size_t first) const { return pivot_[as_index(island_of_[first])]; }

  /// Visits the bodies of the island of deformable body `first`.
  ///
  /// Calls rigid(body) for the indices of its rigid bodies, then deformable(body) for those of its deformable
  /// bodies.
  template <class Rigid, class Deformable>
  void for_each_member(std::size_t first, Rigid&& rigid, Deformable&& deformable) const {
    for (int node = first_[as_index(island_of_[first])]; node >= 0; node = next_[as_index(node)])
      if (as_index(node) < rigid_)
        rigid(as_index(node));
      else
        deformable(as_index(node) - rigid_);
  }

 private:
  // Notes that a body of infinite mass holds an island by joint number `joint`.
  void hold(const Bodies& bodies, int joint);
  // Marks an island as touched; -1: none.
  void touch(int island) {
    if (island >= 0) is_touched_[as_index(island)] = 1;
  }

  Islands islands_;
  std::size_t rigid_ = 0;  // number of rigid bodies; a node is a rigid body, or rigid_ + a deformable one
  std::vector<int> island_of_;          // per deformable body
  std::vector<int> first_,              // per island, its first node; -1: none
      next_;                            // per node, the next one of its island; -1: none
  std::vector<char> is_touched_;        // per island
  std::vector<int> pivot_;              // per island, see pivot()
  std::vector<std::size_t> untouched_;  // see untouched()
};

}  // namespace duet
