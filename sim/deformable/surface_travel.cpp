#include "sim/deformable/surface_travel.h"

#include <algorithm>
#include <numeric>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr std::size_t grain = 1024;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

void find_means(const CollisionSurface& surface, const std::vector<Vec3>& x, const std::vector<double>& count,
                std::vector<Vec3>& mean) {
  mean.assign(surface.bodies.size(), Vec3::Zero());
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    mean[as_index(surface.point_body[i])] += x[as_index(surface.points[i][0])];
  for (std::size_t body = 0; body < mean.size(); ++body) mean[body] /= std::max(count[body], 1.0);
}

void add(SurfaceTravel::Way& way, double stretch, double further) {
  way.before += stretch;
  way.including = way.before + further;
}

}  // namespace

void SurfaceTravel::begin(const CollisionSurface& surface, const std::vector<Vec3>& start) {
  const std::size_t bodies = surface.bodies.size(),
                    elements = surface.points.size() + surface.edges.size() + surface.triangles.size();
  count_.assign(bodies, 0);
  for (const int body : surface.point_body) ++count_[as_index(body)];
  find_means(surface, start, count_, mean_);
  frame_start_ = frame_end_ = Vec3::Zero();
  last_.assign(start.size(), Vec3::Zero());
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const auto p = as_index(surface.points[i][0]);
    last_[p] = start[p] - mean_[as_index(surface.point_body[i])];
  }
  stretch_.assign(start.size(), 0);
  further_.assign(start.size(), 0);
  body_stretch_.assign(bodies, 0);
  body_further_.assign(bodies, 0);
  body_way_.assign(bodies, {});
  longest_within_.assign(bodies, {});
  within_body_.assign(elements, {});
  shared_.assign(elements, {});
  longest_ = {};
}

void SurfaceTravel::add(const CollisionSurface& surface, const std::vector<Vec3>& start,
                        const std::vector<Vec3>& end) {
  move_frame(surface, start, end);
  add_particles(surface, start, end);
  add_elements(surface.points, surface.point_body, 0);
  add_elements(surface.edges, surface.edge_body, surface.points.size());
  add_elements(surface.triangles, surface.triangle_body, surface.points.size() + surface.edges.size());
  mean_.swap(mean_start_);
}

void SurfaceTravel::move_frame(const CollisionSurface& surface, const std::vector<Vec3>& start,
                               const std::vector<Vec3>& end) {
  find_means(surface, start, count_, mean_start_);
  find_means(surface, end, count_, mean_end_);
  const Vec3 since = median_change(mean_, mean_start_), on = median_change(mean_start_, mean_end_);
  frame_start_ += since;
  frame_end_ = frame_start_ + on;
  for (std::size_t body = 0; body < count_.size(); ++body) {
    body_stretch_[body] = (mean_start_[body] - mean_[body] - since).norm();
    body_further_[body] = (mean_end_[body] - mean_start_[body] - on).norm();
    duet::add(body_way_[body], body_stretch_[body], body_further_[body]);
  }
}

Vec3 SurfaceTravel::median_change(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  const double half = std::accumulate(count_.begin(), count_.end(), 0.0) / 2;
  Vec3 median = Vec3::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    changes_.clear();
    for (std::size_t body = 0; body < count_.size(); ++body)
      changes_.emplace_back(to[body][axis] - from[body][axis], count_[body]);
    std::sort(changes_.begin(), changes_.end());
    double below = 0;
    for (const auto& [change, count] : changes_) {
      below += count;
      if (below < half) continue;
      median[axis] = change;
      break;
    }
  }
  return median;
}

void SurfaceTravel::add_particles(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                  const std::vector<Vec3>& end) {
  parallel_for(surface.points.size(), grain, [&](std::size_t begin, std::size_t stop) {
    for (std::size_t i = begin; i < stop; ++i) {
      const auto p = as_index(surface.points[i][0]), body = as_index(surface.point_body[i]);
      const Vec3 from = start[p] - mean_start_[body];
      stretch_[p] = (from - last_[p]).norm();
      further_[p] = (end[p] - mean_end_[body] - from).norm();
      last_[p] = from;
    }
  });
  double stretch = 0, further = 0;  // of the fastest in the shared frame
  std::size_t i = 0;
  for (std::size_t body = 0; body < count_.size(); ++body) {
    double body_stretch = 0, body_further = 0;
    for (; i < surface.points.size() && as_index(surface.point_body[i]) == body; ++i) {
      body_stretch = std::max(body_stretch, stretch_[as_index(surface.points[i][0])]);
      body_further = std::max(body_further, further_[as_index(surface.points[i][0])]);
    }
    duet::add(longest_within_[body], body_stretch, body_further);
    stretch = std::max(stretch, body_stretch + body_stretch_[body]);
    further = std::max(further, body_further + body_further_[body]);
  }
  duet::add(longest_, stretch, further);
}

// An element goes as far as its fastest corner, and in the shared frame as far as its body's mean besides.
template <std::size_t N>
void SurfaceTravel::add_elements(const std::vector<std::array<int, N>>& corners,
                                 const std::vector<int>& body_of, std::size_t first) {
  parallel_for(corners.size(), grain, [&](std::size_t begin, std::size_t stop) {
    for (std::size_t i = begin; i < stop; ++i) {
      double stretch = 0, further = 0;
      for (const int p : corners[i]) {
        stretch = std::max(stretch, stretch_[as_index(p)]);
        further = std::max(further, further_[as_index(p)]);
      }
      Way &within = within_body_[first + i], &shared = shared_[first + i];
      const Way& body = body_way_[as_index(body_of[i])];
      duet::add(within, stretch, further);
      shared = {within.before + body.before, within.including + body.including};
    }
  });
}

}  // namespace duet
