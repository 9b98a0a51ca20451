#include "sim/contact/detection/ring_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/elementary.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {
namespace {

using std::numbers::pi;
// Numbers of arcs on the three levels of division. Odd numbers: with even ones a ring that is shifted along
// an axis of its own would balance on two opposite corners of its polygon.
constexpr std::array<int, 3> arcs{9, 27, ring_numbers};
// RingArc::slack of the shortest arcs, relative to the radius of the tube. Rings overlap by as much. With a
// smaller value, rings that cross at a smaller angle tremble, because the places at which they touch move
// during a step.
constexpr double slack_of_shortest = 1e-4;
// RingArc::slack of the others, relative to the radius of the tube. It is rounding, so that bodies do not
// move when the division changes.
constexpr double slack_of_even = 1e-6;
// An arc stays whole if its middle is higher than its lowest place by no more than this, relative to the
// height of that place above the lowest one of the ring. A smaller value divides more arcs that do not touch,
// and contact solves with more contacts converge more slowly.
constexpr double max_rise = 2;
// Pieces of an arc that are searched for minima.
constexpr std::size_t arc_pieces = 4;
// A ring touches on one side only if the place across the circle from the nearest one is farther from the
// host by more than this, relative to the radius of the tube. Rings that lie on each other touch on both.
constexpr double far_across = 0.1;
// Fall of the distance beyond an end of an arc, relative to the radius of the tube, by which the arc is out
// of touch. With a smaller value, a place that divides into two while a ring tilts would be found on one
// side.
constexpr double clear_fall = 0.01;
// Steps in which the search for the nearest place goes beyond an end of an arc, and their length: a quarter
// of a shortest arc. Together they are 36 degrees, by which the place may move in a step.
constexpr int most_beyond = 32;
constexpr double step_beyond = 2 * pi / (4 * ring_numbers);
// Most steps towards a minimum. The secant method needs about six.
constexpr int most_secants = 30;

constexpr double along_face = 1e-3;  // least component of a normal along an axis that is not rounding

// An arc of a circle in the shape space of the host.
class Arc {
 public:
  Arc(const RingArc& arc, const Pose& pose, const LevelSet& host)
      : host_(host),
        origin_(pose.position),
        radius_(arc.middle.norm()),
        end_(arc.end),
        to_middle_(pose.orientation * (arc.middle / radius_)),
        along_(pose.orientation * Vec3(arc.middle.z() / radius_, 0, -arc.middle.x() / radius_)) {}

  // A place on the arc, at the angle a from its middle.
  struct Place {
    double t = 0;      // tan(a / 2)
    double slope = 0;  // m: derivative of the distance with respect to a
    RingPlace place;
  };

  //   x = o + R ((1 - t^2) c + 2 t e) / (1 + t^2),   t = tan(a / 2)
  Place at(double t) const {
    const double scale = 1 / (1 + t * t), cosine = (1 - t * t) * scale, sine = 2 * t * scale;
    Place here;
    here.t = t;
    here.place.center = origin_ + radius_ * (cosine * to_middle_ + sine * along_);
    const SignedDistance nearest = host_.exact(here.place.center);
    here.place.normal = nearest.normal;
    here.place.distance = nearest.distance;
    here.slope = radius_ * nearest.normal.dot(cosine * along_ - sine * to_middle_);
    return here;
  }

  // Returns the nearest place of the arc to the host.
  Place lowest() const {
    std::array<Place, arc_pieces + 1> places;
    for (std::size_t i = 0; i <= arc_pieces; ++i)
      places[i] = at(end_ * (2 * static_cast<double>(i) / arc_pieces - 1));
    Place best = is_lower(places.back(), places.front()) ? places.back() : places.front();
    for (std::size_t i = 0; i < arc_pieces; ++i) {
      if (!(places[i].slope < 0 && places[i + 1].slope >= 0)) continue;
      const Place lowest = minimum_between(places[i], places[i + 1]);
      if (is_lower(lowest, best)) best = lowest;
    }
    return best;
  }

  // Returns whether the place across the circle from `here` is farther from the host than `here` by more than
  // `most` (m), so that the circle touches on one side only.
  bool is_far_across(const Place& here, double most) const {
    return host_.distance(2 * origin_ - here.place.center) - here.place.distance > most;
  }

  // Returns whether `lowest`, the nearest place of the arc, is an end beyond which the distance falls on.
  bool falls_beyond(const Place& lowest) const {
    return std::abs(lowest.t) == end_ && lowest.slope * lowest.t < 0;
  }

  // Returns `lowest`, the nearest place of the arc, or, if the distance falls on beyond the end where that
  // place is, the next minimum there.
  Place lowest_along(const Place& lowest) const {
    static const double shift = math::sin(step_beyond / 2) / math::cos(step_beyond / 2);
    Place last = lowest;
    const double way = last.t > 0 ? 1 : -1;
    if (!falls_beyond(last)) return last;
    for (int i = 0; i < most_beyond; ++i) {
      const Place next = at((last.t + way * shift) / (1 - way * shift * last.t));
      if (next.slope * way >= 0) return way > 0 ? minimum_between(last, next) : minimum_between(next, last);
      last = next;
    }
    return last;
  }

