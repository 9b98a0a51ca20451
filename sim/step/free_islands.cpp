#include "sim/step/free_islands.h"

#include <algorithm>

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
  pivot_.assign(islands_.size(), -1);
  for (std::size_t j = 0; j < bodies.articulation.joints.size(); ++j) hold(bodies, static_cast<int>(j));
  for (const auto& [rigid, deformable] : bodies.collision_exclusions_deformable)
    if (islands_.of_rigid(as_index(rigid)) < 0)
      touch_particle(bodies.deformable[as_index(deformable)].first_particle);
}

void FreeIslands::hold(const Bodies& bodies, int joint) {
  const Joint& here = bodies.articulation.joints[as_index(joint)];
  const int of_parent = islands_.of_rigid(as_index(here.parent)),
            of_child = islands_.of_rigid(as_index(here.child));
  if (of_parent >= 0 && of_child >= 0) return;
  const int island = std::max(of_parent, of_child), fixed = of_parent < 0 ? here.parent : here.child;
  if (island < 0) return;
  const bool turns = here.kind == JointKind::hinge || here.kind == JointKind::point;
  if (turns && pivot_[as_index(island)] < 0 && !bodies.rigid.properties[as_index(fixed)].moves())
    pivot_[as_index(island)] = joint;
  else
    touch(island);
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
