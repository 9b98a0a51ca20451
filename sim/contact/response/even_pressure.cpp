#include "sim/contact/response/even_pressure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace duet {
namespace {

constexpr double parallel = 1e-12;  // largest difference of the unit normals of a patch, which is rounding
constexpr double thinnest = 1e-6;   // width of a patch over its length below which it counts as a line
constexpr double beside =
    1e-9;  // largest distance of the load from the line of such a patch, over its length
// Friction over the largest possible one, beyond which a face counts as sliding.
constexpr double sliding = 0.9;
constexpr double rounding = 1e-12;  // largest pull that counts as zero, over the load
// Least response of a patch to its load under the joints, over that of separate bodies. A face that joints
// hold more firmly moves by leverage, as in loops that lie flat. With 0.4 the contacts of folded loops keep
// 1.6 mm/s of approach, because sweeps with loads of whole faces converge slowly there; 0.7 would leave out
// fingers that slide freely.
constexpr double min_response = 0.5;
constexpr int max_rounds = 8;  // rounds of dropping points that would have to pull, at most

// Returns whether a point touches: it holds an impulse, or its velocity exceeds its target by rounding.
bool touches(const Bodies& bodies, const ContactPoint& point, double tolerance) {
  return !point.impulse.isZero(0) ||
         !(relative_velocity(bodies, point).dot(point.normal) > point.target + tolerance * point.precision);
}

// One patch of a pair. All its quantities are in the plane of its first point.
class Patch {
 public:
  Patch(const Bodies& bodies, int number, std::span<ContactPoint> points)
      : bodies_(bodies), points_(points), number_(number) {}

  // Spreads the load. Does nothing if it is not to be spread, or if no distribution without pull is found.
  void spread(double tolerance) {
    if (!choose_points(tolerance)) return;
    for (int round = 0; round < max_rounds; ++round) {
      if (!solve()) return;
      if (!pulling_) return take();
      drop_pulling();
    }
  }

 private:
  template <class Visit>
  void for_each_chosen(Visit&& visit) {
    for (ContactPoint& point : points_)
      if (point.patch == number_ && point.takes_part) visit(point);
  }

  // Returns the coordinates of a point in the plane, m.
  Eigen::Vector2d place(const ContactPoint& point) const {
    const Vec3& position = bodies_.rigid.state[as_index(point.host)].pose.position;
    const Vec3 x = position + point.host_arm - origin_;
    return {along_u_.dot(x), along_w_.dot(x)};
  }

  // Marks the points that take part, and finds the plane and the load. Returns whether the load is to be
  // spread: the face slides, and has more than three points, whose impulses the load does not determine.
  bool choose_points(double tolerance) {
    int count = 0;
    const ContactPoint* first = nullptr;
    for (ContactPoint& point : points_) {
      if (point.patch != number_) continue;
      point.takes_part = false;
      if (!touches(bodies_, point, tolerance)) continue;
      if (!first) {
        first = &point;
        normal_ = point.normal;
        origin_ = bodies_.rigid.state[as_index(point.host)].pose.position + point.host_arm;
        along_u_ = normal_.unitOrthogonal();
        along_w_ = normal_.cross(along_u_);
      }
      // Points of the two bodies have opposite normals.
      if (std::min((point.normal - normal_).norm(), (point.normal + normal_).norm()) > parallel) return false;
      point.takes_part = true;
      ++count;
    }
    if (count < 4) return false;
    double holding = 0, most = 0;
    for_each_chosen([&](const ContactPoint& point) {
      const double impulse = point.impulse.dot(point.normal);
      load_ += impulse;
      moments_ += impulse * place(point);
      holding += (point.impulse - impulse * point.normal).norm();
      most += point.friction * impulse;
    });
    return load_ > 0 && holding > sliding * most;
  }

  // Finds the distribution p_i = share_i (P/S + g . (x_i - m)) of the load P, with the sum S of the shares,
  // their center m, and C g = M, where M are the moments of the load and C the second moments of the shares
  // about m. For points on a line C has no inverse, and g lies along the line. Returns whether the points can
  // carry the load: those on a line can if the load acts on the line.
  bool solve() {
    double sum = 0;
    Eigen::Vector2d middle(0, 0);
    for_each_chosen([&](const ContactPoint& point) {
      sum += point.share;
      middle += point.share * place(point);
    });
    middle /= sum;
    double uu = 0, uw = 0, ww = 0;
    for_each_chosen([&](const ContactPoint& point) {
      const Eigen::Vector2d at = place(point) - middle;
      uu += point.share * at.x() * at.x();
      uw += point.share * at.x() * at.y();
      ww += point.share * at.y() * at.y();
    });
    const double determinant = uu * ww - uw * uw;
    const Eigen::Vector2d moments = moments_ - load_ * middle;
    Eigen::Vector2d slope;
    if (determinant > thinnest * thinnest * (uu + ww) * (uu + ww)) {
      slope = {(ww * moments.x() - uw * moments.y()) / determinant,
               (uu * moments.y() - uw * moments.x()) / determinant};
    } else {
      const Eigen::Vector2d along = uu > ww ? Eigen::Vector2d(uu, uw) : Eigen::Vector2d(uw, ww);
      const double squared = along.squaredNorm(), across = along.x() * moments.y() - along.y() * moments.x();
      if (!(squared > 0 && std::abs(across) <= beside * std::sqrt(squared * (uu + ww) / sum) * load_))
        return false;
      slope = along.dot(moments) / (squared * (uu + ww)) * along;
    }
    pulling_ = false;
    for_each_chosen([&](ContactPoint& point) {
      point.spread = point.share * (load_ / sum + slope.dot(place(point) - middle));
      pulling_ |= point.spread < -rounding * load_;
    });
    return true;
  }