 private:
  static bool is_lower(const Place& a, const Place& b) { return a.place.distance < b.place.distance; }

  // Returns the place between two whose slopes are negative and not negative at which the slope is zero, by
  // the secant method that keeps the bracket (Illinois algorithm; Dowell, Jarratt 1971).
  Place minimum_between(Place low, Place high) const {
    double low_slope = low.slope, high_slope = high.slope;
    int side = 0;
    for (int i = 0; i < most_secants && high_slope > 0; ++i) {
      const double t = (low.t * high_slope - high.t * low_slope) / (high_slope - low_slope);
      if (!(t > low.t && t < high.t)) break;
      const Place here = at(t);
      if (here.slope < 0) {
        low = here;
        low_slope = here.slope;
        if (side == -1) high_slope /= 2;
        side = -1;
      } else {
        high = here;
        high_slope = here.slope;
        if (side == 1) low_slope /= 2;
        side = 1;
      }
      constexpr double flat = 1e-12;  // slope that counts as zero, relative to the radius: rounding
      if (std::abs(here.slope) <= flat * radius_) return here;
    }
    return is_lower(high, low) ? high : low;
  }

  const LevelSet& host_;
  Vec3 origin_;     // m: center of the circle
  double radius_;   // m: radius of the circle
  double end_;      // RingArc::end
  Vec3 to_middle_,  // unit: from the center of the circle to the middle of the arc
      along_;       // unit: direction of the arc at its middle
};

// Returns place_on_arc() for `arc`, which is `posed` in the host's shape space and has `lowest` as its
// nearest place.
RingPlace place_of(const RingArc& arc, const Arc& posed, const Arc::Place& lowest) {
  if (posed.is_far_across(lowest, far_across * arc.tube)) return posed.lowest_along(lowest).place;
  const Arc::Place middle = posed.at(0);
  const double excess = middle.place.distance - lowest.place.distance;
  const double s = std::clamp(excess / arc.slack - 1, 0.0, 1.0);
  if (s == 0) return middle.place;
  return s == 1 ? lowest.place : posed.at(s * lowest.t).place;
}

// Searches the center line of one torus for ring contacts.
class RingSearch {
 public:
  RingSearch(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host, double margin,
             std::vector<EdgeContact>& found)
      : feature_edges_(feature_edges),
        line_(feature_edges.lines.front()),
        pose_(pose),
        host_(host),
        reach_(margin + line_.radius),
        found_(found) {}

  void find() {
    lowest_ = std::numeric_limits<double>::infinity();
    for (int k = 0; k < arcs[0]; ++k)
      if (const RingArc part = arc(k, 0); may_touch(part, 0))
        lowest_ = std::min(lowest_, Arc(part, pose_, host_).lowest().place.distance);
    if (!(lowest_ < reach_)) return;
    for (int k = 0; k < arcs[0]; ++k) look_at(k, 0);
  }

 private:
  // Returns arc `k` of a level. The first arc of every level has its middle at the angle 0, so that an arc
  // and the middle one of its parts have the same middle.
  RingArc arc(int k, std::size_t level) const {
    const double angle = 2 * pi * k / arcs[level], half = pi / (2 * arcs[level]);
    return {{line_.around * math::sin(angle), 0, line_.around * math::cos(angle)},
            math::sin(half) / math::cos(half),
            slack_of(level) * line_.radius,
            line_.radius};
  }

  // Returns RingArc::slack on a level, relative to the radius of the tube.
  static double slack_of(std::size_t level) {
    return level + 1 == arcs.size() ? slack_of_shortest : slack_of_even;
  }

  // Returns whether any place of the arc is in reach of the host: no place is farther from the middle than
  // half of the arc's length.
  bool may_touch(const RingArc& arc, std::size_t level) const {
    return host_.distance(pose_.to_world(arc.middle)) - line_.around * pi / arcs[level] < reach_;
  }

  // Appends the contact of arc `k` of a level, or those of its parts.
  void look_at(int k, std::size_t level) {
    const RingArc here = arc(k, level);
    if (!may_touch(here, level)) return;
    const Arc posed(here, pose_, host_);
    const Arc::Place lowest = posed.lowest();
    if (!(lowest.place.distance < reach_)) return;
    const double excess = posed.at(0).place.distance - lowest.place.distance,
                 allowed = slack_of_even * line_.radius + max_rise * (lowest.place.distance - lowest_);
    if (excess <= allowed || level + 1 == arcs.size()) {
      if (is_left_to_next(here, posed, lowest)) return;
      take(here, k, level, place_of(here, posed, lowest));
      return;
    }
    for (int part = -1; part <= 1; ++part)
      look_at((3 * k + part + arcs[level + 1]) % arcs[level + 1], level + 1);
  }

