#include "sim/contact/detection/contact_reduction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "sim/contact/detection/load_shares.h"

namespace duet {
namespace {

// Tolerance for points of one plane, relative to the guest's size, and for unit normals of one plane. It is
// above the rounding of poses; a larger value would let dropped points sink deeper.
constexpr double same_plane = 1e-6;
constexpr std::size_t min_touches = 5;  // a face with fewer touches is not worth the search
// Place of the carriers between the middle of a facet (0) and its corners (1), if points are there. Under
// even pressure the mean distance from the middle is farther out: 0.54 of that of the corners for a square,
// 0.67 for a disc.
constexpr double carrier_place = 0.5;
// Least fraction of the load, for points that carry some only when the body is about to tip.
constexpr double min_share = 1e-3;
// Least cosine of the angle between two faces that lie on each other: 8 degrees.
constexpr double lies_level = 0.99;
constexpr int max_faces = 8;  // most faces of the host that are looked at: if there are more, it is curved

// Values of ReductionScratch::state.
constexpr char untouched = 0, kept_first = 1, dropped = 2;

using FlatPoint = ReductionScratch::FlatPoint;

//   height = base.height + slope_u (u - base.u) + slope_w (w - base.w)
// is the supporting plane under the points of a face.
struct Support {
  FlatPoint base;
  double slope_u = 0, slope_w = 0;
  double height_at(const FlatPoint& p) const {
    return base.height + slope_u * (p.u - base.u) + slope_w * (p.w - base.w);
  }
  double above(const FlatPoint& p) const { return p.height - height_at(p); }
};

// The reduction of the touches of one guest near one host, see reduce_contacts().
class Reduction {
 public:
  Reduction(double size, std::size_t begin, std::vector<NearPoint>& touches, ReductionScratch& scratch)
      : tolerance_(same_plane * size), begin_(begin), touches_(touches), scratch_(scratch) {}

  void run() {
    const std::size_t count = touches_.size() - begin_;
    scratch_.state.assign(count, untouched);
    scratch_.kept.clear();
    scratch_.normals.resize(count);
    for (std::size_t i = 0; i < count; ++i) scratch_.normals[i] = touches_[begin_ + i].normal;
    taken_ = 0;
    for (int face = 0; face < max_faces && gather_face(); ++face)
      if (scratch_.face.size() >= min_touches) reduce_face();
    arrange();
  }

 private:
  // Gathers the touches above one face of the host: that of the first touch for which no face has been found.
  // Returns false if there is no such touch.
  bool gather_face() {
    const std::size_t count = scratch_.normals.size();
    while (taken_ < count && scratch_.normals[taken_].isZero(0)) ++taken_;
    if (taken_ == count) return false;
    const Vec3 normal = scratch_.normals[taken_];
    const NearPoint& first = touches_[begin_ + taken_];
    const double plane = normal.dot(first.position) - first.gap;
    const Vec3 along_u = normal.unitOrthogonal(), along_w = normal.cross(along_u);
    scratch_.face.clear();
    for (std::size_t i = taken_; i < count; ++i) {
      const NearPoint& touch = touches_[begin_ + i];
      const double height = normal.dot(touch.position) - plane;
      if ((scratch_.normals[i] - normal).norm() > same_plane || std::abs(height - touch.gap) > tolerance_)
        continue;
      scratch_.face.push_back(
          {static_cast<int>(i), along_u.dot(touch.position), along_w.dot(touch.position), touch.gap});
      scratch_.normals[i].setZero();
    }
    scratch_.normals[taken_].setZero();
    return true;
  }

  // Finds the lowest edge of the lower convex hull of the touches above a face, and reduces the facets on
  // both sides of it. Heights are those above the face.
  void reduce_face() {
    const std::vector<FlatPoint>& face = scratch_.face;
    const FlatPoint lowest = *std::min_element(
        face.begin(), face.end(), [](const FlatPoint& a, const FlatPoint& b) { return a.height < b.height; });
    double min_slope = std::numeric_limits<double>::infinity();
    for (const FlatPoint& p : face)
      if (const double run = distance(lowest, p); run > tolerance_)
        min_slope = std::min(min_slope, (p.height - lowest.height) / run);
    FlatPoint end = lowest;
    for (const FlatPoint& p : face) {
      const double run = distance(lowest, p);
      if (p.height - lowest.height - min_slope * run <= tolerance_ && run > distance(lowest, end)) end = p;
    }
    const double length = distance(lowest, end);
    if (length <= tolerance_) return;
    const double u = (end.u - lowest.u) / length, w = (end.w - lowest.w) / length;
    for (const double side : {1.0, -1.0}) {
      double tilt = std::numeric_limits<double>::infinity();
      for (const FlatPoint& p : face) {
        const double along = u * (p.u - lowest.u) + w * (p.w - lowest.w);
        const double across = side * (u * (p.w - lowest.w) - w * (p.u - lowest.u));
        if (across > tolerance_)
          tilt = std::min(tilt, (p.height - lowest.height - min_slope * along) / across);
      }
      if (std::isfinite(tilt))
        reduce_facet({lowest, min_slope * u - side * tilt * w, min_slope * w + side * tilt * u});
    }
  }

