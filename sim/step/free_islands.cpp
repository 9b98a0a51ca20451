#include "sim/step/free_islands.h"

namespace duet {

void FreeIslands::find(const Bodies& bodies) {
  islands_.begin(bodies);
  islands_.finish();
  rigid_ = bodies.rigid.size();
  island_of_.resize(bodies.deformable.size());
  first_.assign(islands_.size(), -1);
  next_.assign(rigid_ + bodies.deformable.size(), -1);
  is_touched_.assign(islands_.size(), 0);
  const auto add = [&](std::size_t node, int island) {
    if (island < 0) return;
    next_[node] = first_[as_index(island)];
    first_[as_index(island)] = static_cast<int>(node);
  };
  for (std::size_t d = bodies.deformable.size(); d-- > 0;) {
    island_of_[d] = islands_.of_particle(bodies.deformable[d].first_particle);
    add(rigid_ + d, island_of_[d]);
  }
  for (std::size_t i = rigid_; i-- > 0;) add(i, islands_.of_rigid(i));
  for (const Joint& joint :
       bodies.articulation.joints)  // joints with bodies of infinite mass hold the island
    if (islands_.of_rigid(as_index(joint.parent)) < 0 || islands_.of_rigid(as_index(joint.child)) < 0)
      for (const int body : {joint.parent, joint.child}) touch_rigid(body);
  for (const auto& [rigid, deformable] : bodies.collision_exclusions_deformable)
    if (islands_.of_rigid(as_index(rigid)) < 0)
      touch_particle(bodies.deformable[as_index(deformable)].first_particle);
}

void FreeIslands::finish() {
  untouched_.clear();
  for (std::size_t d = 0; d < island_of_.size(); ++d) {
    const std::size_t island = as_index(island_of_[d]);
    if (is_touched_[island] != 0) continue;
    untouched_.push_back(d);
    is_touched_[island] = 1;  // list the island once, by its first deformable body
  }
}

}  // namespace duet