  // Returns whether an arc whose nearest place is `lowest` leaves the contact to an arc beyond one of its
  // ends, where the distance is clearly less. Beyond the edge of a face only the nearest places count.
  bool is_left_to_next(const RingArc& arc, const Arc& posed, const Arc::Place& lowest) const {
    if (!posed.falls_beyond(lowest)) return false;
    const double fall = lowest.place.distance - posed.lowest_along(lowest).place.distance;
    if (!is_swept_by_ball(host_)) return fall > slack_of_even * arc.tube;
    return fall > clear_fall * arc.tube && posed.is_far_across(lowest, far_across * arc.tube);
  }

  // Appends the contact of arc `k` of a level at `place`, unless keep_nodes() has removed that place from the
  // line.
  void take(const RingArc& arc, int k, std::size_t level, const RingPlace& place) {
    if (!(place.distance < reach_) || !is_left(pose_.to_body(place.center))) return;
    if (!has_arcs_at(host_, place.normal)) return;
    EdgeContact contact;
    contact.edge.place = arc.middle;
    contact.edge.normal = place.normal;
    contact.edge.foot = place.center - place.distance * place.normal;
    contact.edge.radius = line_.radius;
    contact.edge.weight = {arc.end, slack_of(level), 0};
    contact.feature = FeatureId::edge(k * (arcs.back() / arcs[level]));
    if (!is_swept_by_ball(host_)) contact.feature.sub = 0;
    contact.distance = place.distance - line_.radius;
    contact.precision = slack_of_shortest * line_.radius;
    found_.push_back(contact);
  }

  // Returns whether a place (m, shape space of the torus) is on what keep_nodes() has left of the line.
  bool is_left(const Vec3& place) const {
    return line_.is_closed ||
           std::any_of(feature_edges_.nodes.begin(), feature_edges_.nodes.end(),
                       [&](const Vec3& node) { return (node - place).norm() <= line_.longest; });
  }

  const FeatureEdges& feature_edges_;
  const FeatureEdges::Line& line_;
  const Pose& pose_;
  const LevelSet& host_;
  double reach_;  // m: distance from the host within which places of the center line touch
  std::vector<EdgeContact>& found_;
  double lowest_ = 0;  // m: least distance of the center line from the host
};

}  // namespace

bool touch_along_ring(const LevelSet& a, const LevelSet& b) {
  const bool has_torus = a.kind == LevelSet::Kind::torus || b.kind == LevelSet::Kind::torus;
  return has_torus && is_swept_by_ball(a) && is_swept_by_ball(b);
}

bool is_in_middle(const Vec3& center, const LevelSet& torus) {
  constexpr double difference =
      0.1;  // relative to the tube; greater values let impacts of balls be less exact
  const double rho = math::hypot(center.x(), center.z());
  return math::hypot(rho + torus.radius, center.y()) - math::hypot(rho - torus.radius, center.y()) <
         difference * torus.tube;
}

bool is_left_to_ring(const LevelSet& guest, const Pose& pose, const LevelSet& host) {
  if (!touch_along_ring(guest, host)) return false;
  return guest.kind != LevelSet::Kind::sphere || is_in_middle(pose.position, host);
}

bool is_on_side_of_cylinder(const Vec3& normal) { return std::abs(normal.y()) < along_face; }

bool has_arcs_at(const LevelSet& host, const Vec3& normal) {
  if (host.kind == LevelSet::Kind::cylinder) return is_on_side_of_cylinder(normal);
  if (host.kind == LevelSet::Kind::box) return (normal.array().abs() > along_face).count() > 1;
  return is_swept_by_ball(host);
}

bool is_ring_contact(const ContactPoint& contact) {
  return contact.is_rigid_pair() && contact.is_on_edge() && is_arc(contact.edge);
}

bool is_guest_of_ring(const LevelSet& guest, const LevelSet& host, PairDirection direction) {
  if (guest.kind != host.kind)
    return guest.kind == LevelSet::Kind::sphere ||
           (guest.kind == LevelSet::Kind::torus && host.kind == LevelSet::Kind::capsule);
  return guest.radius < host.radius || (guest.radius == host.radius && direction == PairDirection::as_found);
}

RingPlace place_on_arc(const RingArc& arc, const Pose& pose, const LevelSet& host) {
  const Arc posed(arc, pose, host);
  return place_of(arc, posed, posed.lowest());
}

void find_ring_contacts(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& host,
                        double margin, std::vector<EdgeContact>& found) {
  RingSearch(feature_edges, pose, host, margin, found).find();
}

void find_ring_contacts_of_ball(const FeatureEdges& feature_edges, const Pose& pose, const LevelSet& ball,
                                double margin, std::vector<EdgeContact>& found) {
  const std::size_t first = found.size();
  const Quat back = pose.orientation.conjugate();
  find_ring_contacts(feature_edges, {-(back * pose.position), back}, ball, margin, found);
  for (std::size_t i = first; i < found.size(); ++i) {
    EdgePoint& edge = found[i].edge;
    const Vec3 normal = pose.orientation * -edge.normal;
    edge.foot = pose.position - (ball.radius + found[i].distance) * normal;
    edge.normal = normal;
  }
}

}  // namespace duet
