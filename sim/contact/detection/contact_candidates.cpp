#include "sim/contact/detection/contact_candidates.h"

#include <algorithm>
#include <cmath>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_reduction.h"
#include "sim/contact/detection/faces_around.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/friction_fade.h"
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/detection/line_contact.h"
#include "sim/contact/detection/near_visits.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/contact/detection/support_face_contacts.h"

namespace duet {
namespace {

// Smallest size (m) of bodies whose contacts have the full tolerances of the solvers. These are absolute
// speeds and lengths; below this size they shrink in proportion to the body. A larger value makes solves of
// small bodies more precise and longer.
constexpr double min_size = 0.05;
constexpr std::size_t pairs_at_once = 16;  // for each task of a parallel loop

// Part of the speculative margin for bodies at rest that other contacts push, relative to the size of the
// smaller body of a pair. Doubled, it finds more points that are not reached; halved, it misses more points
// that are pushed onto a body.
constexpr double rest_margin = 1e-3;

// 1.5 dt v: the part of the speculative margin (m) for the speed v (m/s). It is the motion over the step,
// with room for the velocity that other contacts add to it.
double reach(double speed, double dt) { return 1.5 * dt * speed; }

// Returns `rest_margin` times the radius of a body's box, m. It is zero for half spaces, so that the larger
// one of a pair is that of the other body.
double margin_at_rest(const BodyBounds& body) {
  return body.is_half_space ? 0 : rest_margin * (body.half.norm() + body.radius);
}

// Returns the part of the speculative margin for two bodies at rest, m.
double margin_at_rest(const BodyBounds& a, const BodyBounds& b) {
  if (a.is_half_space || b.is_half_space) return margin_at_rest(a) + margin_at_rest(b);
  return std::min(margin_at_rest(a), margin_at_rest(b));
}

// Returns the greatest length of the values of a body's particles.
double max_norm(const std::vector<Vec3>& values, const DeformableBody& body) {
  double squared = 0;
  for (int p = body.first_particle; p < body.first_particle + body.particle_count; ++p)
    squared = std::max(squared, values[as_index(p)].squaredNorm());
  return std::sqrt(squared);
}

// One search for all contact candidates, see find_candidates().
class Finder {
 public:
  Finder(const Bodies& bodies, const CandidateFilter& filter, double dt, const VelocityState& difference,
         ContactSet& contacts)
      : bodies_(bodies),
        filter_(filter),
        dt_(dt),
        difference_(difference),
        contacts_(contacts),
        search_(contacts.search) {}

