// Measures how deep two bodies of any kind overlap, by points on their surfaces, also with one of them
// displaced as a whole.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/geometry/level_set/mesh_distance.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

/// Measures overlaps of the bodies at the positions that they have when the probe is made; they must not move
/// while it is in use. Bodies are numbered as in guest_node: rigid ones first, then deformable ones.
class OverlapProbe {
 public:
  /// `rigid_surfaces` are the drawn surfaces of the rigid bodies in shape space; bodies beyond their number
  /// (the ground) have none. `bodies` must outlive the probe.
  OverlapProbe(const Bodies& bodies, std::vector<const Surface*> rigid_surfaces);

  /// The point of two bodies that lies deepest in the other body. It is a point of a surface, unless the
  /// bodies overlap so far that points inside one of them lie deeper in the other.
  struct Deepest {
    double depth = 0;           ///< Depth, m, with the radius around the surface included; 0: apart.
    Vec3 place = Vec3::Zero();  ///< The point, m, world space, with the first body at its position.
    Vec3 way = Vec3::Zero();    ///< Unit direction in which the second body leaves the first one.
  };
  /// Returns the deepest overlap of the bodies `a` and `b` with b displaced by `shift` (m) against a. The
  /// depth is found to within the fraction `slack` of it, and to the spacing of the points: the larger of a
  /// 50th of the thinner body's thickness and a 100th of the smaller body's diagonal. Overlaps below
  /// min_depth() count as none.
  Deepest deepest(int a, int b, const Vec3& shift, double slack) {
    return deepest(a, b, shift, slack, clearance(a, b), no_limit);
  }
  /// Returns the deepest overlap as deepest() does, but for two deformable bodies measured to the distance at
  /// which repulsions between them end: these act within their collision thickness. The search ends at the
  /// first point that is at least `enough` (m) deep.
  Deepest deepest_to_rest(int a, int b, const Vec3& shift, double slack, double enough = no_limit) {
    return deepest(a, b, shift, slack, rest_distance(a, b), enough);
  }
  /// Returns the depth (m) below which overlaps of the two are left to contact: 1e-4 of the thinner body's
  /// thickness, or 1e-5 of it if both are deformable.
  double min_depth(int a, int b) const {
    return (both_deformable(a, b) ? rounding_of_deformable : rounding) * thinner(a, b);
  }

  /// Returns the distance (m) below which two deformable bodies count as overlapping, because they may not
  /// even touch at the start. It is 0 if one of the two is rigid.
  double clearance(int a, int b) const { return both_deformable(a, b) ? 2 * min_depth(a, b) : 0; }
  /// Returns the mean thickness (m) of two deformable bodies, which Deepest::depth does not include. It is 0
  /// if one of the two is rigid.
  double thickness_between(int a, int b) const;

  /// Returns whether neither of the two is deformable.
  bool both_rigid(int a, int b) const { return as_index(std::max(a, b)) < bodies_.rigid.size(); }
  /// Returns the distance (m) at which repulsions between two deformable bodies end, see deepest_to_rest().
  /// It is 0 if one of the two is rigid.
  double rest_distance(int a, int b) const;
  /// Returns the thickness (m) of the thinner of the two bodies: the diameter of the largest ball inside a
  /// rigid body, the smallest extent of a deformable one.
  double thinner(int a, int b) const;
  /// Returns how far (m) a surface crosses the other body at an overlap of `depth` (m), over the diameter of
  /// the largest ball inside that body: half of it at the middle of that body. For two deformable bodies it
  /// is the thicker body that counts. Thin bodies count with their middle surfaces. Zero if both are thin.
  double crossed_fraction(int a, int b, double depth);

  /// Returns whether the bounding boxes of the two meet, with b displaced by `shift` (m) against a.
  bool boxes_meet(int a, int b, const Vec3& shift) const { return boxes_meet(a, b, shift, clearance(a, b)); }
  /// Returns unit directions in which b may leave a: axes and diagonals of either body and of the world, and
  /// the line of their centers. If one of the two is the ground, it is the ground's normal alone.
  std::vector<Vec3> directions(int a, int b, const Vec3& shift) const;

 private:
  static constexpr double no_limit = std::numeric_limits<double>::infinity();
  // Depths that are left to contact, as fractions of the thinner body's thickness: positions in a file are
  // rounded to some digits, so that bodies that are meant to touch overlap a little. For two deformable
  // bodies the value is smaller, as they may not cross at all. Larger values leave deeper overlaps to
  // contact.
  static constexpr double rounding = 1e-4, rounding_of_deformable = 1e-5;

  // A body prepared for searches.
  struct Body {
    bool is_ready = false;                    // true once the other members are filled
    std::vector<std::array<Vec3, 3>> pieces;  // m, world space; those of curves and points are degenerate
    double around = 0;                        // m, radius by which the body extends beyond the pieces
    std::vector<Vec3> inside;                 // m, world space: points inside a body that has a volume
    const LevelSet* level_set = nullptr;      // signed distance of a rigid body, else null
    std::unique_ptr<MeshDistance> mesh;       // signed distance of a deformable volume, else null
    bool has_inside() const { return level_set || mesh; }
  };
  // The state of a search for the deepest point of a guest's pieces in a host.
  struct Search {
    const Body* host = nullptr;                        // body whose inside is searched
    int number = 0;                                    // its number
    double around = 0;                                 // m, radius around the guest's pieces
    double least = 0, spacing = 0, slack = 0;          // m, m, 1; see deepest()
    double enough = no_limit;                          // m; see deepest_to_rest()
    double depth = 0;                                  // m, largest depth found so far
    Vec3 place = Vec3::Zero(), normal = Vec3::Zero();  // m, the point there and the host's outward normal
    double inside = 0;  // m, depth of the deepest point inside the guest, if it is positive
  };

  bool both_deformable(int a, int b) const { return as_index(std::min(a, b)) >= bodies_.rigid.size(); }
  Deepest deepest(int a, int b, const Vec3& shift, double slack, double clearance, double enough);
  bool boxes_meet(int a, int b, const Vec3& shift, double gap) const;
  double spacing(int a, int b) const;
  const Body& prepared(int body);
  void prepare_rigid(std::size_t body, Body& made) const;
  void prepare_deformable(const DeformableBody& body, Body& made) const;
  void sample_inside(const DeformableBody& body, Body& made) const;
  double inner_thickness(int body);
  double min_distance(const Search& search, const Vec3& x) const;
  SignedDistance exact(const Search& search, const Vec3& x) const;
  void look_at(const Vec3& x, double nearest, Search& search) const;
  void look_at(const Vec3& a, const Vec3& b, const Vec3& c, Search& search) const;
  Search look_inside(const std::vector<Vec3>& inside, const Vec3& shift, Search search) const;
  Search search_in(int host, int guest, const Vec3& shift, double clearance, Search search);

  const Bodies& bodies_;
  std::vector<const Surface*> rigid_surfaces_;
  std::vector<BodyBounds> bounds_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<double> thickness_;  // m, of every body: its largest inner ball, or its smallest extent
  std::vector<Body> bodies_seen_;  // of every body, filled at its first use
};

}  // namespace duet
