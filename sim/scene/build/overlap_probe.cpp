#include "sim/scene/build/overlap_probe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/base/elementary.h"
#include "sim/deformable/self_contact/collision_candidates.h"

namespace duet {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
// Spacing of the points at which overlaps are measured: the larger of `of_thickness` times the thinner body's
// thickness and `of_extent` times the smaller body's diagonal. Larger values are faster and miss more.
constexpr double of_thickness = 0.02, of_extent = 0.01;
// Points inside bodies at which overlaps are measured: tetrahedra of a deformable body at most, and points
// along each axis of a rigid body's box. Larger values are slower and find the deepest point more exactly.
constexpr int max_inner_tets = 200, inner_samples = 5;
// Segments of the center line of a torus. They are off the circle by 1.2e-6 of its radius, which counts as
// touching.
constexpr int circle_pieces = 2048;

// Returns whether the body has a closed boundary that is its contact surface.
bool is_volume(const Bodies& bodies, const DeformableBody& body) {
  return body.triangle_count > 0 && body.thickness == 0 && !touches_with_skin(bodies, body);
}

}  // namespace

OverlapProbe::OverlapProbe(const Bodies& bodies, std::vector<const Surface*> rigid_surfaces)
    : bodies_(bodies), rigid_surfaces_(std::move(rigid_surfaces)) {
  bound_bodies(bodies, bounds_);
  bodies_seen_.resize(bounds_.size());
  const std::size_t rigid_count = bodies.rigid.size();
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    boxes_.push_back(bounds_[i].is_half_space ? Eigen::AlignedBox3d() : world_box(bounds_[i], 0));
    const double extent = bounds_[i].is_half_space ? infinity : boxes_[i].sizes().minCoeff();
    thickness_.push_back(i < rigid_count ? bodies.rigid.properties[i].shape.min_size() : extent);
  }
}

double OverlapProbe::thinner(int a, int b) const {
  return std::min(thickness_[as_index(a)], thickness_[as_index(b)]);
}

double OverlapProbe::spacing(int a, int b) const {
  double extent = infinity;
  for (const int body : {a, b})
    if (!bounds_[as_index(body)].is_half_space)
      extent = std::min(extent, boxes_[as_index(body)].diagonal().norm());
  return std::max(of_thickness * thinner(a, b), of_extent * extent);
}

bool OverlapProbe::boxes_meet(int a, int b, const Vec3& shift, double gap) const {
  const BodyBounds &first = bounds_[as_index(a)], &second = bounds_[as_index(b)];
  if (first.is_half_space && second.is_half_space) return false;
  if (first.is_half_space || second.is_half_space) {
    BodyBounds moved = second;
    moved.center += shift;
    return separation(first, moved) < 0;
  }
  Eigen::AlignedBox3d moved = boxes_[as_index(b)];
  moved.translate(shift);
  return boxes_[as_index(a)].squaredExteriorDistance(moved) <= gap * gap;
}

std::vector<Vec3> OverlapProbe::directions(int a, int b, const Vec3& shift) const {
  const BodyBounds &first = bounds_[as_index(a)], &second = bounds_[as_index(b)];
  if (first.is_half_space) return {first.axes.col(1)};
  if (second.is_half_space) return {-second.axes.col(1)};
  std::vector<Vec3> found;
  const Vec3 across = second.center + shift - first.center;
  if (across.norm() > 0) found.emplace_back(across.normalized());
  const Mat3 world = Mat3::Identity();
  constexpr double same = 1 - 1e-12;  // cosine of the angle between directions that differ by rounding
  for (const Mat3* axes : {&first.axes, &second.axes, &world})
    for (int i = 0; i < 27; ++i) {
      const Vec3 direction = *axes * Vec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const auto is_known = [&](const Vec3& known) { return known.dot(direction.normalized()) > same; };
      if (!direction.isZero(0) && std::none_of(found.begin(), found.end(), is_known))
        found.emplace_back(direction.normalized());
    }
  return found;
}

