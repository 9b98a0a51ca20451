#include "sim/contact/detection/edge_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/contact/detection/ring_contacts.h"

namespace duet {
namespace {

constexpr double far = std::numeric_limits<double>::infinity();
// Least fall of the distance towards a minimum, relative to the distance between two nodes of the line.
// Shallower minima are those of lines that lie along a face; a larger value would miss edges that cross at a
// small angle.
constexpr double min_fall = 0.005;
// Least change of the slope of the distance from one part of a deformable body's edge to the next at which an
// edge of the host may lie between them. A bend that this overlooks is no deeper than a quarter of this value
// times the length of a part. Neither is the jolt at the moment when the end of the edge passes the host's
// edge and the depth that was overlooked begins to count.
constexpr double min_bend = 0.001;
// Precision of the place of a minimum, relative to the distance between two nodes or to a part.
constexpr double precision = 0.01;
constexpr double edge_of_bend = 1e-3;  // least slope away from a bend, relative to the change of slope at it
constexpr double golden = 0.6180339887498949;  // golden ratio less 1: by which a search interval shrinks
// Least length of the mean of the unit normals on the two sides of a minimum. It is shorter if an edge has
// gone through the host, so that the normals are almost opposite.
constexpr double min_mean = 0.3;
// Least cosine of the angle between the direction into the guest and the normal of a surface that its edge
// faces.
constexpr double min_edge_facing = 0.2;
// Least cosine of the angle between a face of the host and the plane of a deformable body's edge that lies on
// it. Points touch there along the face's own normal, and normals that are nearly equal would be one
// constraint twice over: the contact problem would be ill-conditioned.
constexpr double edge_lies_flat = 1 - 1e-6;
constexpr double
    // Greatest sine of the angle between a line and a flat face that it lies along.
    lies_along = 0.02,
    // Least cosine of the angle between normals of one flat face: rounding.
    same_edge_normal = 1 - 1e-12;
constexpr int end_bisections = 40;  // to the end of a face: the step of one node shrinks to rounding
// Precision of the end of a face, relative to the distance between two nodes.
constexpr double end_precision = 1e-9;

// Computes exact distances from a host for a sequence of places. From one place to the next the distance
// changes by no more than the displacement, and this bound makes the search for it short.
class Distances {
 public:
  explicit Distances(const LevelSet& host) : host_(host) {}
  // Returns the signed distance of `x` (m, host's shape space), m.
  double at(const Vec3& x) {
    distance_ = host_.exact_distance(x, std::abs(distance_) + (x - last_).norm());
    last_ = x;
    return distance_;
  }

 private:
  const LevelSet& host_;
  Vec3 last_ = Vec3::Zero();  // m, host's shape space: the last place
  double distance_ = far;     // m: its distance; infinite before the first one
};

// A plane in the host's shape space.
struct Plane {
  Vec3 normal = Vec3::Zero();  // unit
  double height = 0;           // m: signed distance of the plane from the origin along the normal
};

// Returns the plane at which a line touches the host between `x1` and `x2` (m, host's shape space), one just
// before the place and one just after it.
//
// The distances at the two points are those from two tangent planes of the host. For a host with flat faces
// these meet in its edge, which each plane through it with a weighted mean of their normals contains as well.
// The mean along whose plane the distance does not change belongs to the plane of the two edges that cross.
// If the distance only rises or only falls along the line, the tangent plane on the lower side is taken. On
// smooth hosts the result is the tangent plane. There is none if the line has gone through the host.
std::optional<Plane> plane_of_both(const LevelSet& host, const Vec3& x1, const Vec3& x2) {
  const auto [distance1, n1] = host.exact(x1);
  const auto [distance2, n2] = host.exact(x2);
  const Vec3 along = (x2 - x1).normalized();
  const double slope1 = n1.dot(along), slope2 = n2.dot(along);
  const double share = slope2 > slope1 ? std::clamp(-slope1 / (slope2 - slope1), 0.0, 1.0) : 0.5;
  const Vec3 mean = (1 - share) * n1 + share * n2;
  const double length = mean.norm();
  if (!(length > min_mean)) return std::nullopt;
  const double height = ((1 - share) * (n1.dot(x1) - distance1) + share * (n2.dot(x2) - distance2)) / length;
  return Plane{mean / length, height};
}

// Returns the place between `low` and `high` at which the function `at` is least, to within `precision`, by
// golden section.
template <class Function>
double golden_section(double low, double high, const Function& at) {
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
  return (low + high) / 2;
}

// Searches one feature edge of a guest for edge contacts. Places along the line are counted in nodes from its
// first one.
class Walk {
 public:
  Walk(const FeatureEdges& feature_edges, const FeatureEdges::Line& line, const Pose& pose,
       const LevelSet& host, const Eigen::AlignedBox3d& near, double margin, bool looks_at_faces,
       std::vector<EdgeContact>& found)
      : feature_edges_(feature_edges),
        line_(line),
        pose_(pose),
        host_(host),
        near_(near),
        margin_(margin),
        looks_at_faces_(looks_at_faces),
        found_(found) {}

