#include "sim/deformable/self_contact/collision_candidates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/deformable/self_contact/initial_proximity.h"

namespace duet {
namespace {

using Box = Eigen::AlignedBox3d;

// Numbers in a chunk of a parallel loop: elements whose pairs are searched for, elements otherwise, and rows.
constexpr std::size_t searches_at_once = 64, elements_at_once = 1024, rows_at_once = 256;
// Margin for rounding, relative to the range and to the travel: pairs that rounding alone keeps out of range
// do not sleep.
constexpr double rounding = 1e-9;
// A particle's box leaves it room on all sides: for `updates_ahead` updates at its present pace, but at least
// `min_room` times the thickness of its body, and at most `max_room` times the mean length of the body's
// edges. More room makes searches rarer, and the pairs that they find more numerous.
constexpr double updates_ahead = 12, min_room = 0.5, max_room = 1;
// Number of searches after which a tree is split anew; in between it is refitted.
constexpr std::int64_t searches_of_tree = 8;
// If the elements whose pairs must be searched for again are fewer than 1/`few` of all, they get a tree of
// their own.
constexpr std::size_t few = 8;

Box grown(const Box& box, double margin) {
  return {box.min() - Vec3::Constant(margin), box.max() + Vec3::Constant(margin)};
}

Vec3 mean_position(const CollisionSurface& surface, const std::vector<Vec3>& x) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [p] : surface.points) sum += x[as_index(p)];
  return sum / static_cast<double>(surface.points.size());
}

// Returns the mean length of each body's edges at time 0, m.
std::vector<double> mean_edges(const CollisionSurface& surface) {
  std::vector<double> length(surface.bodies.size(), 0), count(surface.bodies.size(), 0);
  for (std::size_t i = 0; i < surface.edges.size(); ++i) {
    const auto& [a, b] = surface.edges[i];
    length[as_index(surface.edge_body[i])] +=
        (surface.initial[as_index(a)] - surface.initial[as_index(b)]).norm();
    ++count[as_index(surface.edge_body[i])];
  }
  for (std::size_t body = 0; body < length.size(); ++body) length[body] /= std::max(count[body], 1.0);
  return length;
}

// Returns the smallest box that contains the boxes of the particles.
template <std::size_t N>
Box hull(const std::array<int, N>& particles, const std::vector<Box>& boxes) {
  Box box;
  for (int p : particles) box.extend(boxes[as_index(p)]);
  return box;
}

template <std::size_t N, std::size_t M>
bool share_particle(const std::array<int, N>& a, const std::array<int, M>& b) {
  return std::any_of(a.begin(), a.end(), [&](int p) { return std::find(b.begin(), b.end(), p) != b.end(); });
}

template <std::size_t N, std::size_t M>
std::array<int, 4> joined(const std::array<int, N>& a, const std::array<int, M>& b) {
  static_assert(N + M == 4);
  std::array<int, 4> both;
  std::copy(b.begin(), b.end(), std::copy(a.begin(), a.end(), both.begin()));
  return both;
}

// Bodies of two elements.
struct Bodies {
  int first = 0, second = 0;
};
// Returns the bodies of two elements by their numbers; the first one is a point or an edge.
Bodies bodies_of(const CollisionSurface& surface, std::size_t first, std::size_t second) {
  const std::size_t points = surface.points.size(), edges = surface.edges.size();
  if (first < points) return {surface.point_body[first], surface.triangle_body[second - points - edges]};
  return {surface.edge_body[first - points], surface.edge_body[second - points]};
}

CandidatePair candidate(const CollisionSurface& surface, std::size_t first, std::size_t second) {
  const std::size_t points = surface.points.size(), edges = surface.edges.size();
  const Bodies bodies = bodies_of(surface, first, second);
  const CollisionBody &a = surface.bodies[as_index(bodies.first)],
                      &b = surface.bodies[as_index(bodies.second)];
  CandidatePair pair;
  if (first < points) {
    pair.particle = joined(surface.points[first], surface.triangles[second - points - edges]);
  } else {
    pair.kind = ElementPair::edge_edge;
    pair.particle = joined(surface.edges[first - points], surface.edges[second - points]);
  }
  pair.thickness = (a.thickness + b.thickness) / 2;
  pair.friction = std::min(a.friction, b.friction);
  return pair;
}

