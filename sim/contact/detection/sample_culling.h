// Sample culling: drops the samples of a round body whose load its support points carry.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Tells which samples and edge contacts of a pair of bodies need not act, because a support point acts for
/// them.
///
/// A wheel touches at its support point. Its samples lie a bit higher there, and would take a part of the
/// load when their motion is linearized. Their impulses would act at their present place instead of below the
/// wheel's axis, and so make a moment against rolling. So samples act only away from the support points and
/// in or almost in their tangent plane: on a coin that lies flat, not on one that rolls. Edge contacts are as
/// good as support points, except where both are at one place.
///
/// Two support points of a cylinder or capsule that touch the same body on the same side bound a straight
/// line of its side. What touches on this line between them, of either body, and is no lower than the
/// straight line between their gaps, is passed over as well: along the edge of a step, samples and edge
/// contacts on one half of a can would turn it to that side.
class SampleCulling {
 public:
  /// Returns whether a support point acts for `contact`, so that the contact may be passed over. `predicted`
  /// is the touch that is predicted for it. The contacts of a pair have to be passed in their order, in which
  /// the support points of a body precede its samples: support points are recorded, and the result for them
  /// is false. At most 32 are recorded: two for each body, and one for each further face of a mesh that these
  /// touch. The samples beside any more would act, too.
  bool carry_for(const ContactPoint& contact, const Touch& predicted) {
    if (!contact.is_rigid_pair()) return false;
    if (contact.feature.is_support()) {
      if (count_ < supports_.size())
        supports_[count_++] = {contact.host, contact.guest_rigid, contact.guest_arm.norm(),
                               (predicted.normal - contact.first_normal).squaredNorm(), predicted};
      return false;
    }
    for (std::size_t i = 0; i + 1 < count_; ++i)
      if (bound_line(supports_[i], supports_[i + 1]) &&
          line_carries(supports_[i], supports_[i + 1], contact.host == supports_[i].host, predicted))
        return true;
    for (std::size_t i = 0; i < count_; ++i)
      if (supports_[i].host == contact.host &&
          carries(supports_[i].touch, contact.is_on_edge(), predicted, contact.guest_arm.norm()))
        return true;
    return false;
  }

 private:
  // A support point that was recorded, its body and the host that it touches, its distance from the center
  // of mass of its body (m), and the square of the angle by which its normal turns in the step.
  struct Support {
    int host, guest;
    double size, squared_turn;
    Touch touch;
  };

  static constexpr double same_side = 0.98;  // cosine of the angle between normals of contacts on one side

  // Returns whether two support points are the ends of a line that touches one host on one side.
  static bool bound_line(const Support& a, const Support& b) {
    return a.host == b.host && a.guest == b.guest && a.touch.normal.dot(b.touch.normal) > same_side &&
           std::isfinite(a.touch.gap) && std::isfinite(b.touch.gap);
  }

  // Returns whether the line between two support points acts for the touch `sample`, the normal of which is
  // that of the same host or of the other body.
  static bool line_carries(const Support& a, const Support& b, bool is_of_same_host, const Touch& sample) {
    constexpr double on_line = 0.01;    // distance from the line that counts as none, relative to the size
    constexpr double at_end = 1e-3;     // distance along the line that counts as none, relative to the size
    constexpr double no_deeper = 1e-6;  // depth below the line that counts as none, relative to the size
    const Vec3 line = b.touch.position - a.touch.position, from_a = sample.position - a.touch.position;
    const double length = line.norm(), size = std::max(a.size, b.size);
    if (!(length > 0)) return false;
    const double along = from_a.dot(line) / length, off = (from_a - along / length * line).norm();
    if (along < -at_end * size || along > length + at_end * size || off > on_line * size) return false;
    const double t = std::clamp(along / length, 0.0, 1.0);
    // The gap of an edge contact is that from a plane, also if the line rolls around an edge.
    const double tolerance = (no_deeper + std::max(a.squared_turn, b.squared_turn)) * size;
    if (sample.gap < (1 - t) * a.touch.gap + t * b.touch.gap - tolerance) return false;
    // At the rim of the body, the nearest part of its surface may be its end.
    if (!is_of_same_host && (along < at_end * size || along > length - at_end * size)) return true;
    return (is_of_same_host ? 1 : -1) * sample.normal.dot((1 - t) * a.touch.normal + t * b.touch.normal) >
           same_side;
  }

  // Returns whether a support point with the touch `support` acts for an edge contact or a sample with the
  // touch `sample`. `size` (m) is the distance of the latter from its body's center of mass.
  static bool carries(const Touch& support, bool is_on_edge, const Touch& sample, double size) {
    // Greatest slope from the support point up to samples that act. Larger values let samples act that a
    // wheel rolls over; smaller ones drop samples of a coin that lies not quite flat.
    constexpr double flat = 0.02;
    constexpr double near = 0.1;  // of `size`: the support point acts for all samples nearer than this
    const double distance = (sample.position - support.position).norm();
    if (support.normal.dot(sample.normal) <= same_side) return false;
    const bool is_hidden = !std::isfinite(support.gap);  // an adjoining body has it, see exposed_plane()
    if (is_on_edge) return distance < near * size && (is_hidden || support.gap <= sample.gap);
    const double above =
        is_hidden ? sample.normal.dot(sample.position - support.position) : sample.gap - support.gap;
    return distance < near * size || above > flat * distance;
  }

  std::array<Support, 32> supports_;
  std::size_t count_ = 0;
};

}  // namespace duet
