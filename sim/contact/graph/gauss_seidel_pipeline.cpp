#include "sim/contact/graph/gauss_seidel_pipeline.h"

#include <algorithm>
#include <limits>

#include "sim/contact/graph/pair_coloring.h"

namespace duet {
namespace {

// A turn is a sweep (upper half) and a step (lower half) in one word, so that both change atomically.
std::uint64_t turn(int sweep, int step) {
  return static_cast<std::uint64_t>(sweep) << 32 | static_cast<std::uint64_t>(step);
}
int sweep_of(std::uint64_t turn) { return static_cast<int>(turn >> 32); }
int step_of(std::uint64_t turn) { return static_cast<int>(turn & 0xffffffff); }

bool is_movable(const Bodies& bodies, std::size_t node) {
  return node >= bodies.rigid.size() || bodies.rigid.properties[node].is_dynamic();
}

// Returns the body whose position decides which thread gets a pair: the host, or the guest if the host cannot
// move.
std::size_t owner(const Bodies& bodies, const ContactPair& pair) {
  const auto [host, guest] = moved_nodes(bodies, pair);
  return is_movable(bodies, host) ? host : guest;
}

// Returns where a body is, m: its center of mass, or the first particle of a deformable body.
const Vec3& position(const Bodies& bodies, std::size_t node) {
  if (node < bodies.rigid.size()) return bodies.rigid.state[node].pose.position;
  return bodies.particles.x[as_index(bodies.deformable[node - bodies.rigid.size()].first_particle)];
}

}  // namespace

void GaussSeidelPipeline::build(const Bodies& bodies, const ContactSet& contacts,
                                std::span<const int> order) {
  const int threads = std::min(thread_count(), max_parts);
  parts_.assign(order.size() < min_pairs ? 1 : as_index(threads), Part{});
  steps_.resize(order.size());
  if (parts_.size() == 1) {
    for (std::size_t i = 0; i < order.size(); ++i) steps_[i] = Step{.pair = order[i]};
    return;
  }
  divide(bodies, contacts, order);
  const auto part_of = [&](int p) -> Part& {
    return parts_[as_index(part_of_[owner(bodies, contacts.pairs[as_index(p)])])];
  };
  for (const int p : order) ++part_of(p).end;
  for (std::size_t i = 1; i < parts_.size(); ++i) parts_[i].end += parts_[i - 1].end;
  for (std::size_t i = 1; i < parts_.size(); ++i) parts_[i].begin = parts_[i - 1].end;
  for (Part& part : parts_) part.end = part.begin;
  degree_.assign(part_of_.size(), 0);
  for (const int p : order) {
    Step& step = steps_[as_index(part_of(p).end++)] = Step{.pair = p};
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const std::array<std::size_t, 2> nodes = moved_nodes(bodies, pair);
    for (std::size_t k = 0; k < 2; ++k) {
      if (!is_movable(bodies, nodes[k]) || (k == 1 && nodes[0] == nodes[1])) continue;
      step.body[k] = static_cast<int>(nodes[k]);
      step.before[k] = degree_[nodes[k]]++;
    }
  }
  for (Step& step : steps_)
    for (std::size_t k = 0; k < 2; ++k) {
      if (step.body[k] < 0) continue;
      step.visits[k] = degree_[as_index(step.body[k])];
      step.body[k] = place_[as_index(step.body[k])];
    }
}

// Cuts the longest axis of the box around all bodies with pairs into 256 slices, and gives every part
// consecutive slices with about the same number of contact points. A slice is never divided.
void GaussSeidelPipeline::divide(const Bodies& bodies, const ContactSet& contacts,
                                 std::span<const int> order) {
  constexpr int slices = 256;
  Eigen::AlignedBox3d box;
  for (const int p : order) box.extend(position(bodies, owner(bodies, contacts.pairs[as_index(p)])));
  Eigen::Index axis = 0;
  const double extent = box.sizes().maxCoeff(&axis);
  const auto slice_of = [&](std::size_t node) {
    const double share = extent > 0 ? (position(bodies, node)[axis] - box.min()[axis]) / extent : 0;
    return as_index(static_cast<int>(std::clamp(share, 0.0, 1.0) * (slices - 1)));
  };
  weight_.assign(slices, 0);
  for (const int p : order) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    weight_[slice_of(owner(bodies, pair))] += pair.end - pair.begin;
  }
  double total = 0;
  for (double& weight : weight_) weight = total += weight;
  const int last = static_cast<int>(parts_.size()) - 1;
  const std::size_t nodes = bodies.rigid.size() + bodies.deformable.size();
  part_of_.resize(nodes);
  place_.resize(nodes);
  progress_.resize(nodes);
  std::array<int, max_parts + 1> first{};
  for (std::size_t node = 0; node < nodes; ++node) {
    const double before = weight_[slice_of(node)] / std::max(total, 1.0);
    part_of_[node] = std::min(last, static_cast<int>(before * (last + 1)));
    ++first[as_index(part_of_[node]) + 1];
  }
  for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
  for (std::size_t node = 0; node < nodes; ++node) place_[node] = first[as_index(part_of_[node])]++;
}

void GaussSeidelPipeline::begin_sweeps() const {
  std::fill(progress_.begin(), progress_.end(), 0);
  for (Part& part : parts_)
    part.next = part.begin < part.end ? turn(0, part.begin) : turn(std::numeric_limits<int>::max(), 0);
}

const GaussSeidelPipeline::Step* GaussSeidelPipeline::take(Part& part, int count, int& sweep) const {
  const std::atomic_ref<std::uint64_t> next(part.next);
  std::uint64_t now = next.load(std::memory_order_acquire);
  sweep = sweep_of(now);
  if (sweep >= count) return nullptr;
  const Step& step = steps_[as_index(step_of(now))];
  for (std::size_t k = 0; k < 2; ++k) {
    if (step.body[k] < 0) continue;
    const std::atomic_ref<int> progress(progress_[as_index(step.body[k])]);
    if (progress.load(std::memory_order_acquire) != sweep * step.visits[k] + step.before[k]) return nullptr;
  }
  const int following = step_of(now) + 1;
  const std::uint64_t then = following < part.end ? turn(sweep, following) : turn(sweep + 1, part.begin);
  return next.compare_exchange_strong(now, then, std::memory_order_acq_rel) ? &step : nullptr;
}

void GaussSeidelPipeline::finish(const Step& step, int sweep) const {
  for (std::size_t k = 0; k < 2; ++k)
    if (step.body[k] >= 0)
      std::atomic_ref<int>(progress_[as_index(step.body[k])])
          .store(sweep * step.visits[k] + step.before[k] + 1, std::memory_order_release);
}

bool GaussSeidelPipeline::all_taken(int count) const {
  return std::all_of(parts_.begin(), parts_.end(), [&](Part& part) {
    return sweep_of(std::atomic_ref<std::uint64_t>(part.next).load(std::memory_order_relaxed)) >= count;
  });
}

}  // namespace duet
