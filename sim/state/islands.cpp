#include "sim/state/islands.h"

#include <algorithm>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Largest number of particles of a range, which is one parallel task. Larger ranges balance worse among
// threads; the partial sums of solves follow the ranges, so that another value changes results in the last
// bits.
constexpr std::size_t max_particles = 1024;

}  // namespace

// The structure is found once, because bodies keep their particles. The anchors of soft bindings
// (`zero_length_springs`) lie in no body's range: they take the body of the particle that they are tethered
// to.
void Islands::find_structure(const Bodies& bodies) {
  if (node_of_.size() == bodies.particles.size()) return;
  node_of_.resize(bodies.particles.size());
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d)
    for_each_particle(bodies.deformable[d],
                      [&](std::size_t p) { node_of_[p] = static_cast<int>(bodies.rigid.size() + d); });
  for (const ZeroLengthSpring& spring : bodies.forces.zero_length_springs.all())
    node_of_[as_index(spring.b)] = node_of_[as_index(spring.a)];
  bodies_.clear();
  for (std::size_t p = 0; p < node_of_.size(); ++p) {
    const std::size_t node = as_index(node_of_[p]);
    const bool goes_on = !bodies_.empty() && bodies_.back().island == node &&
                         bodies_.back().end - bodies_.back().begin < max_particles;
    if (goes_on)
      ++bodies_.back().end;
    else
      bodies_.push_back({p, p + 1, node});
  }
}

void Islands::begin(const Bodies& bodies) {
  find_structure(bodies);
  const std::size_t rigid = bodies.rigid.size(), nodes = rigid + bodies.deformable.size();
  DUET_ASSERT(bodies_.empty() || bodies_.back().island < nodes);
  sets_.reset(nodes);
  is_fixed_.assign(nodes, false);
  for (std::size_t i = 0; i < rigid; ++i) is_fixed_[i] = !bodies.rigid.properties[i].is_dynamic();
  body_jointed_.assign(nodes, false);
  for (const Joint& joint : bodies.articulation.joints) {
    body_jointed_[as_index(joint.parent)] = body_jointed_[as_index(joint.child)] = true;
    join_rigid(joint.parent, joint.child);
  }
  for (const EmbeddedParticle& bound : bodies.bound)
    join(bound.body, node_of(static_cast<int>(bound.particle)));
}

void Islands::join(std::size_t a, std::size_t b) {
  if (is_fixed_[a] || is_fixed_[b]) return;
  sets_.join(static_cast<int>(a), static_cast<int>(b));
}

void Islands::finish() {
  island_.assign(sets_.size(), -1);
  left_ = 0;
  for (std::size_t i = 0; i < sets_.size(); ++i) {
    if (is_fixed_[i]) continue;
    const auto first = as_index(sets_.first(static_cast<int>(i)));
    island_[i] = first == i ? static_cast<int>(left_++) : island_[first];
  }
  jointed_.assign(left_, false);
  for (std::size_t i = 0; i < sets_.size(); ++i)
    if (body_jointed_[i] && island_[i] >= 0) jointed_[as_index(island_[i])] = true;
  searched_.assign(left_, true);
  ranges_ = bodies_;
  for (Range& range : ranges_) range.island = as_index(island_[range.island]);
  in_ranges_ = left_;
  mask_.assign_all(node_of_.size());
}

bool Islands::has_joints() const {
  for (std::size_t i = 0; i < jointed_.size(); ++i)
    if (jointed_[i] && searched_[i]) return true;
  return false;
}

void Islands::update() {
  if (in_ranges_ == left_) return;
  in_ranges_ = left_;
  std::erase_if(ranges_, [&](const Range& range) { return !searched_[range.island]; });
  mask_.assign_none(node_of_.size());
  for (const Range& range : ranges_) mask_.add(range.begin, range.end);
}

}  // namespace duet
