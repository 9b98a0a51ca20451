#include "sim/contact/response/even_pressure.h"

#include <algorithm>
#include <cmath>
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
constexpr int max_rounds = 8;       // rounds of dropping points that would have to pull, at most

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
      if (point.impulse.isZero(0) &&
          relative_velocity(bodies_, point).dot(point.normal) > point.target + tolerance * point.precision)
        continue;
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

}  // namespace

void spread_evenly(const Bodies& bodies, double tolerance, const ContactPair& pair, ContactSet& contacts) {
  const std::span<ContactPoint> points(contacts.points.data() + pair.begin,
                                       contacts.points.data() + pair.end);
  for (int number = 0; number < pair.patches; ++number) Patch(bodies, number, points).spread(tolerance);
}

}  // namespace duet