  // Returns the distance of two points along the face, m.
  static double distance(const FlatPoint& a, const FlatPoint& b) {
    return std::sqrt((a.u - b.u) * (a.u - b.u) + (a.w - b.w) * (a.w - b.w));
  }

  // Drops the touches for which the hull of one facet of the guest stands, and makes the facet a patch.
  void reduce_facet(const Support& support) {
    std::vector<FlatPoint>& facet = scratch_.facet;
    facet.clear();
    for (const FlatPoint& p : scratch_.face) {
      if (support.above(p) < -tolerance_) return;  // a point is below the plane: rounding misled the search
      if (support.above(p) <= tolerance_ && state(p) != dropped) facet.push_back(p);
    }
    if (facet.size() < min_touches) return;
    find_hull();
    if (scratch_.hull.size() < 3) return;
    for (const FlatPoint& p : scratch_.face)
      if (state(p) == untouched && is_covered(p, support)) state(p) = dropped;
    measure();
    keep_carriers();
    for (std::size_t i = 0; i < scratch_.hull.size(); ++i) keep(corner(i));
    share_load();
  }

  // Computes the even load on the hull of the facet.
  void measure() {
    scratch_.corners.clear();
    for (std::size_t i = 0; i < scratch_.hull.size(); ++i)
      scratch_.corners.emplace_back(corner(i).u, corner(i).w);
    load_ = even_load(scratch_.corners);
  }

  // Makes the facet a patch, and computes the fractions of the load for which its carriers and corners stand.
  // The search for them begins with half of the load on either.
  void share_load() {
    const std::size_t corners = scratch_.hull.size(), carriers = scratch_.carriers.size();
    scratch_.places = scratch_.corners;
    scratch_.shares.assign(corners, 0.5 / static_cast<double>(corners));
    for (const FlatPoint& p : scratch_.carriers) {
      scratch_.places.emplace_back(p.u, p.w);
      scratch_.shares.push_back(0.5 / static_cast<double>(carriers));
    }
    duet::share_load(load_, scratch_.places, scratch_.shares);
    ContactPatch patch;
    patch.number = static_cast<int>(scratch_.patches.size());
    const NearPoint& first = touch_of(corner(0));
    patch.reversed = first.reversed;
    patch.normal = first.normal;
    patch.foot = first.position - first.gap * first.normal;
    patch.area = load_.area;
    patch.first_corner = scratch_.hull_corners.size();
    patch.corners = corners;
    for (std::size_t i = 0; i < corners; ++i) {
      scratch_.hull_corners.push_back(touch_of(corner(i)).position);
      take(corner(i), patch.number, scratch_.shares[i]);
    }
    for (std::size_t i = 0; i < carriers; ++i)
      take(scratch_.carriers[i], patch.number, scratch_.shares[corners + i]);
    scratch_.patches.push_back(patch);
  }

  NearPoint& touch_of(const FlatPoint& p) { return touches_[begin_ + as_index(p.touch)]; }

  // Makes a touch a point of `patch`, with at least `min_share` of its load. Touches of another patch stay
  // there.
  void take(const FlatPoint& p, int patch, double share) {
    NearPoint& touch = touch_of(p);
    if (touch.patch >= 0 && touch.patch != patch) return;
    touch.patch = patch;
    touch.share += std::max(share, min_share);
  }

  char& state(const FlatPoint& p) { return scratch_.state[as_index(p.touch)]; }
  const FlatPoint& corner(std::size_t i) const { return scratch_.facet[as_index(scratch_.hull[i])]; }

  // Keeps up to four inner points of the facet, which carry the load as long as the body does not tip. If it
  // were on the corners alone, friction would brake spinning almost twice as strongly as on a face with even
  // pressure. Opposite points follow each other, so that the contact solve is less lopsided.
  void keep_carriers() {
    const std::size_t count = scratch_.hull.size(), four = std::min<std::size_t>(count, 4);
    scratch_.carriers.clear();
    for (const std::size_t i : {0, 2, 1, 3}) {
      if (i >= four) continue;
      const FlatPoint& c = corner(i * count / four);
      FlatPoint target;
      target.u = load_.middle.x() + carrier_place * (c.u - load_.middle.x());
      target.w = load_.middle.y() + carrier_place * (c.w - load_.middle.y());
      const FlatPoint carrier = nearest_to(target);
      scratch_.carriers.push_back(carrier);
      keep(carrier);
    }
  }