// Returns a lower bound on the distance of the two elements, m: that of their boxes if it exceeds twice the
// `range` (m), or else the distance itself.
double min_distance(const CandidatePair& pair, const std::vector<Vec3>& x, double range) {
  const FourPoints at = corners(pair.particle, x);
  const std::size_t first = pair.kind == ElementPair::point_triangle ? 1 : 2;
  Box a, b;
  for (std::size_t i = 0; i < 4; ++i) (i < first ? a : b).extend(at[i]);
  const double squared = a.squaredExteriorDistance(b);
  return squared > 4 * range * range ? std::sqrt(squared) : closest_points(pair.kind, at).difference.norm();
}

}  // namespace

void CollisionCandidates::update(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                 const std::vector<Vec3>& end) {
  DUET_ASSERT(start.size() == end.size());
  if (particle_box_.size() != start.size()) begin(surface, start);
  if (!hold(surface, start, end)) search(surface, start, end);
  add_travels(surface, start, end);
  wake_pairs(surface, start);
}

// The boxes are empty at first, so that the first search finds all pairs.
void CollisionCandidates::begin(const CollisionSurface& surface, const std::vector<Vec3>& start) {
  mean_ = mean_position(surface, start);
  edge_length_ = mean_edges(surface);
  particle_box_.assign(start.size(), Box());
  room_.assign(start.size(), 0);
  is_renewed_.assign(start.size(), 0);
  stretch_.resize(start.size());
  further_.resize(start.size());
  last_.resize(start.size());
  for (const auto& [p] : surface.points) last_[as_index(p)] = start[as_index(p)] - mean_;
  std::size_t first = 0;
  const auto number = [&first](Elements& elements, std::size_t count) {
    elements.first = first;
    elements.box.assign(count, Box());
    elements.is_active.assign(count, 0);
    elements.is_anew.assign(count, 0);
    first += count;
  };
  number(points_, surface.points.size());
  number(edges_, surface.edges.size());
  rows_.assign(first, {});
  number(triangles_, surface.triangles.size());
  travel_.assign(first, {});
  kept_.clear();
}

bool CollisionCandidates::hold(const CollisionSurface& surface, const std::vector<Vec3>& start,
                               const std::vector<Vec3>& end) const {
  const Vec3 start_shift = mean_position(surface, start) - mean_,
             end_shift = mean_position(surface, end) - mean_;
  return std::all_of(surface.points.begin(), surface.points.end(), [&](const std::array<int, 1>& point) {
    const auto p = as_index(point[0]);
    return particle_box_[p].contains(start[p] - start_shift) && particle_box_[p].contains(end[p] - end_shift);
  });
}

void CollisionCandidates::search(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                 const std::vector<Vec3>& end) {
  ++searches_;
  renew_boxes(surface, start, end);
  renew(surface.points, surface.point_body, surface, points_);
  renew(surface.edges, surface.edge_body, surface, edges_);
  renew(surface.triangles, surface.triangle_body, surface, triangles_);
  body_box_.assign(surface.bodies.size(), Box());
  for (std::size_t i = 0; i < points_.box.size(); ++i)
    body_box_[as_index(surface.point_body[i])].extend(points_.box[i]);
  find_neighbors();
  find_active(surface.point_body, surface, points_);
  find_active(surface.edge_body, surface, edges_);
  find_active(surface.triangle_body, surface, triangles_);
  split(edges_);
  split(triangles_);
  next_.clear();
  next_rows_.assign(rows_.size(), {});
  find_rows(surface.points, surface.point_body, points_, surface.triangles, surface.triangle_body, triangles_,
            surface);
  find_rows(surface.edges, surface.edge_body, edges_, surface.edges, surface.edge_body, edges_, surface);
  kept_.swap(next_);
  rows_.swap(next_rows_);
}

// A tree is built the first time, split anew every searches_of_tree searches, and refitted otherwise.
void CollisionCandidates::split(Elements& elements) const {
  const std::size_t count = elements.box.size();
  if (elements.tree.items().size() != count) {
    std::vector<int> all(count);
    std::iota(all.begin(), all.end(), 0);
    elements.tree.build(elements.box, all);
  } else if (searches_ % searches_of_tree == 0) {
    elements.tree.build(elements.box, elements.tree.items());
  } else {
    elements.tree.refit(elements.box);
  }
  elements.few_anew = few * elements.anew.size() < count;
  if (elements.few_anew) elements.tree_anew.build(elements.box, elements.anew);
}