  void find() {
    const std::vector<BodyPair>& pairs = find_pairs();
    place_points(bodies_, pairs, search_);
    const std::size_t count = (pairs.size() + pairs_at_once - 1) / pairs_at_once;
    if (search_.chunks.size() < count) search_.chunks.resize(count);
    parallel_for(pairs.size(), pairs_at_once, [&](std::size_t begin, std::size_t end) {
      CandidateSearch::Chunk& chunk = search_.chunks[begin / pairs_at_once];
      chunk.pairs.clear();
      chunk.touches.clear();
      chunk.planes.clear();
      for (std::size_t i = begin; i < end; ++i) find_touches(pairs[i], chunk);
      // Room for twice as many is reserved, so that storage stops growing once a scene has warmed up.
      if (chunk.touches.capacity() < 2 * chunk.touches.size())
        chunk.touches.reserve(2 * chunk.touches.size());
      chunk.pairs.reserve(pairs_at_once);
    });
    make_room(count);
    parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) fill(search_.chunks[c]);
    });
  }

 private:
  // Returns the pairs of bodies that are near each other. The margin of each body is that for its own speed
  // and size; the margins of two bodies add up to at least that of their pair, so no pair is missed.
  const std::vector<BodyPair>& find_pairs() {
    BroadPhase& broad_phase = search_.broad_phase;
    bound_bodies(bodies_, broad_phase.bounds);
    broad_phase.margin.resize(broad_phase.bounds.size());
    parallel_for(broad_phase.bounds.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        broad_phase.margin[i] = reach(fastest(broad_phase.bounds[i]) + max_change(static_cast<int>(i)), dt_) +
                                margin_at_rest(broad_phase.bounds[i]);
    });
    return broad_phase.find(filter_);
  }

  // Returns a bound on how much forces changed the velocities of the points of a body, m/s. `body` is an
  // index into BroadPhase::bounds.
  double max_change(int body) const {
    const std::size_t rigid_count = bodies_.rigid.size();
    return as_index(body) < rigid_count
               ? difference_.rigid[as_index(body)].norm() +
                     spin_change(as_index(body)) * search_.broad_phase.bounds[as_index(body)].arm
               : max_norm(difference_.particle, bodies_.deformable[as_index(body) - rigid_count]);
  }

  // Returns by how much the angular velocity of a rigid body changed since v^n, rad/s. It is zero for dynamic
  // bodies, because forces do not change their angular velocity before contact.
  double spin_change(std::size_t body) const {
    return search_.broad_phase.bounds[body].is_dynamic ? 0 : difference_.rotation[body].norm();
  }

  // Appends the touches of a pair of bodies to `chunk`, unless the pair never touches.
  void find_touches(const BodyPair& pair, CandidateSearch::Chunk& chunk) const {
    const int begin = static_cast<int>(chunk.touches.size());
    if (pair.guest_rigid >= 0 && is_excluded(bodies_, pair.host, pair.guest_rigid)) return;
    if (pair.guest_rigid < 0 && is_excluded_deformable(bodies_, pair.host, pair.guest_deformable)) return;
    if (pair.guest_rigid >= 0)
      find_rigid(pair, chunk);
    else
      find_deformable(pair, chunk);
    const int end = static_cast<int>(chunk.touches.size());
    if (end > begin) chunk.pairs.push_back({pair, begin, end});
  }

  // Appends the touches of two rigid bodies in both directions. A half space as host has no points of its
  // own, so that there is one direction.
  void find_rigid(const BodyPair& pair, CandidateSearch::Chunk& chunk) const {
    const std::size_t begin = chunk.touches.size();
    chunk.reduction.patches.clear();
    chunk.reduction.hull_corners.clear();
    find_points(pair, PairDirection::as_found, chunk);
    const BodyBounds& host = search_.broad_phase.bounds[as_index(pair.host)];
    if (!host.is_half_space) {
      find_points(reversed(pair), PairDirection::reversed, chunk);
      if (!chunk.reduction.patches.empty())
        join_patches(host.arm + search_.broad_phase.bounds[as_index(pair.guest_rigid)].arm,
                     in_host_of(bodies_.rigid, pair), begin, chunk.touches, chunk.reduction);
    }
    if (!filter_.reduce_contacts) return;
    add_lines(bodies_, pair, PairDirection::as_found, begin, chunk);
    if (!host.is_half_space) add_lines(bodies_, reversed(pair), PairDirection::reversed, begin, chunk);
  }

  // Appends the touches of the pair's guest with its host: first those of its support points, then of its
  // samples, then its edge contacts.
  void find_points(const BodyPair& pair, PairDirection direction, CandidateSearch::Chunk& chunk) const {
    const auto h = as_index(pair.host), g = as_index(pair.guest_rigid);
    const BodyBounds& host = search_.broad_phase.bounds[h];
    const BodyBounds& guest = search_.broad_phase.bounds[g];
    const double speed = (guest.velocity - host.velocity).norm() + guest.spin.norm() * guest.arm +
                         host.spin.norm() * host.arm + max_change(pair.guest_rigid) + max_change(pair.host);
    const double margin = reach(speed, dt_) + margin_at_rest(host, guest);
    if (separation(host, guest) > margin) return;
    const std::size_t begin = chunk.touches.size();
    find_faces(pair, direction, margin, chunk);
    const std::size_t faces = chunk.touches.size();
    const auto has_nearest_face = [&](int k) {
      return std::any_of(chunk.touches.begin() + static_cast<std::ptrdiff_t>(begin),
                         chunk.touches.begin() + static_cast<std::ptrdiff_t>(faces),
                         [&](const NearPoint& face) { return face.feature == FeatureId::support(k, 0); });
    };
    const Pose pose = shape_pose(bodies_.rigid, h);
    visit_near(bodies_.rigid, pair, margin, [&](NearPoint near, const Vec3& inside) {
      if (near.feature.is_support() && has_nearest_face(near.feature.index)) return;
      const ContactPlane plane =
          exposed_plane(bodies_, pair.host, pose, near.position, inside,
                        near.feature.is_support() ? PointKind::support : PointKind::fixed);
      // A support point over a hidden place has an infinite gap, but may come to be over the host within the
      // step.
      const bool is_faced = plane.faces && (near.feature.is_support() || std::isfinite(plane.gap));
      if (!is_faced && plane.gap >= 0 && !comes_under_face(pair, near, inside)) return;
      near.reversed = direction == PairDirection::reversed;
      near.normal = plane.normal;
      near.gap = plane.gap;
      chunk.touches.push_back(near);
    });
    spread_patches(pair, margin, begin, chunk.touches);
    leave_to_vertices(begin, chunk.touches);
    drop_repeated_vertices(begin, chunk.touches);
    std::size_t samples = begin;  // the first touch that may be dropped: support points stay
    while (samples < chunk.touches.size() && chunk.touches[samples].feature.is_support()) ++samples;
    if (filter_.reduce_contacts) reduce_contacts(guest.arm, samples, chunk.touches, chunk.reduction);
    find_faces_at_samples(pair, margin, begin, chunk);
    find_places(pair, direction, margin, chunk);
    if (filter_.reduce_contacts) add_to_patches(guest.arm, begin, chunk.touches, chunk.reduction);
  }

  // Returns whether a sample of the pair's guest that is beside its host comes under a face of the host in
  // the step, as an edge does over which a fast body falls, and is not level with it. `inside` is in the
  // host's shape space, m.
  bool comes_under_face(const BodyPair& pair, const NearPoint& near, const Vec3& inside) const {
    const auto h = as_index(pair.host), g = as_index(pair.guest_rigid);
    const Pose pose = shape_pose(bodies_.rigid, h);
    const Vec3 by_forces = difference_.rigid[g] - difference_.rigid[h];
    const auto moved = [&](const Vec3& y) -> Vec3 {
      const Vec3 x = pose.to_world(y);
      const auto velocity = [&](std::size_t b) {
        const RigidState& state = bodies_.rigid.state[b];
        return point_velocity(state, x - state.pose.position);
      };
      return y + dt_ * (pose.orientation.conjugate() * (velocity(g) - velocity(h) - by_forces));
    };
    const Vec3 end = moved(near.position);
    if ((end - near.position).norm() < near.gap) return false;
    const ContactPlane plane = exposed_plane(bodies_, pair.host, pose, end, moved(inside), PointKind::fixed);
    return plane.faces && plane.gap < -level_depth(bodies_, pair.host, pair.guest_rigid);
  }

  // Drops vertices among the touches from `begin` on that several patches have found, and those that are the
  // lowest of a patch as well.
  static void drop_repeated_vertices(std::size_t begin, std::vector<NearPoint>& touches) {
    std::size_t kept = begin;
    for (std::size_t i = begin; i < touches.size(); ++i) {
      const auto is_same = [&](const NearPoint& other) { return other.vertex == touches[i].vertex; };
      const auto at = [&](std::size_t k) { return touches.begin() + static_cast<std::ptrdiff_t>(k); };
      const bool is_repeated = touches[i].feature.kind == FeatureId::Kind::vertex &&
                               (std::any_of(at(begin), at(kept), is_same) ||
                                std::any_of(at(i + 1), touches.end(), [&](const NearPoint& other) {
                                  return is_same(other) && other.feature.kind == FeatureId::Kind::round;
                                }));
      if (!is_repeated) touches[kept++] = touches[i];
    }
    touches.resize(kept);
  }

  // Drops samples between the lowest vertices of round parts, if the guest rolls over its facets: as fixed
  // points they would bear the load of those vertices. Otherwise they help to bear it.
  static void leave_to_vertices(std::size_t begin, std::vector<NearPoint>& touches) {
    const auto first = touches.begin() + static_cast<std::ptrdiff_t>(begin);
    if (std::any_of(first, touches.end(),
                    [](const NearPoint& near) { return near.feature.kind == FeatureId::Kind::round; }))
      touches.erase(
          std::remove_if(first, touches.end(), [](const NearPoint& near) { return near.is_between_lowest; }),
          touches.end());
  }

  // Returns whether a guest rolls over the facets around a vertex of its round surface that touches, with the
  // unit normal `normal` (host's shape space): with its angular velocity w_t along the host's surface, the
  // length l of the shortest edge, the arm r of the vertex and the acceleration a by forces,
  //   (|w_t| r)^2 > (l / 2)^2 a / r.
  // Slower bodies do not get over the next vertex. They rock, and come to rest on a facet.
  bool rolls_over_facets(const BodyPair& pair, const Vec3& normal, int vertex) const {
    const auto h = as_index(pair.host), g = as_index(pair.guest_rigid);
    const RoundSurface& round = *bodies_.rigid.properties[g].round;
    const auto v = as_index(vertex);
    double squared = std::numeric_limits<double>::infinity();
    for (int i = round.first[v]; i < round.first[v + 1]; ++i)
      squared = std::min(
          squared,
          (round.vertices[as_index(round.neighbors[as_index(i)])] - round.vertices[v]).squaredNorm());
    const Vec3 n = shape_pose(bodies_.rigid, h).orientation * normal,
               spin = bodies_.rigid.state[g].angular_velocity - bodies_.rigid.state[h].angular_velocity;
    const double r = round.vertices[v].norm(),
                 a = 2 / dt_ * (difference_.rigid[g] - difference_.rigid[h]).norm();
    return (spin - spin.dot(n) * n).squaredNorm() * r * r * r > squared / 4 * a;
  }

  // Lets bodies that do not roll over their facets touch with all vertices around the lowest ones, instead of
  // with the lowest one wherever it goes.
  void spread_patches(const BodyPair& pair, double margin, std::size_t begin,
                      std::vector<NearPoint>& touches) const {
    const RigidProperties& guest = bodies_.rigid.properties[as_index(pair.guest_rigid)];
    if (!guest.round) return;
    const RoundSurface& round = *guest.round;
    const Pose in_host = in_host_of(bodies_.rigid, pair),
               pose = shape_pose(bodies_.rigid, as_index(pair.host));
    const std::size_t end = touches.size();
    for (std::size_t i = begin; i < end; ++i) {
      const NearPoint lowest = touches[i];
      if (lowest.feature.kind != FeatureId::Kind::round ||
          rolls_over_facets(pair, lowest.normal, lowest.vertex))
        continue;
      touches[i].feature = {FeatureId::Kind::vertex, lowest.vertex, -1};
      const auto v = as_index(lowest.vertex);
      for (int k = round.first[v]; k < round.first[v + 1]; ++k) {
        const int other = round.neighbors[as_index(k)];
        NearPoint near = lowest;
        near.feature = {FeatureId::Kind::vertex, other, -1};
        near.vertex = other;
        near.position = in_host.to_world(round.vertices[as_index(other)]);
        const ContactPlane plane =
            exposed_plane(bodies_, pair.host, pose, near.position,
                          in_host.to_world(round.inside[as_index(other)]), PointKind::fixed);
        if (!(plane.gap < margin) || !(plane.faces || plane.gap < 0)) continue;
        near.normal = plane.normal;
        near.gap = plane.gap;
        touches.push_back(near);
      }
    }
  }

  // Adds the further faces of a mesh that the samples among the touches from `begin` on touch, see
  // find_faces_around_sample().
  void find_faces_at_samples(const BodyPair& pair, double margin, std::size_t begin,
                             CandidateSearch::Chunk& chunk) const {
    const LevelSet& host = bodies_.rigid.properties[as_index(pair.host)].shape;
    if (host.kind != LevelSet::Kind::grid) return;
    const RigidProperties& guest = bodies_.rigid.properties[as_index(pair.guest_rigid)];
    const Pose in_host = in_host_of(bodies_.rigid, pair);
    const std::size_t end = chunk.touches.size();
    for (std::size_t i = begin; i < end; ++i)
      if (chunk.touches[i].feature.kind == FeatureId::Kind::point)
        find_faces_around_sample(host, guest, in_host, margin, i, chunk.touches, chunk.planes);
  }

  // Appends the touches of support points with several faces of a mesh, see find_faces_around(), without
  // those whose feet an adjoining body hides.
  void find_faces(const BodyPair& pair, PairDirection direction, double margin,
                  CandidateSearch::Chunk& chunk) const {
    const auto h = as_index(pair.host);
    const std::size_t first = chunk.touches.size();
    find_faces_around(bodies_.rigid.properties[h].shape,
                      bodies_.rigid.properties[as_index(pair.guest_rigid)].shape,
                      in_host_of(bodies_.rigid, pair), margin, chunk.touches, chunk.planes);
    for (std::size_t i = first; i < chunk.touches.size(); ++i)
      chunk.touches[i].reversed = direction == PairDirection::reversed;
    const Pose pose = shape_pose(bodies_.rigid, h);
    const auto is_hidden = [&](const NearPoint& touch) {
      const EdgePoint& place = chunk.planes[as_index(touch.plane_index)].edge;
      return hidden_foot(bodies_, pair.host, pose.to_world(place.foot), pose.orientation * place.normal)
          .has_value();
    };
    chunk.touches.erase(std::remove_if(chunk.touches.begin() + static_cast<std::ptrdiff_t>(first),
                                       chunk.touches.end(), is_hidden),
                        chunk.touches.end());
  }

  // Appends the edge contacts of the pair's rigid guest.
  void find_places(const BodyPair& pair, PairDirection direction, double margin,
                   CandidateSearch::Chunk& chunk) const {
    const std::size_t first = chunk.planes.size();
    find_feature_edges(bodies_, pair, direction, margin, chunk.planes);
    for (std::size_t i = first; i < chunk.planes.size(); ++i) {
      const EdgeContact& near = chunk.planes[i];
      chunk.touches.push_back({.feature = near.feature,
                               .reversed = direction == PairDirection::reversed,
                               .position = near.edge.foot + near.distance * near.edge.normal,
                               .normal = near.edge.normal,
                               .gap = near.distance,
                               .plane_index = static_cast<int>(i)});
    }
  }

  // Appends the touches of the pair's deformable guest: its surface points, its edges and its faces.
  void find_deformable(const BodyPair& pair, CandidateSearch::Chunk& chunk) const {
    const auto h = as_index(pair.host);
    const BodyBounds& host = search_.broad_phase.bounds[h];
    const auto d = bodies_.rigid.size() + as_index(pair.guest_deformable);
    const BodyBounds& guest = search_.broad_phase.bounds[d];
    const double speed =
        fastest(guest) + max_change(static_cast<int>(d)) + fastest(host) + max_change(pair.host);
    const double rest = margin_at_rest(host, guest);
    const double margin = reach(speed, dt_) + rest;
    if (separation(host, guest) > margin) return;
    const double around = bodies_.deformable[as_index(pair.guest_deformable)].thickness / 2;
    visit_near(bodies_, search_, pair, margin + around, [&](NearPoint touch) {
      const SurfacePoint& point = bodies_.points[as_index(touch.feature.index)];
      touch.gap += point.contact_offset;
      if (neither_moves(bodies_, point, h)) return;
      if (touch.gap < rest + reach_of(point, search_.point[as_index(touch.feature.index)], h))
        chunk.touches.push_back(touch);
    });
    ContactPoint contact;
    const auto take = [&](const EdgeContact& near) {
      contact.feature = near.feature;
      contact.edge = near.edge;
      put_on_surface(bodies_, contact);
      const SurfacePoint& point = contact.on_surface;
      if (neither_moves(bodies_, point, h)) return;
      const double gap = near.distance + point.contact_offset;
      if (!(gap < rest + reach_of(point, weighted(point, bodies_.particles.x), h))) return;
      chunk.touches.push_back({.feature = near.feature,
                               .position = near.edge.foot,
                               .normal = near.edge.normal,
                               .gap = gap,
                               .plane_index = static_cast<int>(chunk.planes.size())});
      chunk.planes.push_back(near);
    };
    const auto margin_of = [&](const BoundaryEdge& edge) {
      return rest + reach_of(edge, h) - edge.contact_offset;
    };
    visit_places(bodies_, search_.broad_phase, pair, margin + around, margin_of, chunk, take);
  }

  // Returns how far a deformable guest's point at `x` (m, world) may move towards the host in the step, m.
  double reach_of(const SurfacePoint& point, const Vec3& x, std::size_t host) const {
    return reach_of(x, weighted(point, bodies_.particles.v), weighted(point, difference_.particle), host);
  }
  // Returns how far a point at `x` (m, world) with the velocity `velocity`, which forces changed by `change`
  // (m/s), may move towards the host in the step, m.
  double reach_of(const Vec3& x, const Vec3& velocity, const Vec3& change, std::size_t host) const {
    const RigidState& state = bodies_.rigid.state[host];
    const Vec3 arm = x - state.pose.position;
    const Vec3 v = velocity - point_velocity(state, arm);
    return reach(v.norm() + change.norm() + host_change(host, arm).norm(), dt_);
  }
  // Returns by how much forces and prescribed motion changed the velocity of a rigid body at `arm` (m, world)
  // from its center of mass, m/s.
  Vec3 host_change(std::size_t body, const Vec3& arm) const {
    const Vec3& linear = difference_.rigid[body];
    return search_.broad_phase.bounds[body].is_dynamic ? linear
                                                       : Vec3(linear + difference_.rotation[body].cross(arm));
  }
  // Returns how far the points of an edge may move towards the host in the step, m: the greater value of its
  // ends. Velocities are linear along the edge, so that none of its points moves farther.
  double reach_of(const BoundaryEdge& edge, std::size_t host) const {
    constexpr double slack = 1 + 1e-9;  // against rounding
    double farthest = 0;
    for (const int particle : edge.particle) {
      const auto p = as_index(particle);
      farthest = std::max(
          farthest, reach_of(bodies_.particles.x[p], bodies_.particles.v[p], difference_.particle[p], host));
    }
    return slack * farthest;
  }

  // Sizes the lists of contacts, and tells each of the first `chunks` chunks where its results go.
  void make_room(std::size_t chunks) {
    std::size_t pairs = 0, points = 0;
    for (std::size_t c = 0; c < chunks; ++c) {
      search_.chunks[c].first_pair = pairs;
      search_.chunks[c].first_point = points;
      pairs += search_.chunks[c].pairs.size();
      points += search_.chunks[c].touches.size();
    }
    contacts_.pairs.resize(pairs);
    contacts_.points.resize(points);
    contacts_.measured.x.clear();
  }

  // Copies the pairs of a chunk, and makes contact points of its touches.
  void fill(const CandidateSearch::Chunk& chunk) const {
    const int first = static_cast<int>(chunk.first_point);
    for (std::size_t p = 0; p < chunk.pairs.size(); ++p) {
      const auto& [pair, begin, end] = chunk.pairs[p];
      ContactPair& target = contacts_.pairs[chunk.first_pair + p] = ContactPair();
      target.host = pair.host;
      target.guest_rigid = pair.guest_rigid;
      target.guest_deformable = pair.guest_deformable;
      target.begin = first + begin;
      target.end = first + end;
      for (int i = begin; i < end; ++i) {
        const NearPoint& touch = chunk.touches[as_index(i)];
        make_contact(touch.reversed ? reversed(pair) : pair, touch, chunk,
                     contacts_.points[as_index(first + i)] = ContactPoint());
        target.patches = std::max(target.patches, touch.patch + 1);
      }
    }
  }

  // Makes a contact point of a touch, from an empty one. Its friction is the smaller coefficient of two rigid
  // bodies; with a deformable guest it is the coefficient of the host, faded at edges that cut into the
  // guest.
  void make_contact(const BodyPair& pair, const NearPoint& near, const CandidateSearch::Chunk& chunk,
                    ContactPoint& contact) const {
    const RigidProperties& host = bodies_.rigid.properties[as_index(pair.host)];
    contact.host = pair.host;
    contact.guest_rigid = pair.guest_rigid;
    contact.feature = near.feature;
    contact.patch = near.patch;
    contact.share = near.share;
    if (near.plane_index >= 0) {
      contact.edge = chunk.planes[as_index(near.plane_index)].edge;
      contact.plane_frame = chunk.planes[as_index(near.plane_index)].plane_frame;
    }
    contact.friction = host.friction;
    // Deformable bodies have no restitution, because they store and return energy by themselves (paper
    // section 4).
    contact.restitution = 0;
    if (pair.guest_rigid >= 0) {
      const RigidProperties& guest = bodies_.rigid.properties[as_index(pair.guest_rigid)];
      contact.friction = std::min(host.friction, guest.friction);
      contact.restitution = std::min(host.restitution, guest.restitution);
      contact.precision = std::min(1.0, std::min(host.shape.min_size(), guest.shape.min_size()) / min_size);
    }
    if (pair.guest_rigid < 0) {
      const auto d = bodies_.rigid.size() + as_index(pair.guest_deformable);
      const BodyBounds& guest = search_.broad_phase.bounds[d];
      contact.precision =
          std::min(1.0, std::min(host.shape.min_size(), 2 * (guest.half.norm() + guest.radius)) / min_size);
    }
    if (pair.guest_rigid < 0 && contact.is_on_edge()) put_on_surface(bodies_, contact);
    update_geometry(bodies_, contact);
    contact.first_normal = contact.normal;
    if (pair.guest_rigid < 0)
      contact.friction *= friction_fade_fraction(bodies_, surface_point(bodies_, contact), contact.normal);
  }

  const Bodies& bodies_;
  const CandidateFilter& filter_;
  double dt_;
  const VelocityState& difference_;
  ContactSet& contacts_;
  CandidateSearch& search_;
};

}  // namespace

void find_candidates(const Bodies& bodies, const CandidateFilter& filter, double dt,
                     const VelocityState& difference, ContactSet& contacts) {
  Finder(bodies, filter, dt, difference, contacts).find();
}

}  // namespace duet