const OverlapProbe::Body& OverlapProbe::prepared(int body) {
  const auto i = as_index(body);
  Body& made = bodies_seen_[i];
  if (made.is_ready) return made;
  made.is_ready = true;
  if (i < bodies_.rigid.size())
    prepare_rigid(i, made);
  else
    prepare_deformable(bodies_.deformable[i - bodies_.rigid.size()], made);
  return made;
}

// Fills `made` for a rigid body. A ball, capsule or torus is a point, a segment or a circle with a radius
// around it; other shapes have their drawn surface.
void OverlapProbe::prepare_rigid(std::size_t body, Body& made) const {
  const LevelSet& shape = bodies_.rigid.properties[body].shape;
  const Pose pose = shape_pose(bodies_.rigid, body);
  made.level_set = &shape;
  if (shape.kind == LevelSet::Kind::sphere || shape.kind == LevelSet::Kind::capsule) {
    const double half = shape.kind == LevelSet::Kind::capsule ? shape.half_length : 0;
    const Vec3 a = pose.to_world(Vec3(0, -half, 0)), b = pose.to_world(Vec3(0, half, 0));
    made.pieces.push_back({a, b, b});
    made.around = shape.radius;
    return;
  }
  if (shape.kind == LevelSet::Kind::torus) {
    const auto place = [&](int i) {
      const double angle = 2 * std::numbers::pi * i / circle_pieces;
      return pose.to_world(shape.radius * Vec3(math::sin(angle), 0, math::cos(angle)));
    };
    for (int i = 0; i < circle_pieces; ++i) made.pieces.push_back({place(i), place(i + 1), place(i + 1)});
    made.around = shape.tube;
    return;
  }
  if (body >= rigid_surfaces_.size()) return;
  const Surface& surface = *rigid_surfaces_[body];
  made.pieces.reserve(surface.triangles.size());
  for (const auto& triangle : surface.triangles) {
    std::array<Vec3, 3> piece;
    for (std::size_t k = 0; k < 3; ++k)
      piece[k] = pose.to_world(surface.positions[as_index(triangle[k].position)]);
    made.pieces.push_back(piece);
  }
  const Vec3 lower = shape.lower(), extent = shape.upper() - lower;
  for (int i = 0; i < inner_samples * inner_samples * inner_samples; ++i) {
    const Vec3 at(i % inner_samples, i / inner_samples % inner_samples, i / inner_samples / inner_samples);
    const Vec3 x = lower + ((at.array() + 0.5) / inner_samples * extent.array()).matrix();
    if (shape.distance(x) < 0) made.inside.push_back(pose.to_world(x));
  }
}

// Fills `made` for a deformable body: its vertices if it touches with a skin, else its triangles and
// segments, or its only particle. Volumes also get a signed distance.
void OverlapProbe::prepare_deformable(const DeformableBody& body, Body& made) const {
  const std::vector<Vec3>& x = bodies_.particles.x;
  made.around = body.thickness / 2;
  if (touches_with_skin(bodies_, body)) {
    for (int i = body.first_point; i < body.first_point + body.point_count; ++i) {
      const Vec3 at = weighted(bodies_.points[as_index(i)], x);
      made.pieces.push_back({at, at, at});
    }
    return;
  }
  for (int t = body.first_triangle; t < body.first_triangle + body.triangle_count; ++t) {
    const Triangle& triangle = bodies_.triangles[as_index(t)];
    made.pieces.push_back({x[as_index(triangle[0])], x[as_index(triangle[1])], x[as_index(triangle[2])]});
  }
  for (int s = body.first_segment; s < body.first_segment + body.segment_count; ++s) {
    const auto& segment = bodies_.segments[as_index(s)];
    const Vec3 &a = x[as_index(segment[0])], &b = x[as_index(segment[1])];
    made.pieces.push_back({a, b, b});
  }
  if (made.pieces.empty()) {  // a single particle
    const Vec3& at = x[as_index(body.first_particle)];
    made.pieces.push_back({at, at, at});
  }
  if (!is_volume(bodies_, body)) return;
  TriangleMesh mesh;
  mesh.positions.assign(x.begin() + body.first_particle,
                        x.begin() + body.first_particle + body.particle_count);
  for (int t = body.first_triangle; t < body.first_triangle + body.triangle_count; ++t) {
    Triangle triangle = bodies_.triangles[as_index(t)];
    for (int& corner : triangle) corner -= body.first_particle;
    mesh.triangles.push_back(triangle);
  }
  made.mesh = std::make_unique<MeshDistance>(mesh);
  sample_inside(body, made);
}

