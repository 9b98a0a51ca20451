#include "sim/deformable/collision_candidates.h"

#include <algorithm>
#include <cmath>

#include "sim/base/parallel.h"

namespace duet {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr std::size_t grain = 64, travel_grain = 1024, pair_grain = 4096;
// Of the range: pairs that are farther apart only by what rounding makes of it do not sleep.
constexpr double rounding = 1e-9;
// Room that a particle's box leaves it on all sides, times the thickness of its body: more makes searches
// rarer and the pairs they find more numerous.
constexpr double room = 1.4;
// Parts of a body that were nearer than this, times h, at time 0 do not repel each other.
constexpr double initial_proximity = 1.5;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

Box grown(const Box& box, double margin) {
  return {box.min() - Vec3::Constant(margin), box.max() + Vec3::Constant(margin)};
}

Vec3 mean_position(const CollisionSurface& surface, const std::vector<Vec3>& x) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [p] : surface.points) sum += x[as_index(p)];
  return sum / static_cast<double>(surface.points.size());
}

template <std::size_t N>
Box hull(const std::array<int, N>& particles, const std::vector<Box>& boxes) {
  Box box;
  for (int p : particles) box.extend(boxes[as_index(p)]);
  return box;
}

CandidatePair candidate(ElementPair kind, const std::array<int, 4>& particle, const CollisionBody& first,
                        const CollisionBody& second) {
  CandidatePair pair{kind, particle};
  pair.thickness = (first.thickness + second.thickness) / 2;
  pair.friction = std::min(first.friction, second.friction);
  pair.of_one_body = &first == &second;
  return pair;
}

bool repels(const CandidatePair& pair, const CollisionSurface& surface) {
  return !pair.of_one_body ||
         closest_points(pair.kind, corners(pair.particle, surface.initial)).difference.norm() >=
             initial_proximity * pair.thickness;
}

// What the two elements are apart at least, m: the distance of their boxes if that is a good part of `range`,
// or their own.
double least_distance(const CandidatePair& pair, const std::vector<Vec3>& x, double range) {
  const FourPoints at = corners(pair.particle, x);
  const std::size_t first = pair.kind == ElementPair::point_triangle ? 1 : 2;
  Box a, b;
  for (std::size_t i = 0; i < 4; ++i) (i < first ? a : b).extend(at[i]);
  const double squared = a.squaredExteriorDistance(b);
  return squared > 4 * range * range ? std::sqrt(squared) : closest_points(pair.kind, at).difference.norm();
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

}  // namespace

void CollisionCandidates::update(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                 const std::vector<Vec3>& end) {
  if (!hold(surface, start, end)) search(surface, start, end);
  add_travels(surface, start, end);
  wake_pairs(surface, start);
}

void CollisionCandidates::search(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                 const std::vector<Vec3>& end) {
  ++searches_;
  enlarge_boxes(surface, start, end);
  find_active(surface.point_body, surface, points_);
  find_active(surface.edge_body, surface, edges_);
  find_active(surface.triangle_body, surface, triangles_);
  triangle_tree_.build(triangles_.box, triangles_.active);
  edge_tree_.build(edges_.box, edges_.active);
  pairs_.clear();
  sleeps_.clear();
  const std::size_t first_edge = surface.points.size(), first_triangle = first_edge + surface.edges.size();
  find_pairs(ElementPair::point_triangle, surface.points, surface.point_body, points_, surface.triangles,
             surface.triangle_body, triangle_tree_, surface, 0, first_triangle);
  find_pairs(ElementPair::edge_edge, surface.edges, surface.edge_body, edges_, surface.edges,
             surface.edge_body, edge_tree_, surface, first_edge, first_edge);
  begin_travels(surface, start);
}

void CollisionCandidates::begin_travels(const CollisionSurface& surface, const std::vector<Vec3>& start) {
  travel_.assign(surface.points.size() + surface.edges.size() + surface.triangles.size(), {});
  last_.resize(start.size());
  stretch_.resize(start.size());
  further_.resize(start.size());
  for (const auto& [p] : surface.points) last_[as_index(p)] = start[as_index(p)] - mean_;
}

void CollisionCandidates::add_travels(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                      const std::vector<Vec3>& end) {
  const Vec3 start_mean = mean_position(surface, start), end_mean = mean_position(surface, end);
  parallel_for(surface.points.size(), travel_grain, [&](std::size_t begin, std::size_t stop) {
    for (std::size_t i = begin; i < stop; ++i) {
      const auto p = as_index(surface.points[i][0]);
      const Vec3 from = start[p] - start_mean;
      stretch_[p] = (from - last_[p]).norm();
      further_[p] = (end[p] - end_mean - from).norm();
      last_[p] = from;
    }
  });
  const auto add = [&](const auto& elements, std::size_t first) {
    parallel_for(elements.size(), travel_grain, [&](std::size_t begin, std::size_t stop) {
      for (std::size_t i = begin; i < stop; ++i) {
        double stretch = 0, further = 0;
        for (const int p : elements[i]) {
          stretch = std::max(stretch, stretch_[as_index(p)]);
          further = std::max(further, further_[as_index(p)]);
        }
        Travel& travel = travel_[first + i];
        travel.before += stretch;
        travel.including = travel.before + further;
      }
    });
  };
  add(surface.points, 0);
  add(surface.edges, surface.points.size());
  add(surface.triangles, surface.points.size() + surface.edges.size());
}

