#include "sim/coupling/sweep_pipeline.h"

#include <numeric>

#include "sim/coupling/pair_schedule.h"

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void SweepPipeline::build(const Bodies& bodies, const ContactSet& contacts, std::span<const int> order) {
  const std::size_t rigid = bodies.rigid.size();
  const auto movable = [&](std::size_t node) {
    return node >= rigid || bodies.rigid.properties[node].is_dynamic();
  };
  pairs_ = order.size();
  last_.assign(rigid + bodies.deformable.size(), -1);
  wave_of_.clear();
  begin_.assign(1, 0);
  int waves = 0;
  for (int sweep = 0; sweep < deepest; ++sweep) {
    for (const int p : order) {
      const ContactPair& pair = contacts.pairs[as_index(p)];
      const std::size_t a = as_index(pair.host), b = guest_node(bodies, pair);
      int wave = 0;
      if (movable(a)) wave = std::max(wave, last_[a] + 1);
      if (movable(b)) wave = std::max(wave, last_[b] + 1);
      last_[a] = last_[b] = wave;
      wave_of_.push_back(wave);
      waves = std::max(waves, wave + 1);
    }
    waves_[as_index(sweep)] = waves;
  }
  // Sorted by their waves, they stay in the order of their sweeps.
  begin_.assign(as_index(waves) + 2, 0);
  for (const int wave : wave_of_) ++begin_[as_index(wave) + 2];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  turns_.resize(wave_of_.size());
  for (std::size_t i = 0; i < wave_of_.size(); ++i)
    turns_[as_index(begin_[as_index(wave_of_[i]) + 1]++)] = {order[i % pairs_], static_cast<int>(i / pairs_)};
  begin_.pop_back();
}

}  // namespace duet