  // Finds the minima of the distance at the nodes, and refines each of them. The distance changes by no more
  // than the path along the line, so that a node far from the host lets the next ones be skipped.
  void find() {
    const int count = line_.end - line_.begin;
    const double reach = margin_ + host_.tolerance() + line_.radius + line_.longest;
    double before = line_.is_closed ? distance_at(count - 1) : far, here = distance_at(0);
    for (int i = 0; i < count;) {
      if (!(here <= reach)) {  // also if it is not finite
        const double skipped = std::floor((here - reach) / line_.longest);
        i += 1 + (skipped > 0 && skipped < count ? static_cast<int>(skipped) : 0);
        before = far;
        if (i < count) here = distance_at(i);
        continue;
      }
      const bool is_last = i + 1 == count;
      const double after = is_last && !line_.is_closed ? far : distance_at(i + 1);
      if (here <= before && here < after && i >= next_) refine(i);
      before = here;
      here = after;
      ++i;
    }
  }

 private:
  // Returns the position of node `i` of the line, which goes round on closed lines, m, guest's shape space.
  const Vec3& node(int i) const {
    const int count = line_.end - line_.begin;
    return feature_edges_.nodes[as_index(line_.begin + (i + count) % count)];
  }

  // Returns the signed distance of node `i` from the host, m; if that is out of reach, a lower bound of it.
  double distance_at(int i) const {
    const Vec3 x = pose_.to_world(node(i));
    const double out = near_.exteriorDistance(x);
    return out > line_.radius + line_.longest + host_.tolerance() ? out + margin_ : host_.distance(x);
  }

  // Returns the place at `t` from -1, the node before `i`, to 1, the node after it, m, guest's shape space.
  Vec3 place(int i, double t) const {
    return t < 0 ? place_between(line_, node(i), node(i - 1), -t)
                 : place_between(line_, node(i), node(i + 1), t);
  }

  // Finds the minimum near node `i` by golden section, and appends its edge contact if there is one.
  void refine(int i) {
    const bool begins = i == 0 && !line_.is_closed;
    const bool ends = i + 1 == line_.end - line_.begin && !line_.is_closed;
    const double first = begins ? 0 : -1, last = ends ? 0 : 1;
    Distances distances(host_);
    const auto at = [&](double t) { return distances.at(pose_.to_world(place(i, t))); };
    if (at(0) - line_.longest - line_.radius >= margin_) return;
    const double t = golden_section(first, last, at), least = at(t);
    if (least - line_.radius >= margin_) return;
    if (is_axis()) {
      if (lies_on_face(i, t) || is_end(i, t) || !is_on_side((i + t) * line_.longest, least)) return;
    } else if (std::min(at(first), at(last)) - least < min_fall * line_.longest) {
      if (looks_at_faces_) lies_on_face(i, t);
      return;
    }
    // Above a face that is shorter than two segments of the line, all places of the line are equally low but
    // for rounding. The contacts are then at the ends of the face.
    const double beside =
        std::min(at(std::max(first, t - 2 * precision)), at(std::min(last, t + 2 * precision)));
    const bool is_flat = beside - least < min_fall * 2 * precision * line_.longest;
    if (is_flat && looks_at_faces_ && lies_on_face(i, t)) return;
    take(i, std::clamp(t, first + precision, last - precision), least);
  }

