// Bodies that joints, bones and springs hold together and that nothing else touches in this step, so that
// what they have of angular momentum about their center of mass is theirs to keep (sim/step/keep_spin.cpp).
#pragma once

#include <vector>

#include "sim/state/islands.h"

namespace duet {

class FreeIslands {
 public:
  /// Finds the islands that joints, bones and springs make. Only those that bodies of infinite mass hold by
  /// them count as touched.
  void find(const Bodies& bodies);

  /// Marks the island of a body as touched; bodies of infinite mass belong to none.
  void touch_rigid(int body) { touch(islands_.of_rigid(as_index(body))); }
  void touch_particle(int particle) { touch(islands_.of_particle(particle)); }

  /// To be called last: keeps the first deformable body of each untouched island that has any.
  void finish();
  const std::vector<std::size_t>& untouched() const { return untouched_; }

  /// Calls work(body) for the rigid bodies, then for the deformable bodies (indices), of the island of
  /// deformable body `first`.
  template <class Rigid, class Deformable>
  void for_each_member(std::size_t first, Rigid&& rigid, Deformable&& deformable) const {
    for (int node = first_[as_index(island_of_[first])]; node >= 0; node = next_[as_index(node)])
      if (as_index(node) < rigid_)
        rigid(as_index(node));
      else
        deformable(as_index(node) - rigid_);
  }

 private:
  void touch(int island) {
    if (island >= 0) is_touched_[as_index(island)] = 1;
  }

  Islands islands_;
  std::size_t rigid_ = 0;               // number of rigid bodies
  std::vector<int> island_of_;          // of every deformable body
  std::vector<int> first_, next_;       // of every island its first body; of every body the next one; or -1
  std::vector<char> is_touched_;        // of every island
  std::vector<std::size_t> untouched_;  // first deformable bodies
};

}  // namespace duet