// Adds points inside a volume: the middle of its bounding box, and in each of some tetrahedra the center and
// the middle of the longest edge, which is the center of a cell of a lattice. A wall that is one cell thick
// thus has points in its middle.
void OverlapProbe::sample_inside(const DeformableBody& body, Body& made) const {
  const std::vector<Vec3>& x = bodies_.particles.x;
  Eigen::AlignedBox3d box;
  for_each_particle(body, [&](std::size_t p) { box.extend(x[p]); });
  if (made.mesh->at(box.center()).distance < 0) made.inside.push_back(box.center());
  const int stride = (body.tet_count + max_inner_tets - 1) / max_inner_tets;
  for (int t = body.first_tet; t < body.first_tet + body.tet_count; t += stride) {
    const Tet& tet = bodies_.tets[as_index(t)];
    Vec3 sum = Vec3::Zero(), middle = Vec3::Zero();
    double longest = 0;  // m^2
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3& a = x[as_index(tet[i])];
      sum += a;
      for (std::size_t j = i + 1; j < 4; ++j) {
        const Vec3& b = x[as_index(tet[j])];
        if ((b - a).squaredNorm() <= longest) continue;
        longest = (b - a).squaredNorm();
        middle = (a + b) / 2;
      }
    }
    made.inside.emplace_back(sum / 4);
    made.inside.push_back(middle);
  }
}

// Returns the diameter (m) of the largest ball found inside the body; 0 for a thin deformable body.
double OverlapProbe::inner_thickness(int body) {
  if (as_index(body) < bodies_.rigid.size()) return thickness_[as_index(body)];
  const Body& made = prepared(body);
  double deepest = 0;
  for (const Vec3& x : made.inside) deepest = std::max(deepest, -made.mesh->at(x).distance);
  return 2 * deepest;
}

double OverlapProbe::crossed_fraction(int a, int b, double depth) {
  const bool both = both_deformable(a, b);
  const int host = both ? (inner_thickness(a) > inner_thickness(b) ? a : b) : std::min(a, b);
  const double thickness = inner_thickness(host);
  const double around = both ? clearance(a, b) : prepared(std::max(a, b)).around;
  return thickness > 0 ? std::max(0.0, depth - around) / thickness : 0;
}

// Returns the distance (m) at which repulsions between two deformable bodies end: `repulsion_range` times the
// mean of their collision thicknesses (CollisionBody::thickness), plus the clearance; 0 if one body is rigid.
double OverlapProbe::rest_distance(int a, int b) const {
  if (!both_deformable(a, b)) return 0;
  const std::vector<CollisionBody>& collision = bodies_.collision_surface.bodies;
  const auto thickness = [&](int body) {
    const std::size_t deformable = as_index(body) - bodies_.rigid.size();
    return deformable < collision.size() ? collision[deformable].thickness : 0.0;
  };
  return repulsion_range * (thickness(a) + thickness(b)) / 2 + clearance(a, b);
}

double OverlapProbe::thickness_between(int a, int b) const {
  if (!both_deformable(a, b)) return 0;
  const auto thickness = [&](int body) {
    return bodies_.deformable[as_index(body) - bodies_.rigid.size()].thickness;
  };
  return (thickness(a) + thickness(b)) / 2;
}

// Returns a lower bound of the distance (m) of `x` (m, world space with the host at its position) from the
// host.
double OverlapProbe::min_distance(const Search& search, const Vec3& x) const {
  const auto host = as_index(search.number);
  const double outside = bounds_[host].is_half_space ? 0 : boxes_[host].exteriorDistance(x);
  if (outside > 0) return outside;
  if (!search.host->level_set) return search.host->mesh->at(x).distance;
  const LevelSet& shape = *search.host->level_set;
  return shape.distance(shape_pose(bodies_.rigid, host).to_body(x)) - shape.tolerance();
}