  // Returns the point of the facet nearest to `target`. If several are equally near but for rounding, it is
  // the one nearest to the middle, and of these the leftmost one as seen from there, so that the carriers lie
  // evenly about the middle.
  FlatPoint nearest_to(const FlatPoint& target) const {
    const auto is_better = [&](const FlatPoint& a, const FlatPoint& b) {
      const double nearer = distance(b, target) - distance(a, target);
      if (std::abs(nearer) > tolerance_) return nearer > 0;
      const double farther_in = distance(b, middle()) - distance(a, middle());
      if (std::abs(farther_in) > tolerance_) return farther_in > 0;
      return turn(middle(), target, a) > turn(middle(), target, b);
    };
    FlatPoint best = scratch_.facet.front();
    for (const FlatPoint& p : scratch_.facet)
      if (is_better(p, best)) best = p;
    return best;
  }
  // Returns the middle of the facet's load.
  FlatPoint middle() const {
    FlatPoint point;
    point.u = load_.middle.x();
    point.w = load_.middle.y();
    return point;
  }

  // Appends a touch to those that are kept, unless it is there.
  void keep(const FlatPoint& p) {
    const auto i = as_index(p.touch);
    if (scratch_.state[i] == kept_first) return;
    scratch_.state[i] = kept_first;
    scratch_.kept.push_back(p.touch);
  }

  // Returns twice the area of the triangle abc along the face, m^2, positive if it turns left.
  static double turn(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
    return (b.u - a.u) * (c.w - a.w) - (b.w - a.w) * (c.u - a.u);
  }

  // Finds the corners of the facet's convex hull, counter-clockwise, by monotone chains (Andrew 1979).
  // Corners that stick out by no more than the tolerance are left out.
  void find_hull() {
    std::vector<FlatPoint>& facet = scratch_.facet;
    std::sort(facet.begin(), facet.end(), [](const FlatPoint& a, const FlatPoint& b) {
      return std::tie(a.u, a.w, a.touch) < std::tie(b.u, b.w, b.touch);
    });
    std::vector<int>& hull = scratch_.hull;
    hull.clear();
    const auto add = [&](int next, std::size_t least) {
      const auto at = [&](int i) -> const FlatPoint& { return facet[as_index(i)]; };
      while (hull.size() > least) {
        const FlatPoint &a = at(hull[hull.size() - 2]), &b = at(hull.back()), &c = at(next);
        if (turn(a, b, c) > tolerance_ * distance(a, c)) break;
        hull.pop_back();
      }
      hull.push_back(next);
    };
    const int count = static_cast<int>(facet.size());
    for (int i = 0; i < count; ++i) add(i, 1);
    const std::size_t lower = hull.size();
    for (int i = count - 2; i >= 0; --i) add(i, lower);
    hull.pop_back();  // the first one again
    // The first corner so far depends on rounding. The hull is made to begin with the touch of the smallest
    // number, so that the order is the same from step to step.
    std::rotate(
        hull.begin(),
        std::min_element(hull.begin(), hull.end(),
                         [&](int a, int b) { return facet[as_index(a)].touch < facet[as_index(b)].touch; }),
        hull.end());
  }

  // Returns whether the point `p` lies above the hull, or lies beside it and is at least as high above the
  // nearest point of the hull as it is away from it along the face.
  bool is_covered(const FlatPoint& p, const Support& support) const {
    FlatPoint nearest = p;
    double least = std::numeric_limits<double>::infinity();
    bool inside = true;
    for (std::size_t i = 0; i < scratch_.hull.size(); ++i) {
      const FlatPoint &a = corner(i), &b = corner((i + 1) % scratch_.hull.size());
      const double length = distance(a, b);
      inside &= turn(a, b, p) >= -tolerance_ * length;
      const double along = (b.u - a.u) * (p.u - a.u) + (b.w - a.w) * (p.w - a.w);
      const double share = std::clamp(along / (length * length), 0.0, 1.0);
      FlatPoint on_edge;
      on_edge.u = a.u + share * (b.u - a.u);
      on_edge.w = a.w + share * (b.w - a.w);
      if (distance(p, on_edge) >= least) continue;
      least = distance(p, on_edge);
      nearest = on_edge;
    }
    if (inside) return true;
    nearest.height = support.height_at(nearest);
    return p.height - nearest.height >= least;
  }