  // Returns whether the line is the axis of a capsule or cylinder.
  bool is_axis() const { return line_.radius > 0 && line_.around == 0; }

  // Returns whether the line lies along a face of the host near the place `t` at node `i`, and appends the
  // ends of that face. The search for the minimum may have ended a little beside the face.
  bool lies_on_face(int i, double t) {
    for (const double beside : {0.0, -2 * precision, 2 * precision, -t})
      if (take_ends_of_flat(std::max(0.0, i + t + beside))) return true;
    return false;
  }

  // Returns whether the place `t` at node `i` is an end of the line.
  bool is_end(int i, double t) const {
    return (i == 0 && t < precision) || (i + 1 == line_.end - line_.begin && t > -precision);
  }

  // Returns whether a host at the signed distance `distance` (m) from the axis touches the cylinder's side at
  // the place `at` (m) along it. It touches the end instead if it would come out sooner through that.
  bool is_on_side(double at, double distance) const {
    const double length = (line_.end - line_.begin - 1) * line_.longest;
    return line_.radius - distance <= std::min(at, length - at);
  }

  // Returns the place `s` nodes along the line, m, guest's shape space. Nodes of closed lines go round.
  Vec3 place_at(double s) const {
    const double i = std::floor(s);
    return place(static_cast<int>(i), s - i);
  }

  // Returns the farthest place along the line from `from`, in the direction `way` (1 or -1), up to which
  // is_flat(s) holds. It holds at `from`.
  template <class IsFlat>
  double last_flat(double from, double way, const IsFlat& is_flat) const {
    const int count = line_.end - line_.begin;
    double in = from;
    for (int n = 0; n < count; ++n) {
      const double next = in + way;
      double out = line_.is_closed ? next : std::clamp(next, 0.0, count - 1.0);
      if (!is_flat(out)) {
        for (int k = 0; k < end_bisections; ++k) {
          const double middle = (in + out) / 2;
          (is_flat(middle) ? in : out) = middle;
        }
        return in;
      }
      in = out;
      if (out != next) return in;
    }
    return in;
  }

  // Appends the places at which a line that lies along a flat face or a round side of the host passes the end
  // of it. Returns whether the line lies along such a face at the place `at`.
  //
  // Such places are corners of the polygon that two faces share, or the ends of the part of a cylinder that
  // lies on a face. Without them samples would carry the body too far in, and others of them as it turns. The
  // line's own ends are left out, because they are corners or support points.
  bool take_ends_of_flat(double at) {
    const int count = line_.end - line_.begin;
    const auto face_at = [&](double s) { return host_.exact(pose_.to_world(place_at(s))); };
    const Vec3 normal = face_at(at).normal;
    const auto is_flat = [&](double s) { return normal.dot(face_at(s).normal) > same_edge_normal; };
    if (!is_flat(at - precision / 2) && !is_flat(at + precision / 2)) return false;
    const double low = last_flat(at, -1, is_flat), high = last_flat(at, 1, is_flat);
    const double at_low = face_at(low).distance, at_high = face_at(high).distance,
                 sag = face_at((low + high) / 2).distance - (at_low + at_high) / 2;
    const double most = (is_axis() ? lies_along : min_fall) * (high - low) * line_.longest;
    if (high - low < precision || std::max(std::abs(at_high - at_low), std::abs(sag)) > most) return false;
    next_ = static_cast<int>(high) + 1;
    if (high - low > count - 1 + precision) return true;
    // A line that hardly gets past the end, because it lies along an edge of the host or level with one,
    // needs no contact there: samples and corners tell enough.
    const auto gets_past = [&](double s) {
      const SignedDistance face = face_at(line_.is_closed ? s : std::clamp(s, 0.0, count - 1.0));
      const Vec3 out = face.distance * face.normal;
      return is_axis() || (out - out.dot(normal) * normal).norm() > lies_along * line_.longest;
    };
    if ((low > 0 || line_.is_closed) && gets_past(low - 1))
      take_end_of_flat(low, static_cast<int>(std::floor(low)), normal);
    if ((high < count - 1 || line_.is_closed) && gets_past(high + 1))
      take_end_of_flat(high, static_cast<int>(std::floor(high)) + 1, normal);
    return true;
  }

