// Which samples of a round body its deepest points carry for.
#pragma once

#include <array>
#include <cmath>

#include "sim/contact/detection/contact_point.h"

namespace duet {

// A wheel touches where it is lowest. Its samples lie a bit higher there and would take a part of the load
// when their motion is linearized: impulses at where they are now, not below the wheel's axis, and so a
// moment against rolling. So samples count only away from the deepest points and in their tangent plane, or
// nearly so: on a coin that lies flat, not on one that rolls. Lowest places on ridges are as good as deepest
// points, but where they are one and the same.
class SampleCulling {
 public:
  // Whether `contact`, with the touch that is predicted for it, need not be looked at. The contacts of a pair
  // are to be asked about in their order: deepest points precede the samples of their body.
  bool carry_for(const ContactPoint& contact, const Touch& predicted) {
    if (!contact.is_rigid_pair()) return false;
    if (contact.guest_point < 0) {
      if (count_ < deepest_.size()) deepest_[count_++] = {contact.host, predicted};
      return false;
    }
    for (std::size_t i = 0; i < count_; ++i)
      if (deepest_[i].host == contact.host &&
          carries(deepest_[i].touch, contact.is_on_edge(), predicted, contact.guest_arm.norm()))
        return true;
    return false;
  }

 private:
  struct Deepest {
    int host = -1;
    Touch touch;
  };

  static bool carries(const Touch& deepest, bool is_on_edge, const Touch& sample, double size) {
    constexpr double flat = 0.02;       // slope from a deepest point to samples that count
    constexpr double near = 0.1;        // of the guest's size: samples this near the deepest point do not
    constexpr double same_side = 0.98;  // cosine of the angle between normals
    const double distance = (sample.position - deepest.position).norm();
    if (deepest.normal.dot(sample.normal) <= same_side) return false;
    const bool is_hidden = !std::isfinite(deepest.gap);  // another body has it, see exposed_plane()
    if (is_on_edge) return distance < near * size && (is_hidden || deepest.gap <= sample.gap);
    const double above =
        is_hidden ? sample.normal.dot(sample.position - deepest.position) : sample.gap - deepest.gap;
    return distance < near * size || above > flat * distance;
  }

  std::array<Deepest, 8> deepest_;  // two of each body, and their further faces
  std::size_t count_ = 0;
};

}  // namespace duet