  // Puts the touches that are kept in place of all touches. Carriers and corners come first, because the
  // contacts that the contact solve meets first carry most.
  void arrange() {
    for (std::size_t i = 0; i < scratch_.state.size(); ++i)
      if (scratch_.state[i] == untouched) scratch_.kept.push_back(static_cast<int>(i));
    scratch_.arranged.clear();
    for (const int i : scratch_.kept) scratch_.arranged.push_back(touches_[begin_ + as_index(i)]);
    touches_.resize(begin_ + scratch_.kept.size());
    std::copy(scratch_.arranged.begin(), scratch_.arranged.end(),
              touches_.begin() + static_cast<std::ptrdiff_t>(begin_));
  }

  double tolerance_;
  std::size_t begin_;
  std::vector<NearPoint>& touches_;
  ReductionScratch& scratch_;
  std::size_t taken_ = 0;
  EvenLoad load_;  // on the facet that is looked at
};

}  // namespace

void reduce_contacts(double size, std::size_t begin, std::vector<NearPoint>& touches,
                     ReductionScratch& scratch) {
  if (touches.size() - begin >= min_touches) Reduction(size, begin, touches, scratch).run();
}

void add_to_patches(double size, std::size_t begin, std::vector<NearPoint>& touches,
                    const ReductionScratch& scratch) {
  for (const ContactPatch& patch : scratch.patches) {
    const Vec3* corner = scratch.hull_corners.data() + patch.first_corner;
    const Vec3 across = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    for (std::size_t i = begin; i < touches.size(); ++i) {
      NearPoint& touch = touches[i];
      if ((!touch.feature.is_support() && touch.plane_index < 0) || touch.patch >= 0 ||
          touch.reversed != patch.reversed)
        continue;
      if ((touch.normal - patch.normal).norm() > same_plane ||
          std::abs(across.dot(touch.position - corner[0])) > same_plane * size)
        continue;
      touch.patch = patch.number;
      touch.share = min_share;
    }
  }
}

// Returns whether `x` (m) lies above the convex polygon with the given corners, as seen along its normal, to
// within `tolerance` (m).
bool is_above(std::span<const Vec3> corners, const Vec3& normal, const Vec3& x, double tolerance) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 edge = corners[(i + 1) % corners.size()] - corners[i];
    if (normal.dot(edge.cross(x - corners[i])) < -tolerance * edge.norm()) return false;
  }
  return true;
}

void join_patches(double size, const Pose& guest_in_host, std::size_t begin, std::vector<NearPoint>& touches,
                  ReductionScratch& scratch) {
  // If two patches are equally wide but for rounding, the same one has to count in every step: the area of
  // reversed ones is multiplied by this, which any fraction well below 1 would do.
  constexpr double of_reversed = 0.9;
  const auto width = [](const ContactPatch& patch) {
    return patch.reversed ? of_reversed * patch.area : patch.area;
  };
  std::sort(scratch.patches.begin(), scratch.patches.end(),
            [&](const ContactPatch& a, const ContactPatch& b) {
              return std::make_tuple(-width(a), a.number) < std::make_tuple(-width(b), b.number);
            });
  for (ContactPatch& patch : scratch.patches) {
    const std::span<const Vec3> corners(scratch.hull_corners.data() + patch.first_corner, patch.corners);
    // Support points stay in any case, so that they alone do not make a patch: they would drop the other
    // body's touches, which have dropped theirs.
    bool is_left = false;
    for (std::size_t i = begin; i < touches.size(); ++i)
      is_left |= touches[i].patch == patch.number && !touches[i].feature.is_support();
    if (!is_left) continue;
    const auto is_beneath = [&](NearPoint& touch) {
      if (touch.reversed == patch.reversed || touch.feature.is_support()) return false;
      const Quat& turn = guest_in_host.orientation;
      const Vec3 x =
          patch.reversed ? guest_in_host.to_body(touch.position) : guest_in_host.to_world(touch.position);
      const Vec3 opposite =
          patch.reversed ? Vec3(turn.conjugate() * touch.normal) : Vec3(turn * touch.normal);
      if (std::abs(patch.normal.dot(x - patch.foot)) > same_plane * size ||
          opposite.dot(patch.normal) > -lies_level)
        return false;
      if (is_above(corners, patch.normal, x, same_plane * size)) return true;
      const bool is_parallel = (opposite + patch.normal).norm() <= same_plane;
      touch.patch = is_parallel ? patch.number : -1;
      touch.share = is_parallel ? min_share : 0;
      return false;
    };
    touches.erase(
        std::remove_if(touches.begin() + static_cast<std::ptrdiff_t>(begin), touches.end(), is_beneath),
        touches.end());
  }
}

}  // namespace duet