  // Drops the points that would have to pull.
  void drop_pulling() {
    for (ContactPoint& point : points_)
      if (point.patch == number_ && point.takes_part) point.takes_part = point.spread >= 0;
  }

  // Replaces the normal impulses by the distribution.
  void take() {
    for (ContactPoint& point : points_) {
      if (point.patch != number_) continue;
      const double now = point.takes_part ? std::max(point.spread, 0.0) : 0;
      point.impulse += (now - point.impulse.dot(point.normal)) * point.normal;
    }
  }

  const Bodies& bodies_;
  std::span<ContactPoint> points_;
  int number_;
  Vec3 normal_, along_u_, along_w_, origin_;
  double load_ = 0;                // N s, sum of the normal impulses
  Eigen::Vector2d moments_{0, 0};  // N m s, first moments of the normal impulses about origin_
  bool pulling_ = false;           // true if a point would have to pull
};

// Applies a `wrench` (N s, and N m s about the center of mass) to one rigid body without joints.
void apply_wrench(RigidState& state, const RigidProperties& properties, const Vec6& wrench) {
  apply_impulse(state, properties, Vec3::Zero(), wrench.head<3>());
  apply_angular_impulse(state, properties, wrench.tail<3>());
}

// Updates the load of patch `number` of a pair as a whole. Returns the change of its mean normal velocity,
// m/s over its precision.
double load_patch(Bodies& bodies, ArticulatedResponse& linked, double tolerance, const ContactPair& pair,
                  int number, std::span<ContactPoint> points) {
  RigidBodies& rigid = bodies.rigid;
  const std::array<int, 2> body{pair.host, pair.guest_rigid};
  std::array<Vec6, 2> wrench{Vec6::Zero(), Vec6::Zero()};  // on the two bodies, for the load y = 1
  double missing = 0, shares = 0, least = -std::numeric_limits<double>::infinity();
  int count = 0;
  for (ContactPoint& point : points) {
    point.takes_part = point.patch == number && point.share > 0 && touches(bodies, point, tolerance);
    if (!point.takes_part) continue;
    ++count;
    shares += point.share;
    missing += point.share * (point.target - relative_velocity(bodies, point).dot(point.normal));
    least = std::max(least, -point.impulse.dot(point.normal) / point.share);
    const Vec3 push = point.share * point.normal;
    for (std::size_t k = 0; k < 2; ++k)
      wrench[k] +=
          body[k] == point.guest_rigid ? wrench_of(point.guest_arm, push) : wrench_of(point.host_arm, -push);
  }
  if (count < 2) return 0;
  const auto alone = [&](std::size_t k) {  // the twist of a body without its joints
    const auto b = as_index(body[k]);
    Vec6 twist;
    twist.head<3>() = rigid.properties[b].inverse_mass * wrench[k].head<3>();
    twist.tail<3>() = rigid.state[b].inverse_inertia * wrench[k].tail<3>();
    return twist;
  };
  double response = 0, separate = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double own = wrench[k].dot(alone(k));
    separate += own;
    response +=
        linked.contains(body[k]) ? wrench[k].dot(linked.response_of(body[k], body[k]) * wrench[k]) : own;
  }
  if (linked.contains(body[0]) && linked.contains(body[1]))
    response += 2 * wrench[0].dot(linked.response_of(body[0], body[1]) * wrench[1]);
  if (!(response > min_response * separate)) return 0;
  const double load = std::max(missing / response, least);
  for (ContactPoint& point : points)
    if (point.takes_part) point.impulse += load * point.share * point.normal;
  for (std::size_t k = 0; k < 2; ++k) {
    const auto b = as_index(body[k]);
    if (linked.contains(body[k]))
      linked.push(rigid, body[k], load * wrench[k]);
    else
      apply_wrench(rigid.state[b], rigid.properties[b], load * wrench[k]);
  }
  return std::abs(load) * response / (shares * points.front().precision);
}

}  // namespace

void spread_evenly(const Bodies& bodies, double tolerance, const ContactPair& pair, ContactSet& contacts) {
  const std::span<ContactPoint> points(contacts.points.data() + pair.begin,
                                       contacts.points.data() + pair.end);
  for (int number = 0; number < pair.patches; ++number) Patch(bodies, number, points).spread(tolerance);
}

double load_evenly(Bodies& bodies, ArticulatedResponse& linked, double tolerance, const ContactPair& pair,
                   ContactSet& contacts) {
  if (pair.guest_rigid < 0 || (!linked.contains(pair.host) && !linked.contains(pair.guest_rigid))) return 0;
  const std::span<ContactPoint> points(contacts.points.data() + pair.begin,
                                       contacts.points.data() + pair.end);
  double largest = 0;
  for (int number = 0; number < pair.patches; ++number)
    largest = std::max(largest, load_patch(bodies, linked, tolerance, pair, number, points));
  return largest;
}

}  // namespace duet
