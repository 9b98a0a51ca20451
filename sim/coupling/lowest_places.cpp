#include "sim/coupling/lowest_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

constexpr double far = std::numeric_limits<double>::infinity();
// By how much of the way between two nodes the distance falls towards a minimum, at least.
constexpr double least_fall = 0.005;
// By how much the slope of the distance changes from one part of a soft edge to the next where an edge of the
// host may lie between them, at least: what it overlooks is no deeper than a quarter of this, of a part.
constexpr double least_bend = 0.03;
constexpr double precision = 0.01;  // of the place, of the way between two nodes
constexpr double golden = 0.6180339887498949;
// Of the mean of the normals on the two sides of a minimum: shorter where an edge has gone through the host.
constexpr double least_mean = 0.3;
// Cosine of the angle between the way inwards and the normal of a surface that an edge faces, at least.
constexpr double least_facing = 0.2;

bool is_swept_by_ball(const LevelSet& shape) {
  return shape.kind == LevelSet::Kind::sphere || shape.kind == LevelSet::Kind::capsule ||
         shape.kind == LevelSet::Kind::torus;
}

// Of one line.
class Walk {
 public:
  Walk(const Ridges& ridges, const Ridges::Line& line, const Pose& pose, const LevelSet& host,
       const Eigen::AlignedBox3d& near, double margin, std::vector<NearRidge>& found)
      : ridges_(ridges), line_(line), pose_(pose), host_(host), near_(near), margin_(margin), found_(found) {}

  // Distances change by no more than the way along the line, so what is far off lets nodes be skipped.
  void find() {
    const int count = line_.end - line_.begin;
    const double reach = margin_ + host_.tolerance() + line_.radius + line_.longest;
    double before = line_.is_closed ? distance_at(count - 1) : far, here = distance_at(0);
    for (int i = 0; i < count;) {
      if (!(here <= reach)) {  // what is not finite is no contact
        const double skipped = std::floor((here - reach) / line_.longest);
        i += 1 + (skipped > 0 && skipped < count ? static_cast<int>(skipped) : 0);
        before = far;
        if (i < count) here = distance_at(i);
        continue;
      }
      const bool is_last = i + 1 == count;
      const double after = is_last && !line_.is_closed ? far : distance_at(i + 1);
      if (here <= before && here < after) refine(i);
      before = here;
      here = after;
      ++i;
    }
  }

 private:
  const Vec3& node(int i) const {
    const int count = line_.end - line_.begin;
    return ridges_.nodes[as_index(line_.begin + (i + count) % count)];
  }

  // At most the distance where that is out of reach.
  double distance_at(int i) const {
    const Vec3 x = pose_.to_world(node(i));
    const double out = near_.exteriorDistance(x);
    return out > line_.radius + line_.longest + host_.tolerance() ? out + margin_ : host_.distance(x);
  }

  // t in [-1, 1] from the node before i to the one after it.
  Vec3 place(int i, double t) const {
    return t < 0 ? place_between(line_, node(i), node(i - 1), -t)
                 : place_between(line_, node(i), node(i + 1), t);
  }

  // The minimum near node i, by golden section.
  void refine(int i) {
    const bool begins = i == 0 && !line_.is_closed;
    const bool ends = i + 1 == line_.end - line_.begin && !line_.is_closed;
    const double first = begins ? 0 : -1, last = ends ? 0 : 1;
    const auto at = [&](double t) { return host_.exact(pose_.to_world(place(i, t))).distance; };
    if (at(0) - line_.longest - line_.radius >= margin_) return;
    double low = first, high = last;
    double a = high - golden * (high - low), b = low + golden * (high - low), at_a = at(a), at_b = at(b);
    while (high - low > precision) {
      if (at_a < at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - golden * (high - low);
        at_a = at(a);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + golden * (high - low);
        at_b = at(b);
      }
    }
    const double t = (low + high) / 2, least = at(t);
    if (least - line_.radius >= margin_) return;
    if (std::min(at(first), at(last)) - least < least_fall * line_.longest) return;
    take(i, std::clamp(t, first + precision, last - precision), least);
  }