// Returns the exact signed distance of `x` from the host, with the normal in world axes.
SignedDistance OverlapProbe::exact(const Search& search, const Vec3& x) const {
  if (!search.host->level_set) return search.host->mesh->at(x);
  const Pose pose = shape_pose(bodies_.rigid, as_index(search.number));
  SignedDistance found = search.host->level_set->exact(pose.to_body(x));
  found.normal = pose.orientation * found.normal;
  return found;
}

// Updates the search by the point `x`. `nearest` is a lower bound of its distance.
void OverlapProbe::look_at(const Vec3& x, double nearest, Search& search) const {
  const double known = std::max(search.depth, search.least);
  if (search.around - nearest <= known) return;
  const SignedDistance found = exact(search, x);
  if (search.around - found.distance <= known) return;
  search.depth = search.around - found.distance;
  search.place = x;
  search.normal = found.normal;
}

// Updates the search by a triangle. Halves it along its longest edge until its edges are no longer than the
// spacing. A part is skipped if none of its points can be deeper than the deepest one known by more than the
// slack: a signed distance changes by no more than the length of the displacement.
void OverlapProbe::look_at(const Vec3& a, const Vec3& b, const Vec3& c, Search& search) const {
  if (std::max(search.depth, search.inside) >= search.enough) return;
  const Vec3 middle = (a + b + c) / 3;
  const double radius = std::max({(a - middle).norm(), (b - middle).norm(), (c - middle).norm()});
  const double nearest = min_distance(search, middle);
  const double known = std::max({(1 + search.slack) * search.depth, search.least, search.inside});
  if (search.around - nearest + radius <= known) return;
  look_at(middle, nearest, search);
  const double ab = (b - a).norm(), bc = (c - b).norm(), ca = (a - c).norm();
  const double longest = std::max({ab, bc, ca});
  if (longest <= search.spacing) {
    for (const Vec3* corner : {&a, &b, &c})
      if (longest > 0) look_at(*corner, min_distance(search, *corner), search);
  } else if (ab >= bc && ab >= ca) {
    look_at(a, (a + b) / 2, c, search);
    look_at((a + b) / 2, b, c, search);
  } else {
    look_at(b, c, a, search);
  }
}

// Returns the search with the deepest of the points `inside` the guest as its point.
OverlapProbe::Search OverlapProbe::look_inside(const std::vector<Vec3>& inside, const Vec3& shift,
                                               Search search) const {
  for (const Vec3& x : inside) look_at(x + shift, min_distance(search, x + shift), search);
  search.inside = search.depth;
  return search;
}

// Searches the deepest point of the guest, displaced by `shift`, in the host, or a point inside the guest if
// that is deeper. `search` gives the slack, and what is `enough`; only points deeper than its depth count.
// `clearance` (m) is the radius around the pieces of two deformable bodies.
OverlapProbe::Search OverlapProbe::search_in(int host, int guest, const Vec3& shift, double clearance,
                                             Search search) {
  const Body& looks = prepared(guest);
  search.host = &prepared(host);
  if (!search.host->has_inside()) return search;
  search.number = host;
  search.around = both_deformable(guest, host) ? clearance : looks.around;
  search.least = min_depth(host, guest);
  search.spacing = spacing(host, guest);
  const Search inner = look_inside(looks.inside, shift, search);
  search.inside = inner.inside;
  for (const auto& piece : looks.pieces)
    look_at(piece[0] + shift, piece[1] + shift, piece[2] + shift, search);
  return inner.depth > search.depth ? inner : search;
}

OverlapProbe::Deepest OverlapProbe::deepest(int a, int b, const Vec3& shift, double slack, double clearance,
                                            double enough) {
  Deepest found;
  if (!boxes_meet(a, b, shift, clearance)) return found;
  Search search;
  search.slack = slack;
  search.enough = enough;
  const Search second_in_first = search_in(a, b, shift, clearance, search);
  if (second_in_first.depth > 0)
    found = {second_in_first.depth, second_in_first.place, second_in_first.normal};
  search.depth = found.depth;
  const Search first_in_second = search_in(b, a, -shift, clearance, search);
  if (first_in_second.depth > found.depth)
    found = {first_in_second.depth, first_in_second.place + shift, -first_in_second.normal};
  return found;
}

}  // namespace duet
