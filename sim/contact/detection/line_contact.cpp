#include "sim/contact/detection/line_contact.h"

#include <cmath>

#include "sim/contact/detection/near_visits.h"
#include "sim/contact/detection/shape_support_point.h"

namespace duet {
namespace {

constexpr double flatness = 1e-6;  // by how much unit normals of one plane may differ: rounding
// Greatest slope of the line towards the plane at which it still lies on it. A steeper line touches with one
// end.
constexpr double slope = 0.02;
// Fractions of the load of an even line that each end and each inner point carry, see add_lines().
constexpr double end_share = 0.125, inner_share = 0.375;

// Finds the line contacts of one pair of bodies, in one direction.
class Lines {
 public:
  Lines(const Bodies& bodies, const BodyPair& pair, PairDirection direction, CandidateSearch::Chunk& chunk)
      : bodies_(bodies),
        pair_(pair),
        is_reversed_(direction == PairDirection::reversed),
        host_(bodies.rigid.properties[as_index(pair.host)].shape),
        guest_(bodies.rigid.properties[as_index(pair.guest_rigid)].shape),
        in_host_(in_host_of(bodies.rigid, pair)),
        chunk_(chunk) {}

  void find(std::size_t begin) {
    const std::size_t end = chunk_.touches.size();
    for (std::size_t i = begin; i < end; ++i) {
      if (!is_end(i, 0)) continue;
      for (std::size_t j = begin; j < end; ++j)
        if (is_end(j, 1) && lie_on_one_plane(i, j) && add(i, j)) break;
    }
  }

 private:
  // Returns whether touch i is that of end k (0 or 1) of the guest, and in no patch yet.
  bool is_end(std::size_t i, int k) const {
    const NearPoint& touch = chunk_.touches[i];
    return touch.reversed == is_reversed_ && touch.feature.is_support() && touch.patch < 0 &&
           touch.feature.index == k && std::isfinite(touch.gap);
  }

  // Returns whether the touches i and j are near one plane, and almost equally high above it.
  bool lie_on_one_plane(std::size_t i, std::size_t j) const {
    const NearPoint &a = chunk_.touches[i], &b = chunk_.touches[j];
    const double length = (a.position - b.position).norm();
    return (a.plane_index >= 0) == (b.plane_index >= 0) && (a.normal - b.normal).norm() <= flatness &&
           std::abs(a.normal.dot(a.position - b.position)) <= slope * length &&
           std::abs(a.gap - b.gap) <= slope * length;
  }

  // Appends the two points between the ends, whose touches are i and j, and makes all four a patch. Returns
  // whether it did: both points have to be near the plane of the ends.
  bool add(std::size_t i, std::size_t j) {
    NearPoint inner[2];
    for (int n = 0; n < 2; ++n) {
      inner[n] = chunk_.touches[i];
      inner[n].feature.index = 2 + n;
      if (!place(inner[n])) return false;
    }
    ContactPatch& patch = chunk_.reduction.patches.emplace_back();
    patch.number = static_cast<int>(chunk_.reduction.patches.size()) - 1;
    patch.reversed = is_reversed_;
    for (const std::size_t end : {i, j}) put_in(patch, end_share, chunk_.touches[end]);
    for (NearPoint& touch : inner) {
      put_in(patch, inner_share, touch);
      chunk_.touches.push_back(touch);
    }
    return true;
  }

  // Computes position and gap of the point that `touch.feature` names, against the plane of the touch.
  // Returns whether the point is near that plane as well.
  bool place(NearPoint& touch) const {
    const int k = touch.feature.index;
    if (touch.plane_index >= 0) {
      const EdgePoint& face = chunk_.planes[as_index(touch.plane_index)].edge;
      touch.position = in_host_.to_world(
          support_point(guest_, k, in_host_.orientation.conjugate() * face.normal).position);
      touch.gap = face.normal.dot(touch.position - face.foot);
      return true;
    }
    const ShapeSupportPoint support = support_point(guest_, k, in_host_, host_);
    const ContactPlane plane =
        exposed_plane(bodies_, pair_.host, shape_pose(bodies_.rigid, as_index(pair_.host)), support.position,
                      support.inside, PointKind::support);
    const bool is_same =
        plane.faces && std::isfinite(plane.gap) && (plane.normal - touch.normal).norm() <= flatness;
    touch.position = support.position;
    touch.gap = plane.gap;
    return is_same;
  }

  // Makes a touch a point of `patch` with the fraction `share` of its load.
  static void put_in(const ContactPatch& patch, double share, NearPoint& touch) {
    touch.patch = patch.number;
    touch.share = share;
  }

  const Bodies& bodies_;
  const BodyPair& pair_;
  bool is_reversed_;
  const LevelSet &host_, &guest_;
  Pose in_host_;
  CandidateSearch::Chunk& chunk_;
};

}  // namespace

void add_lines(const Bodies& bodies, const BodyPair& pair, PairDirection direction, std::size_t begin,
               CandidateSearch::Chunk& chunk) {
  const LevelSet& host = bodies.rigid.properties[as_index(pair.host)].shape;
  const LevelSet& guest = bodies.rigid.properties[as_index(pair.guest_rigid)].shape;
  if (support_numbers(guest) == support_point_count(guest) || rolls_over_samples(host)) return;
  Lines(bodies, pair, direction, chunk).find(begin);
}

}  // namespace duet