void CollisionCandidates::wake_pairs(const CollisionSurface& surface, const std::vector<Vec3>& start) {
  const std::size_t chunks = (pairs_.size() + pair_grain - 1) / pair_grain;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  parallel_for(pairs_.size(), pair_grain, [&](std::size_t begin, std::size_t stop) {
    std::vector<int>& found = chunks_[begin / pair_grain].near;
    found.clear();
    for (std::size_t k = begin; k < stop; ++k) {
      Sleep& sleep = sleeps_[k];
      const Travel &a = travel_[as_index(sleep.first)], &b = travel_[as_index(sleep.second)];
      if (a.including + b.including < sleep.until) continue;
      CandidatePair& pair = pairs_[k];
      const double range = repulsion_range * pair.thickness;
      const double apart = least_distance(pair, start, range) - (1 + rounding) * range;
      sleep.until = a.before + b.before + apart;
      if (a.including + b.including < sleep.until) continue;
      if (!pair.examined) pair.repels = repels(pair, surface);
      pair.examined = true;
      found.push_back(static_cast<int>(k));
    }
  });
  near_.clear();
  for (std::size_t c = 0; c < chunks; ++c)
    near_.insert(near_.end(), chunks_[c].near.begin(), chunks_[c].near.end());
}

bool CollisionCandidates::hold(const CollisionSurface& surface, const std::vector<Vec3>& start,
                               const std::vector<Vec3>& end) const {
  if (particle_box_.size() != start.size()) return false;
  const Vec3 start_shift = mean_position(surface, start) - mean_,
             end_shift = mean_position(surface, end) - mean_;
  return std::all_of(surface.points.begin(), surface.points.end(), [&](const std::array<int, 1>& point) {
    const auto p = as_index(point[0]);
    return particle_box_[p].contains(start[p] - start_shift) && particle_box_[p].contains(end[p] - end_shift);
  });
}

void CollisionCandidates::enlarge_boxes(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                        const std::vector<Vec3>& end) {
  particle_box_.resize(start.size());
  mean_ = mean_position(surface, start);
  const Vec3 shift = mean_position(surface, end) - mean_;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const auto p = as_index(surface.points[i][0]);
    const double thickness = surface.bodies[as_index(surface.point_body[i])].thickness;
    particle_box_[p] = grown(Box(start[p]).extend(end[p] - shift), room * thickness);
  }
  const auto reach = [&](int body) { return repulsion_range / 2 * surface.bodies[as_index(body)].thickness; };
  body_box_.assign(surface.bodies.size(), Box());
  points_.box.resize(surface.points.size());
  for (std::size_t i = 0; i < points_.box.size(); ++i) {
    const int body = surface.point_body[i];
    points_.box[i] = grown(hull(surface.points[i], particle_box_), reach(body));
    body_box_[as_index(body)].extend(points_.box[i]);
  }
  edges_.box.resize(surface.edges.size());
  for (std::size_t i = 0; i < edges_.box.size(); ++i)
    edges_.box[i] = grown(hull(surface.edges[i], particle_box_), reach(surface.edge_body[i]));
  triangles_.box.resize(surface.triangles.size());
  for (std::size_t i = 0; i < triangles_.box.size(); ++i)
    triangles_.box[i] = grown(hull(surface.triangles[i], particle_box_), reach(surface.triangle_body[i]));
}

void CollisionCandidates::find_active(const std::vector<int>& body_of, const CollisionSurface& surface,
                                      Elements& elements) const {
  elements.active.clear();
  for (std::size_t i = 0; i < body_of.size(); ++i) {
    const auto body = as_index(body_of[i]);
    bool active = surface.bodies[body].itself;
    for (std::size_t other = 0; other < body_box_.size() && !active; ++other)
      active = other != body && body_box_[other].intersects(elements.box[i]);
    if (active) elements.active.push_back(static_cast<int>(i));
  }
}

// The pairs of the `asking` elements with those of `tree`; of two edges, the one of smaller index asks.
template <std::size_t N, std::size_t M>
void CollisionCandidates::find_pairs(ElementPair kind, const std::vector<std::array<int, N>>& first,
                                     const std::vector<int>& first_body, const Elements& asking,
                                     const std::vector<std::array<int, M>>& second,
                                     const std::vector<int>& second_body, const BoxTree& tree,
                                     const CollisionSurface& surface, std::size_t first_number,
                                     std::size_t second_number) {
  const std::size_t chunks = (asking.active.size() + grain - 1) / grain;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  const auto may_touch = [&](std::size_t i, std::size_t k) {
    if (kind == ElementPair::edge_edge && k <= i) return false;
    if (first_body[i] != second_body[k]) return true;
    return surface.bodies[as_index(first_body[i])].itself && !share_particle(first[i], second[k]);
  };
  parallel_for(asking.active.size(), grain, [&](std::size_t begin, std::size_t end) {
    Chunk& chunk = chunks_[begin / grain];
    chunk.pairs.clear();
    chunk.sleeps.clear();
    for (std::size_t a = begin; a < end; ++a) {
      const auto i = as_index(asking.active[a]);
      chunk.near.clear();
      tree.query(asking.box[i], [&](int k) {
        if (may_touch(i, as_index(k))) chunk.near.push_back(k);
      });
      std::sort(chunk.near.begin(), chunk.near.end());
      for (const int k : chunk.near) {
        chunk.pairs.push_back(candidate(kind, joined(first[i], second[as_index(k)]),
                                        surface.bodies[as_index(first_body[i])],
                                        surface.bodies[as_index(second_body[as_index(k)])]));
        chunk.sleeps.push_back({static_cast<int>(first_number + i), static_cast<int>(second_number) + k, 0});
      }
    }
  });
  for (std::size_t c = 0; c < chunks; ++c) {
    pairs_.insert(pairs_.end(), chunks_[c].pairs.begin(), chunks_[c].pairs.end());
    sleeps_.insert(sleeps_.end(), chunks_[c].sleeps.begin(), chunks_[c].sleeps.end());
  }
}

}  // namespace duet