  // The distance just before the place and just after it are those from two tangent planes. The edge of a
  // host with flat faces lies in both of them, and so does a plane with a mean of their normals; the one
  // across which the distance does not change along the line is that of the two crossing edges. On smooth
  // hosts it is the tangent plane.
  void take(int i, double t, double least) {
    const Vec3 x1 = pose_.to_world(place(i, t - precision)), x2 = pose_.to_world(place(i, t + precision));
    const auto [distance1, n1] = host_.exact(x1);
    const auto [distance2, n2] = host_.exact(x2);
    const Vec3 along = (x2 - x1).normalized();
    const double slope1 = n1.dot(along), slope2 = n2.dot(along);
    const double share = slope2 > slope1 ? std::clamp(-slope1 / (slope2 - slope1), 0.0, 1.0) : 0.5;
    const Vec3 mean = (1 - share) * n1 + share * n2;
    const double length = mean.norm();
    if (!(length > least_mean)) return;
    const Vec3 normal = mean / length, inward = pose_.orientation * ridges_.inward[as_index(line_.begin + i)];
    if (!inward.isZero(0) && normal.dot(inward) < least_facing) return;
    const double height =
        ((1 - share) * (n1.dot(x1) - distance1) + share * (n2.dot(x2) - distance2)) / length;
    const Vec3 place_in_guest = place(i, t), x = pose_.to_world(place_in_guest);
    NearRidge found;
    found.lowest = {place_in_guest, normal, x - (normal.dot(x) - height) * normal, line_.radius};
    found.node = line_.begin + i;
    found.distance = least - line_.radius;
    found.precision = precision * line_.longest;
    found_.push_back(found);
  }

  const Ridges& ridges_;
  const Ridges::Line& line_;
  const Pose& pose_;
  const LevelSet& host_;
  const Eigen::AlignedBox3d& near_;
  double margin_;
  std::vector<NearRidge>& found_;
};

}  // namespace

bool ridges_count(const LevelSet& guest, const LevelSet& host, bool is_reversed) {
  if (host.kind == LevelSet::Kind::half_space) return false;  // lowest at the ends of lines, or all along
  if (!is_swept_by_ball(host)) return true;
  return host.kind != LevelSet::Kind::sphere && is_swept_by_ball(guest) && !is_reversed;
}

void find_lowest_places(const Ridges& ridges, const Pose& pose, const LevelSet& host,
                        const Eigen::AlignedBox3d& near, double margin, std::vector<NearRidge>& found) {
  for (const Ridges::Line& line : ridges.lines) Walk(ridges, line, pose, host, near, margin, found).find();
}

bool edges_count(const LevelSet& host, const Ridges& ridges) {
  return !ridges.lines.empty() && !is_swept_by_ball(host);
}

std::optional<NearRidge> lowest_place_on_edge(const Vec3& first, const Vec3& second, int parts,
                                              const LevelSet& host, const Eigen::AlignedBox3d& near,
                                              double margin, EdgeScratch& scratch) {
  const double length = (second - first).norm(), part = length / parts;
  const double reach = margin + host.tolerance();
  if (host.distance((first + second) / 2) - length / 2 > reach) return std::nullopt;
  std::vector<double>& distance = scratch.distance;
  distance.clear();
  double least = far, bend = 0;
  for (int i = 0; i <= parts; ++i) {
    const double share = static_cast<double>(i) / parts;
    distance.push_back(host.distance((1 - share) * first + share * second));
    least = std::min(least, distance.back());
    if (i > 1)
      bend =
          std::max(bend, distance[as_index(i)] - 2 * distance[as_index(i - 1)] + distance[as_index(i - 2)]);
  }
  if (!(bend > least_bend * part) || least - part / 2 > reach) return std::nullopt;

  Ridges& line = scratch.line;
  line.lines.assign(1, {.begin = 0, .end = parts + 1, .longest = part});
  line.inward.assign(as_index(parts + 1), Vec3::Zero());
  line.nodes.clear();
  for (int i = 0; i <= parts; ++i)
    line.nodes.push_back(first + static_cast<double>(i) / parts * (second - first));
  scratch.found.clear();
  find_lowest_places(line, Pose{}, host, near, margin, scratch.found);
  if (scratch.found.empty()) return std::nullopt;
  NearRidge lowest =
      *std::min_element(scratch.found.begin(), scratch.found.end(),
                        [](const NearRidge& a, const NearRidge& b) { return a.distance < b.distance; });
  lowest.lowest.share = (lowest.lowest.place - first).norm() / length;
  return lowest;
}

}  // namespace duet
