#include "sim/contact/detection/broad_phase.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "sim/base/parallel.h"

namespace duet {
namespace {

// Sizes of the tasks of parallel loops.
constexpr std::size_t boxes_at_once = 64, queries_at_once = 32, box_pairs_at_once = 512;

// Room that a roomy box leaves around a box: a fraction of the thickness of the body, for bodies that jostle
// in place, plus a multiple of its margin, for bodies that fly; the margin is about the motion in one step.
// More room lets pairs persist for more steps, but makes more pairs that have to be tested in each. The
// values were chosen by measurement.
constexpr double room_share = 0.1, steps_of_room = 4;
// A roomy box is replaced by a smaller one if it leaves more than this multiple of that room, so that bodies
// which have come to rest get smaller boxes.
constexpr double too_roomy = 4;

// Encodes the properties of a body on which the choice of pairs depends.
char kind_of(const BodyBounds& body) {
  return static_cast<char>((body.is_half_space ? 1 : 0) | (body.is_dynamic ? 2 : 0) |
                           (body.is_deformable ? 4 : 0));
}

// The order of the pairs that find() returns.
bool precedes(const BodyPair& a, const BodyPair& b) {
  return std::tie(a.guest_deformable, a.host, a.guest_rigid) <
         std::tie(b.guest_deformable, b.host, b.guest_rigid);
}

Eigen::AlignedBox3d grown(const Eigen::AlignedBox3d& box, double by) {
  return {box.min().array() - by, box.max().array() + by};
}

// Reserves room for twice `count` pairs if there is too little, so that storage stops growing once a scene
// has warmed up.
void make_room(std::vector<BodyPair>& pairs, std::size_t count) {
  if (pairs.capacity() < count) pairs.reserve(2 * count);
}

}  // namespace

const std::vector<BodyPair>& BroadPhase::find(const CandidateFilter& filter) {
  reset_if_changed(filter);
  update_boxes();
  if (!those_anew_.empty()) {
    update_tree();
    update_near();
  } else {
    counts_.kept += static_cast<std::int64_t>(near_.size());
  }
  parallel_collect(near_.size(), box_pairs_at_once, ranges_, pairs_,
                   [&](std::size_t i, std::vector<BodyPair>& found) {
                     if (meet(near_[i])) found.push_back(near_[i]);
                   });
  return pairs_;
}

// Forgets all boxes and pairs if the bodies differ in number or kind from those of the last call, or if the
// filter wants other pairs.
void BroadPhase::reset_if_changed(const CandidateFilter& filter) {
  const bool same = kind_.size() == bounds.size() && filter_.rigid_pairs == filter.rigid_pairs &&
                    filter_.rigid_deformable == filter.rigid_deformable &&
                    std::equal(kind_.begin(), kind_.end(), bounds.begin(),
                               [](char kind, const BodyBounds& body) { return kind == kind_of(body); });
  if (same) return;
  filter_ = filter;
  kind_.clear();
  bounded_.clear();
  half_spaces_.clear();
  near_.clear();
  rigid_count_ = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    kind_.push_back(kind_of(bounds[i]));
    (bounds[i].is_half_space ? half_spaces_ : bounded_).push_back(static_cast<int>(i));
    if (!bounds[i].is_deformable) ++rigid_count_;
  }
  box_.resize(bounds.size());
  roomy_.assign(bounds.size(), Eigen::AlignedBox3d());
  anew_.assign(bounds.size(), 1);
}

// Updates the boxes, replaces the roomy boxes that no longer fit, and lists the bodies whose pairs have to be
// searched for. Half spaces have no boxes, because all bodies are near them; their pairs are searched for
// only after reset_if_changed().
void BroadPhase::update_boxes() {
  parallel_for(bounded_.size(), boxes_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto i = as_index(bounded_[k]);
      box_[i] = world_box(bounds[i], margin[i]);
      const double thickness = box_[i].sizes().minCoeff() - 2 * margin[i];
      const double room = room_share * thickness + steps_of_room * margin[i];
      anew_[i] = !roomy_[i].contains(box_[i]) || !grown(box_[i], too_roomy * room).contains(roomy_[i]);
      if (anew_[i]) roomy_[i] = grown(box_[i], room);
    }
  });
  those_anew_.clear();
  for (std::size_t i = 0; i < anew_.size(); ++i)
    if (anew_[i]) those_anew_.push_back(static_cast<int>(i));
}