  // Appends the contact at the end `s` of a face with the normal `normal`, next to node `i`.
  void take_end_of_flat(double s, int i, const Vec3& normal) {
    const Vec3 place = place_at(s), x = pose_.to_world(place);
    const double distance = host_.exact(x).distance;
    if (!(distance - line_.radius < margin_) || (is_axis() && !is_on_side(s * line_.longest, distance)))
      return;
    const int count = line_.end - line_.begin, node = line_.begin + (i + count) % count;
    const Vec3 inward = pose_.orientation * feature_edges_.inward[as_index(node)];
    if (!inward.isZero(0) && normal.dot(inward) < min_edge_facing) return;
    EdgeContact found;
    found.edge = {place, normal, x - distance * normal, line_.radius};
    found.feature = FeatureId::edge(node);
    found.distance = distance - line_.radius;
    found.precision = end_precision * line_.longest;
    found_.push_back(found);
  }

  // Appends the contact at the minimum `t` near node `i`, whose distance from the host is `least` (m).
  void take(int i, double t, double least) {
    const std::optional<Plane> plane = plane_of_both(host_, pose_.to_world(place(i, t - precision)),
                                                     pose_.to_world(place(i, t + precision)));
    if (!plane) return;
    const Vec3& normal = plane->normal;
    const Vec3 inward = pose_.orientation * feature_edges_.inward[as_index(line_.begin + i)];
    if (!inward.isZero(0) && normal.dot(inward) < min_edge_facing) return;
    const Vec3 place_in_guest = place(i, t), x = pose_.to_world(place_in_guest);
    EdgeContact found;
    found.edge = {place_in_guest, normal, x - (normal.dot(x) - plane->height) * normal, line_.radius};
    found.feature = FeatureId::edge(line_.begin + i);
    found.distance = least - line_.radius;
    found.precision = precision * line_.longest;
    found_.push_back(found);
  }

