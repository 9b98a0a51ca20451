// How deep two bodies of any kind lie in each other, looked at on their surfaces, also where one of them is
// moved as a whole.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/geometry/level_set/mesh_distance.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

/// Bodies are numbered as in guest_node: rigid ones first, then deformable ones. All of them are looked at
/// where they stand when the probe is made.
class OverlapProbe {
 public:
  /// `rigid_surfaces` are those of the rigid bodies in body space, as they are drawn; bodies beyond their
  /// number (the ground) have none.
  OverlapProbe(const Bodies& bodies, std::vector<const Surface*> rigid_surfaces);

  /// The place of the surface of one of two bodies that lies deepest in the other one.
  struct Deepest {
    double depth = 0;           ///< m, of the surface and what is around it; 0: apart
    Vec3 place = Vec3::Zero();  ///< m, in world space, where the first body stands
    Vec3 way = Vec3::Zero();    ///< unit, in which the second body leaves the first one there
  };
  /// Looks at the bodies `a` and `b` with b moved by `shift` (m) against a. The depth is found to the part
  /// `slack` of it, and to the distance between the places that are looked at, a 50th of the thinner body or
  /// a 100th of the smaller one. Overlaps below least_depth() count as none.
  Deepest deepest(int a, int b, const Vec3& shift, double slack) {
    return deepest(a, b, shift, slack, clearance(a, b));
  }
  /// The same of the way to where repulsions have nothing to part: those of two deformable bodies act within
  /// their collision thickness.
  Deepest deepest_to_rest(int a, int b, const Vec3& shift, double slack) {
    return deepest(a, b, shift, slack, rest_distance(a, b));
  }
  /// Shallower overlaps (m) of the two are left to contact: 1e-4 of the thinner body, or 1e-5 where both are
  /// deformable.
  double least_depth(int a, int b) const {
    return (both_deformable(a, b) ? rounding_of_deformable : rounding) * thinner(a, b);
  }

  /// Deformable bodies may not even touch at the start: those nearer than this (m) are looked at as if they
  /// overlapped. Zero where one of the two is rigid.
  double clearance(int a, int b) const { return both_deformable(a, b) ? 2 * least_depth(a, b) : 0; }
  /// Half the thickness of thin ones of two deformable bodies, which is no part of Deepest::depth, m.
  double thickness_between(int a, int b) const;

  /// Whether the boxes around the two meet, with b moved by `shift` (m) against a.
  bool boxes_meet(int a, int b, const Vec3& shift) const { return boxes_meet(a, b, shift, clearance(a, b)); }
  /// Directions that are worth a try to part the two: axes and diagonals of either body and of the world, and
  /// the line of their centers. Unit vectors, in which b leaves a.
  std::vector<Vec3> directions(int a, int b, const Vec3& shift) const;

 private:
  // Of the thinner body: what places in a file, rounded to some digits, let bodies overlap by is left to
  // contact. Deformable bodies may not cross at all.
  static constexpr double rounding = 1e-4, rounding_of_deformable = 1e-5;

  struct Body {
    bool is_ready = false;
    std::vector<std::array<Vec3, 3>> pieces;  // m; those of curves and points are flat triangles
    double around = 0;                        // m, how far the body reaches beyond them
    const LevelSet* level_set = nullptr;      // what tells inside from outside: of a rigid body,
    std::unique_ptr<MeshDistance> mesh;       // of a deformable volume; thin bodies have no inside
    bool has_inside() const { return level_set || mesh; }
  };
  struct Search {
    const Body* host = nullptr;
    int number = 0;     // of the host
    double around = 0;  // m, around the guest's pieces
    double least = 0, spacing = 0, slack = 0;
    double depth = 0;
    Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
  };

  bool both_deformable(int a, int b) const { return as_index(std::min(a, b)) >= bodies_.rigid.size(); }
  double rest_distance(int a, int b) const;
  Deepest deepest(int a, int b, const Vec3& shift, double slack, double clearance);
  bool boxes_meet(int a, int b, const Vec3& shift, double gap) const;
  double thinner(int a, int b) const;
  double spacing(int a, int b) const;
  const Body& prepared(int body);
  void prepare_rigid(std::size_t body, Body& made) const;
  void prepare_deformable(const DeformableBody& body, Body& made) const;
  double least_distance(const Search& search, const Vec3& x) const;
  SignedDistance exact(const Search& search, const Vec3& x) const;
  void look_at(const Vec3& x, double nearest, Search& search) const;
  void look_at(const Vec3& a, const Vec3& b, const Vec3& c, Search& search) const;
  Search search_in(int host, int guest, const Vec3& shift, double slack, double clearance, double depth);

  const Bodies& bodies_;
  std::vector<const Surface*> rigid_surfaces_;
  std::vector<BodyBounds> bounds_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<double> thickness_;  // m, of the thinnest extent
  std::vector<Body> bodies_seen_;
};

}  // namespace duet
