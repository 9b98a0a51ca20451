// Sample culling: drops the samples of a round body whose load its support points carry.
#pragma once

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
      if (count_ < supports_.size()) supports_[count_++] = {contact.host, predicted};
      return false;
    }
    for (std::size_t i = 0; i < count_; ++i)
      if (supports_[i].host == contact.host &&
          carries(supports_[i].touch, contact.is_on_edge(), predicted, contact.guest_arm.norm()))
        return true;
    return false;
  }

 private:
  // A support point that was recorded, and the host that it touches.
  struct Support {
    int host;
    Touch touch;
  };

  // Returns whether a support point with the touch `support` acts for an edge contact or a sample with the
  // touch `sample`. `size` (m) is the distance of the latter from its body's center of mass.
  static bool carries(const Touch& support, bool is_on_edge, const Touch& sample, double size) {
    // Greatest slope from the support point up to samples that act. Larger values let samples act that a
    // wheel rolls over; smaller ones drop samples of a coin that lies not quite flat.
    constexpr double flat = 0.02;
    constexpr double near = 0.1;        // of `size`: the support point acts for all samples nearer than this
    constexpr double same_side = 0.98;  // cosine of the angle between normals of contacts on one side
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