// A particle gets a new box if less than half of its room is left on some side at the start or the end of its
// motion.
void CollisionCandidates::renew_boxes(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                      const std::vector<Vec3>& end) {
  const Vec3 start_mean = mean_position(surface, start), start_shift = start_mean - mean_,
             end_shift = mean_position(surface, end) - mean_;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const auto p = as_index(surface.points[i][0]);
    const Box way = Box(Vec3(start[p] - start_shift)).extend(end[p] - end_shift);
    is_renewed_[p] = !particle_box_[p].contains(grown(way, room_[p] / 2));
    if (is_renewed_[p] == 0) continue;
    const auto body = as_index(surface.point_body[i]);
    const double pace = std::max((start[p] - start_mean - last_[p]).norm(), way.diagonal().norm());
    const double least = min_room * surface.bodies[body].thickness;
    room_[p] = std::clamp(updates_ahead * pace, least, std::max(least, max_room * edge_length_[body]));
    particle_box_[p] = grown(way, room_[p]);
  }
}

template <std::size_t N>
void CollisionCandidates::renew(const std::vector<std::array<int, N>>& corners,
                                const std::vector<int>& body_of, const CollisionSurface& surface,
                                Elements& elements) const {
  parallel_for(corners.size(), elements_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      elements.is_anew[i] = std::any_of(corners[i].begin(), corners[i].end(),
                                        [&](int p) { return is_renewed_[as_index(p)] != 0; });
      if (elements.is_anew[i] == 0) continue;
      const double reach = repulsion_range / 2 * surface.bodies[as_index(body_of[i])].thickness;
      elements.box[i] = grown(hull(corners[i], particle_box_), reach);
    }
  });
}

void CollisionCandidates::find_neighbors() {
  neighbors_.resize(body_box_.size());
  for (std::size_t a = 0; a < body_box_.size(); ++a) {
    neighbors_[a].clear();
    for (std::size_t b = 0; b < body_box_.size(); ++b)
      if (a != b && body_box_[a].intersects(body_box_[b])) neighbors_[a].push_back(static_cast<int>(b));
  }
}

void CollisionCandidates::find_active(const std::vector<int>& body_of, const CollisionSurface& surface,
                                      Elements& elements) const {
  parallel_for(body_of.size(), elements_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto body = as_index(body_of[i]);
      const bool is_active = surface.bodies[body].itself ||
                             std::any_of(neighbors_[body].begin(), neighbors_[body].end(), [&](int other) {
                               return body_box_[as_index(other)].intersects(elements.box[i]);
                             });
      if (is_active != (elements.is_active[i] != 0)) elements.is_anew[i] = 1;
      elements.is_active[i] = is_active ? 1 : 0;
    }
  });
  elements.active.clear();
  elements.anew.clear();
  for (std::size_t i = 0; i < body_of.size(); ++i) {
    if (elements.is_active[i] == 0) continue;
    elements.active.push_back(static_cast<int>(i));
    if (elements.is_anew[i] != 0) elements.anew.push_back(static_cast<int>(i));
  }
}

// In a pair of edges the one with the smaller number is the first. Elements that need no new search are
// tested only against those that do.
template <std::size_t N, std::size_t M>
void CollisionCandidates::find_rows(const std::vector<std::array<int, N>>& first,
                                    const std::vector<int>& first_body, const Elements& asking,
                                    const std::vector<std::array<int, M>>& second,
                                    const std::vector<int>& second_body, const Elements& asked,
                                    const CollisionSurface& surface) {
  const std::size_t chunks = (asking.active.size() + searches_at_once - 1) / searches_at_once;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  const auto may_touch = [&](std::size_t i, std::size_t k) {
    if (&asking == &asked && k <= i) return false;
    if (first_body[i] != second_body[k]) return true;
    return surface.bodies[as_index(first_body[i])].itself && !share_particle(first[i], second[k]);
  };
  parallel_for(asking.active.size(), searches_at_once, [&](std::size_t begin, std::size_t end) {
    Chunk& chunk = chunks_[begin / searches_at_once];
    chunk.kept.clear();
    for (std::size_t a = begin; a < end; ++a) {
      const auto i = as_index(asking.active[a]);
      const bool is_anew = asking.is_anew[i] != 0;
      chunk.found.clear();
      const bool asks_all = is_anew || !asked.few_anew;
      (asks_all ? asked.tree : asked.tree_anew).query(asking.box[i], [&](int k) {
        const bool is_asked =
            asked.is_active[as_index(k)] != 0 && (is_anew || asked.is_anew[as_index(k)] != 0);
        if (is_asked && may_touch(i, as_index(k))) chunk.found.push_back(k);
      });
      std::sort(chunk.found.begin(), chunk.found.end());
      Row& row = next_rows_[asking.first + i];  // within the chunk, until the chunks are joined
      row.begin = chunk.kept.size();
      merge_row(rows_[asking.first + i], is_anew, asked, chunk);
      row.end = chunk.kept.size();
    }
  });
  for (std::size_t c = 0; c < chunks; ++c) {
    for (std::size_t a = c * searches_at_once; a < std::min((c + 1) * searches_at_once, asking.active.size());
         ++a) {
      Row& row = next_rows_[asking.first + as_index(asking.active[a])];
      row.begin += next_.size();
      row.end += next_.size();
    }
    next_.insert(next_.end(), chunks_[c].kept.begin(), chunks_[c].kept.end());
  }
}