  const FeatureEdges& feature_edges_;
  const FeatureEdges::Line& line_;
  const Pose& pose_;
  const LevelSet& host_;
  const Eigen::AlignedBox3d& near_;
  double margin_;
  bool looks_at_faces_;  // true if the ends of faces that the line lies along are to be found
  std::vector<EdgeContact>& found_;
  int next_ = 0;  // the first node past a face whose ends have been found
};

// Returns the contact of a deformable body's edge from `first` to `second` (m, host's shape space) at the
// place `at`, counted in parts from the first end, whose distance from the host is `least` (m).
std::optional<EdgeContact> place_on_edge(const Vec3& first, const Vec3& second, int parts, double at,
                                         double least, const LevelSet& host) {
  const auto place = [&](double t) { return first + t / parts * (second - first); };
  std::optional<Plane> plane = plane_of_both(host, place(at - precision), place(at + precision));
  if (!plane) return std::nullopt;
  for (const double side : {at - precision, at + precision}) {
    const auto [distance, n] = host.exact(place(side));
    if (!(plane->normal.dot(n) > edge_lies_flat)) continue;
    plane = Plane{n, n.dot(place(side)) - distance};
    break;
  }
  const Vec3 x = place(at), foot = x - (plane->normal.dot(x) - plane->height) * plane->normal;
  return EdgeContact{.edge = {x, plane->normal, foot, 0, {1 - at / parts, at / parts}},
                     .plane_frame = {},
                     .feature = {},
                     .distance = least,
                     .precision = precision * (second - first).norm() / parts};
}

// Returns the contact of a deformable body's edge with a round host at the place nearest to it. There is none
// at the ends of the edge, because particles touch there.
std::optional<EdgeContact> nearest_place_on_edge(const Vec3& first, const Vec3& second, int parts,
                                                 const LevelSet& host, double margin) {
  const auto distance_at = [&](double t) { return host.distance(first + t / parts * (second - first)); };
  int nearest = 0;
  double least = far;
  for (int i = 0; i <= parts; ++i)
    if (const double distance = distance_at(i); distance < least) {
      nearest = i;
      least = distance;
    }
  if (least - (second - first).norm() / parts >= margin) return std::nullopt;
  const double at = golden_section(std::max(0, nearest - 1), std::min(parts, nearest + 1), distance_at);
  if (at < precision || at > parts - precision) return std::nullopt;
  least = distance_at(at);
  if (!(least < margin)) return std::nullopt;
  std::optional<EdgeContact> found = place_on_edge(first, second, parts, at, least, host);
  if (found) found->plane_frame.kind = PlaneFrame::Kind::edge;
  return found;
}

// Returns whether an edge (m, host's shape space) is at an angle of 60 degrees or more to the axis of a
// cylinder, which is the y axis. It then touches the side at one place.
bool crosses_axis(const Vec3& first, const Vec3& second) {
  constexpr double max_cosine = 0.5;
  const Vec3 edge = second - first;
  return std::abs(edge.y()) <= max_cosine * edge.norm();
}

// Returns whether a place touches the side of a cylinder, and not its rim or an end.
bool is_round_there(const EdgePoint& edge) {
  constexpr double rounding = 1e-6;  // of the normal's component along the axis, which is 0 on the side
  return std::abs(edge.normal.y()) < rounding;
}

// Appends the ring contacts of a ring with a cylinder or box, and removes the edge contacts among `found`
// from `first` on that are at the same places. A plane that stays on a cylinder that rolls would turn with
// it, and a place that stays on the ring would be left behind by a box that slides along it.
void put_arcs(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host, double margin,
              std::ptrdiff_t first, std::vector<EdgeContact>& found) {
  const auto count = static_cast<std::ptrdiff_t>(found.size());
  find_ring_contacts(feature_edges, pose, host, margin, found);
  const auto begin = found.begin() + first, arcs = found.begin() + count;
  const double near_by = feature_edges.lines.front().longest;
  const auto is_replaced = [&](const EdgeContact& near) {
    return has_arcs_at(host, near.edge.normal) && std::any_of(arcs, found.end(), [&](const EdgeContact& arc) {
             return (arc.edge.foot - near.edge.foot).norm() < near_by;
           });
  };
  found.erase(std::remove_if(begin, arcs, is_replaced), arcs);
}

}  // namespace

bool is_swept_by_ball(const LevelSet& shape) {
  return shape.kind == LevelSet::Kind::sphere || shape.kind == LevelSet::Kind::capsule ||
         shape.kind == LevelSet::Kind::torus;
}

double radius_of_ball(const LevelSet& shape) {
  return shape.kind == LevelSet::Kind::torus ? shape.tube : shape.radius;
}

bool can_touch_with_feature_edges(const LevelSet& guest, const LevelSet& host, PairDirection direction) {
  if (host.kind == LevelSet::Kind::half_space)
    return false;  // touched at the ends of lines, or all along them
  if (!is_swept_by_ball(host)) return true;
  if (touch_along_ring(guest, host)) return is_guest_of_ring(guest, host, direction);
  return host.kind != LevelSet::Kind::sphere && is_swept_by_ball(guest) &&
         direction == PairDirection::as_found;
}

void find_edge_contacts(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host,
                        const Eigen::AlignedBox3d& near, double margin, std::vector<EdgeContact>& found,
                        EdgesOnFaces on_faces) {
  const bool is_ring = !feature_edges.lines.empty() && feature_edges.lines.front().radius > 0 &&
                       feature_edges.lines.front().around > 0;
  if (is_ring && is_swept_by_ball(host)) {
    find_ring_contacts(feature_edges, pose, host, margin, found);
    return;
  }
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  for (const FeatureEdges::Line& line : feature_edges.lines)
    Walk(feature_edges, line, pose, host, near, margin,
         on_faces == EdgesOnFaces::are_found || line.radius > 0, found)
        .find();
  if (is_ring && (host.kind == LevelSet::Kind::cylinder || host.kind == LevelSet::Kind::box))
    put_arcs(feature_edges, pose, host, margin, first, found);
}

bool can_touch_soft_edges(const LevelSet& host, const FeatureEdges& feature_edges) {
  return !feature_edges.lines.empty() || is_swept_by_ball(host);
}

// On hosts with edges the search looks for places at which the distance bends, not for minima: an edge that
// has been moved out of the host lies along one of its faces, and its distance has no minimum until it comes
// back.
std::optional<EdgeContact> edge_contact_on(const Vec3& first, const Vec3& second, int parts,
                                           const LevelSet& host, double margin,
                                           std::vector<double>& distance) {
  const double length = (second - first).norm(), part = length / parts;
  const double reach = margin + host.tolerance();
  if (host.distance((first + second) / 2) - length / 2 > reach) return std::nullopt;
  if (is_swept_by_ball(host)) return nearest_place_on_edge(first, second, parts, host, margin);
  if (host.kind == LevelSet::Kind::cylinder && crosses_axis(first, second))
    if (const auto found = nearest_place_on_edge(first, second, parts, host, margin);
        found && is_round_there(found->edge))
      return found;
  const auto place = [&](double at) { return first + at / parts * (second - first); };
  distance.clear();
  for (int i = 0; i <= parts; ++i) distance.push_back(host.distance(place(i)));
  const auto bend = [&](int i) {
    if (i == 0 || i == parts) return 0.0;
    return distance[as_index(i + 1)] - 2 * distance[as_index(i)] + distance[as_index(i - 1)];
  };
  std::optional<EdgeContact> lowest;
  for (int i = 1; i < parts; ++i) {
    const double here = bend(i);
    if (!(here > min_bend * part && here > bend(i - 1) && here >= bend(i + 1))) continue;
    if (distance[as_index(i)] - part > reach) continue;
    Distances distances(host);
    const auto at_part = [&](double t) { return distances.at(place(t)); };
    // On a segment no distance is less than the mean of those of its ends minus half its length.
    const double middle = at_part(i);
    if (middle - part >= margin) continue;
    if ((middle + std::min(at_part(i - 1), at_part(i + 1)) - part) / 2 >= margin) continue;
    // If the distance only rises or only falls, it has no minimum. The bend is then where the distance less a
    // line with a slope between those on its two sides is least.
    const double first_slope = (at_part(i - 1 + precision) - at_part(i - 1)) / precision;
    const double last_slope = (at_part(i + 1) - at_part(i + 1 - precision)) / precision;
    const double min_away = edge_of_bend * std::max(0.0, last_slope - first_slope);
    const double slope =
        std::clamp(0.0, first_slope + min_away, std::max(first_slope, last_slope) - min_away);
    const double at =
        std::clamp(golden_section(i - 1, i + 1, [&](double t) { return at_part(t) - slope * t; }),
                   i - 1 + precision, i + 1 - precision);
    const double least = at_part(at);
    if (!(least < margin) || (lowest && lowest->distance <= least)) continue;
    if (const auto found = place_on_edge(first, second, parts, at, least, host)) lowest = found;
  }
  return lowest;
}

}  // namespace duet