// Refits the tree to the roomy boxes. It is built again once half as many boxes have changed since it was
// built as there are, because its splits then no longer suit them.
void BroadPhase::update_tree() {
  refitted_ += those_anew_.size();
  if (refitted_ < bounded_.size() / 2) {
    tree_.refit(roomy_);
    return;
  }
  tree_.build(roomy_, bounded_);
  refitted_ = 0;
}

// Removes the pairs of the bodies that are marked from the list of near pairs, and merges in those that a
// search finds for these bodies now.
void BroadPhase::update_near() {
  // If more than a quarter of the bodies are marked, it is cheaper to search for the pairs of all bodies:
  // they are then found in their order and need no sorting.
  if (those_anew_.size() > bounds.size() / 4) {
    std::fill(anew_.begin(), anew_.end(), char{1});
    those_anew_.resize(bounds.size());
    std::iota(those_anew_.begin(), those_anew_.end(), 0);
  }
  parallel_collect(those_anew_.size(), queries_at_once, ranges_, found_,
                   [&](std::size_t k, std::vector<BodyPair>& found) { query(those_anew_[k], found); });
  if (!std::is_sorted(found_.begin(), found_.end(), precedes))
    std::sort(found_.begin(), found_.end(), precedes);
  std::erase_if(near_,
                [&](const BodyPair& pair) { return anew_[as_index(pair.host)] || anew_[guest_index(pair)]; });
  counts_.kept += static_cast<std::int64_t>(near_.size());
  counts_.found += static_cast<std::int64_t>(found_.size());
  make_room(merged_, near_.size() + found_.size());
  merged_.resize(near_.size() + found_.size());
  std::merge(near_.begin(), near_.end(), found_.begin(), found_.end(), merged_.begin(), precedes);
  std::swap(near_, merged_);
  for (const int plane : half_spaces_) anew_[as_index(plane)] = 0;
}

// Appends the pairs of `body` whose roomy boxes meet, in their order. If the other body of a pair is searched
// for as well, only one of the two gives the pair: the deformable body or the host.
void BroadPhase::query(int body, std::vector<BodyPair>& found) const {
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  const auto add = [&](int other) {
    if (!is_wanted(as_index(body), as_index(other))) return;
    const BodyPair pair = pair_of(body, other);
    const bool gives = pair.guest_deformable < 0 ? pair.host == body : bounds[as_index(body)].is_deformable;
    if (gives || !anew_[as_index(other)]) found.push_back(pair);
  };
  if (bounds[as_index(body)].is_half_space) {
    for (const int other : bounded_) add(other);
  } else {
    for (const int plane : half_spaces_) add(plane);
    tree_.query(roomy_[as_index(body)], add);
  }
  std::sort(found.begin() + first, found.end(), precedes);
}

// Returns whether the filter wants the pair of these two bodies, indices into `bounds`.
bool BroadPhase::is_wanted(std::size_t a, std::size_t b) const {
  const int deformable = (bounds[a].is_deformable ? 1 : 0) + (bounds[b].is_deformable ? 1 : 0);
  if (deformable > 0) return deformable == 1 && filter_.rigid_deformable;
  return a != b && filter_.rigid_pairs && (bounds[a].is_dynamic || bounds[b].is_dynamic);
}

// Returns the pair of two bodies, indices into `bounds` in any order.
BodyPair BroadPhase::pair_of(int a, int b) const {
  if (a > b) std::swap(a, b);
  const int rigid_count = static_cast<int>(rigid_count_);
  if (b >= rigid_count) return {a, -1, b - rigid_count};
  if (bounds[as_index(b)].is_half_space) std::swap(a, b);
  return {a, b, -1};
}

// Returns the index of the pair's guest in `bounds`.
std::size_t BroadPhase::guest_index(const BodyPair& pair) const {
  return pair.guest_rigid >= 0 ? as_index(pair.guest_rigid) : rigid_count_ + as_index(pair.guest_deformable);
}

// Returns whether the boxes of the two bodies, grown by their margins, meet at the present positions.
bool BroadPhase::meet(const BodyPair& pair) const {
  const std::size_t host = as_index(pair.host), guest = guest_index(pair);
  return bounds[host].is_half_space ? separation(bounds[host], bounds[guest]) <= margin[host] + margin[guest]
                                    : box_[host].intersects(box_[guest]);
}

}  // namespace duet