// The result has the pairs that were found, and those pairs of the old row that were not searched for because
// both elements have kept their boxes. Pairs in both keep what is known of them.
void CollisionCandidates::merge_row(const Row& old, bool is_anew, const Elements& asked, Chunk& chunk) const {
  std::size_t known = old.begin;
  // Keeps the pairs of the old row before `second`.
  const auto pass = [&](int second) {
    for (; known < old.end && kept_[known].second < second; ++known) {
      const std::size_t k = as_index(kept_[known].second) - asked.first;
      if (!is_anew && asked.is_active[k] != 0 && asked.is_anew[k] == 0) chunk.kept.push_back(kept_[known]);
    }
  };
  for (const int k : chunk.found) {
    const int second = static_cast<int>(asked.first) + k;
    pass(second);
    if (known < old.end && kept_[known].second == second)
      chunk.kept.push_back(kept_[known++]);
    else
      chunk.kept.push_back({.second = second});
  }
  pass(std::numeric_limits<int>::max());
}

void CollisionCandidates::add_travels(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                      const std::vector<Vec3>& end) {
  const Vec3 start_mean = mean_position(surface, start), end_mean = mean_position(surface, end);
  parallel_for(surface.points.size(), elements_at_once, [&](std::size_t begin, std::size_t stop) {
    for (std::size_t i = begin; i < stop; ++i) {
      const auto p = as_index(surface.points[i][0]);
      const Vec3 from = start[p] - start_mean;
      stretch_[p] = (from - last_[p]).norm();
      further_[p] = (end[p] - end_mean - from).norm();
      last_[p] = from;
    }
  });
  const auto add = [&](const auto& corners, std::size_t first) {
    parallel_for(corners.size(), elements_at_once, [&](std::size_t begin, std::size_t stop) {
      for (std::size_t i = begin; i < stop; ++i) {
        double stretch = 0, further = 0;
        for (const int p : corners[i]) {
          stretch = std::max(stretch, stretch_[as_index(p)]);
          further = std::max(further, further_[as_index(p)]);
        }
        Travel& travel = travel_[first + i];
        travel.before += stretch;
        travel.including = travel.before + further;
      }
    });
  };
  add(surface.points, points_.first);
  add(surface.edges, edges_.first);
  add(surface.triangles, triangles_.first);
}

// Nearly all pairs stay asleep, and there are hundreds of thousands. So the loop reads nothing but its row
// and the travels, and all else is in wake().
void CollisionCandidates::wake_pairs(const CollisionSurface& surface, const std::vector<Vec3>& start) {
  parallel_collect(rows_.size(), rows_at_once, near_of_ranges_, near_,
                   [&](std::size_t i, std::vector<CandidatePair>& near) {
                     Kept* const end = kept_.data() + rows_[i].end;
                     const Travel* const travel = travel_.data();
                     const double way = travel[i].including;
                     for (Kept* kept = kept_.data() + rows_[i].begin; kept < end; ++kept)
                       if (!(way + travel[as_index(kept->second)].including < kept->until))
                         wake(surface, start, i, *kept, near);
                   });
}

void CollisionCandidates::wake(const CollisionSurface& surface, const std::vector<Vec3>& start,
                               std::size_t first, Kept& kept, std::vector<CandidatePair>& near) const {
  const std::size_t second = as_index(kept.second);
  const Travel &a = travel_[first], &b = travel_[second];
  CandidatePair pair = candidate(surface, first, second);
  const double range = repulsion_range * pair.thickness, way = a.before + b.before;
  kept.until = way + min_distance(pair, start, range) - range - rounding * (range + way);
  if (a.including + b.including < kept.until) return;
  if (!kept.is_examined) {
    const Bodies bodies = bodies_of(surface, first, second);
    const InitialProximity at_first = initial_proximity(pair, bodies.first == bodies.second, surface);
    kept.repels = at_first != InitialProximity::belonging;
    kept.was_near = at_first == InitialProximity::lying;
  }
  kept.is_examined = true;
  pair.repels = kept.repels;
  if (kept.was_near) pair.thickness = std::min(pair.thickness, initial_distance(pair, surface));
  near.push_back(pair);
}

}  // namespace duet
