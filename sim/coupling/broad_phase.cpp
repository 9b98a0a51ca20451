#include "sim/coupling/broad_phase.h"

#include <algorithm>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr std::size_t queries_at_once = 32;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }
std::size_t chunks_of(std::size_t queries) { return (queries + queries_at_once - 1) / queries_at_once; }

}  // namespace

const std::vector<BodyPair>& BroadPhase::find(const CandidateFilter& filter) {
  bounded_.clear();
  half_spaces_.clear();
  boxes_.resize(bounds.size());
  rigid_count_ = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (!bounds[i].is_half_space) boxes_[i] = world_box(bounds[i], margin[i]);
    if (bounds[i].is_deformable) continue;
    (bounds[i].is_half_space ? half_spaces_ : bounded_).push_back(static_cast<int>(i));
    ++rigid_count_;
  }
  tree_.build(boxes_, bounded_);

  const std::size_t hosts = filter.rigid_pairs ? rigid_count_ : 0;
  const std::size_t deformables = filter.rigid_deformable ? bounds.size() - rigid_count_ : 0;
  const std::size_t first = chunks_of(hosts), count = first + chunks_of(deformables);
  if (chunks_.size() < count) chunks_.resize(count);
  query_all(hosts, 0, [&](int body, std::vector<BodyPair>& found) { query_host(body, found); });
  query_all(deformables, first,
            [&](int body, std::vector<BodyPair>& found) { query_deformable(body, found); });

  std::size_t total = 0;
  for (std::size_t c = 0; c < count; ++c) {
    chunks_[c].begin = total;
    total += chunks_[c].pairs.size();
  }
  pairs_.resize(total);
  parallel_for(count, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      std::copy(chunks_[c].pairs.begin(), chunks_[c].pairs.end(),
                pairs_.begin() + static_cast<std::ptrdiff_t>(chunks_[c].begin));
  });
  return pairs_;
}

template <class Query>
void BroadPhase::query_all(std::size_t count, std::size_t first_chunk, Query&& query) {
  parallel_for(count, queries_at_once, [&](std::size_t begin, std::size_t end) {
    std::vector<BodyPair>& found = chunks_[first_chunk + begin / queries_at_once].pairs;
    found.clear();
    for (std::size_t i = begin; i < end; ++i) query(static_cast<int>(i), found);
    // Room for twice as many, so that storage stops growing once a scene has warmed up.
    if (found.capacity() < 2 * found.size()) found.reserve(2 * found.size());
  });
}

void BroadPhase::query_host(int host, std::vector<BodyPair>& found) const {
  const BodyBounds& body = bounds[as_index(host)];
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  const auto add = [&](int guest) {
    if (guest != host && (body.is_dynamic || bounds[as_index(guest)].is_dynamic))
      found.push_back({host, guest, -1});
  };
  if (body.is_half_space) {
    for (int guest : bounded_)
      if (meets_half_space(host, as_index(guest))) add(guest);
    return;
  }
  tree_.query(boxes_[as_index(host)], add);
  std::sort(found.begin() + first, found.end(),
            [](const BodyPair& a, const BodyPair& b) { return a.guest_rigid < b.guest_rigid; });
}

void BroadPhase::query_deformable(int body, std::vector<BodyPair>& found) const {
  const std::size_t index = rigid_count_ + as_index(body);
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  for (int host : half_spaces_)
    if (meets_half_space(host, index)) found.push_back({host, -1, body});
  tree_.query(boxes_[index], [&](int host) { found.push_back({host, -1, body}); });
  std::sort(found.begin() + first, found.end(),
            [](const BodyPair& a, const BodyPair& b) { return a.host < b.host; });
}

bool BroadPhase::meets_half_space(int plane, std::size_t body) const {
  return separation(bounds[as_index(plane)], bounds[body]) <= margin[as_index(plane)] + margin[body];
}

}  // namespace duet
