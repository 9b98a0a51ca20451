#include "sim/coupling/push_out.h"

#include <algorithm>
#include <span>
#include <tuple>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace duet {
namespace {

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

// A static outer body acts as one this many times as heavy as the central body: the limit of equation 1 for
// K_o -> 0.
constexpr double static_weight = 1e8;

using Outer = PushOutScratch::Outer;

class PushOut {
 public:
  PushOut(Bodies& bodies, ContactSet& contacts, const ContactGraph& graph, bool rigid_pairs,
          PushOutScratch& scratch)
      : bodies_(bodies), contacts_(contacts), graph_(graph), rigid_pairs_(rigid_pairs), scratch_(scratch) {
    scratch_.taken.assign(bodies.particles.size(), -1);
  }

  // Returns whether anything overlapped the body.
  bool push_from(int central, double fraction) {
    const std::span<const int> pairs = pairs_of(central);
    if (std::none_of(pairs.begin(), pairs.end(), [&](int p) { return scratch_.suspect[as_index(p)] != 0; }))
      return false;
    gather(central, fraction);
    if (scratch_.outers.empty()) return false;
    if (bodies_.rigid.properties[as_index(central)].is_static())
      for (const Outer& outer : scratch_.outers) move_outer(outer, outer.displacement);  // they decouple
    else
      push_together(central);
    return true;
  }

 private:
  std::span<const int> pairs_of(int body) const {
    const auto b = as_index(body);
    return std::span(graph_.pair_of_body)
        .subspan(as_index(graph_.first_pair[b]), as_index(graph_.first_pair[b + 1] - graph_.first_pair[b]));
  }

  // Moves a rigid body; it may now overlap whatever it touches.
  void displace(int body, const Vec3& v, const Vec3& w) {
    const auto b = as_index(body);
    duet::displace(bodies_.rigid.state[b], bodies_.rigid.properties[b], v, w);
    for (int p : pairs_of(body)) scratch_.suspect[as_index(p)] = 1;
  }

  const ContactPoint& contact(const Outer& outer) const { return contacts_.points[as_index(outer.contact)]; }

  void gather(int central, double fraction) {
    scratch_.outers.clear();
    for (int p : pairs_of(central)) {
      const ContactPair& pair = contacts_.pairs[as_index(p)];
      if (pair.guest_rigid < 0)
        gather_points(pair, fraction);
      else if (rigid_pairs_)
        gather_deepest(pair, central, fraction);
    }
  }

  // All overlapping points of a deformable body, but no two that move the same particle: it would move twice.
  void gather_points(const ContactPair& pair, double fraction) {
    const int mark = ++stamp_;
    for (int i = pair.begin; i < pair.end; ++i) {
      ContactPoint& point = contacts_.points[as_index(i)];
      if (gap_now(bodies_, point) >= -overlap_tolerance) continue;
      update_geometry(bodies_, point);
      const SurfacePoint& carrier = surface_point(bodies_, point);
      const auto particles = std::span(carrier.particle).first(static_cast<std::size_t>(carrier.count));
      if (std::any_of(particles.begin(), particles.end(),
                      [&](int q) { return scratch_.taken[as_index(q)] == mark; }))
        continue;
      for (int q : particles) scratch_.taken[as_index(q)] = mark;
      scratch_.outers.push_back(make_outer(i, false, fraction, Mat3::Identity() / carrier.inverse_mass));
    }
  }

  // The deepest overlap with another rigid body, which may have been found from either side.
  void gather_deepest(const ContactPair& pair, int central, double fraction) {
    int deepest = -1;
    double least = -overlap_tolerance;
    for (int i = pair.begin; i < pair.end; ++i) {
      const double gap = gap_now(bodies_, contacts_.points[as_index(i)]);
      if (gap >= least) continue;
      least = gap;
      deepest = i;
    }
    if (deepest < 0) return;
    update_geometry(bodies_, contacts_.points[as_index(deepest)]);
    const ContactPoint& point = contacts_.points[as_index(deepest)];
    const bool reversed = point.host != central;
    const int outer = reversed ? point.host : point.guest_rigid;
    for (Outer& other : scratch_.outers) {
      const ContactPoint& known = contact(other);
      if (!known.is_rigid_pair() || (other.reversed ? known.host : known.guest_rigid) != outer) continue;
      if (point.gap < known.gap)
        other = make_outer(deepest, reversed, fraction, outer_mass(point, reversed, central));
      return;
    }
    scratch_.outers.push_back(make_outer(deepest, reversed, fraction, outer_mass(point, reversed, central)));
  }

  // K_o^-1 of the rigid outer body, kg.
  Mat3 outer_mass(const ContactPoint& point, bool reversed, int central) const {
    const auto outer = as_index(reversed ? point.host : point.guest_rigid);
    const RigidProperties& properties = bodies_.rigid.properties[outer];
    if (properties.is_static())
      return Mat3::Identity() * (static_weight * bodies_.rigid.properties[as_index(central)].mass);
    const Vec3& arm = reversed ? point.host_arm : point.guest_arm;
    return impulse_factor(bodies_.rigid.state[outer], properties.inverse_mass, arm).inverse();
  }

  Outer make_outer(int index, bool reversed, double fraction, const Mat3& inverse_K) const {
    const ContactPoint& point = contacts_.points[as_index(index)];
    const Vec3 apart = -fraction * point.gap * point.normal;  // of the guest relative to the host
    return {index, reversed, reversed ? point.guest_arm : point.host_arm, reversed ? -apart : apart,
            inverse_K};
  }

  // Equation 2 for the displacement (v, w) of the central body, then equation 1 for each outer one.
  void push_together(int central) {
    const auto c = as_index(central);
    const RigidProperties& properties = bodies_.rigid.properties[c];
    const RigidState& state = bodies_.rigid.state[c];
    const Mat3 rotation = state.pose.orientation.toRotationMatrix();
    Mat6 system = Mat6::Zero();
    system.topLeftCorner<3, 3>().diagonal().setConstant(properties.mass);
    system.bottomRightCorner<3, 3>() = rotation * properties.inertia.asDiagonal() * rotation.transpose();
    Vec6 right = Vec6::Zero();
    for (const Outer& outer : scratch_.outers) {
      const Mat3 cross = skew(outer.arm);
      const Mat3 weighted_arm = cross * outer.inverse_K;
      system.topLeftCorner<3, 3>() += outer.inverse_K;
      system.bottomLeftCorner<3, 3>() += weighted_arm;
      system.topRightCorner<3, 3>() += weighted_arm.transpose();
      system.bottomRightCorner<3, 3>() += weighted_arm * cross.transpose();
      const Vec3 wanted = -(outer.inverse_K * outer.displacement);
      right.head<3>() += wanted;
      right.tail<3>() += outer.arm.cross(wanted);
    }
    const Vec6 twist = system.ldlt().solve(right);
    const Vec3 v = twist.head<3>(), w = twist.tail<3>();
    for (const Outer& outer : scratch_.outers) move_outer(outer, v + w.cross(outer.arm) + outer.displacement);
    displace(central, v, w);
  }

  // Moves the outer body by the impulse K_o^-1 * change at its contact.
  void move_outer(const Outer& outer, const Vec3& change) {
    const ContactPoint& point = contact(outer);
    const Vec3 impulse = outer.inverse_K * change;
    if (!point.is_rigid_pair()) {
      const SurfacePoint& carrier = surface_point(bodies_, point);
      for (std::size_t i = 0; i < static_cast<std::size_t>(carrier.count); ++i) {
        const auto p = as_index(carrier.particle[i]);
        bodies_.particles.x[p] += carrier.weight[i] * bodies_.particles.inverse_mass[p] * impulse;
      }
      return;
    }
    const auto body = as_index(outer.reversed ? point.host : point.guest_rigid);
    const RigidState& state = bodies_.rigid.state[body];
    const RigidProperties& properties = bodies_.rigid.properties[body];
    if (properties.is_static()) return;
    const Vec3& arm = outer.reversed ? point.host_arm : point.guest_arm;
    displace(outer.reversed ? point.host : point.guest_rigid, properties.inverse_mass * impulse,
             state.inverse_inertia * arm.cross(impulse));
  }

  Bodies& bodies_;
  ContactSet& contacts_;
  const ContactGraph& graph_;
  bool rigid_pairs_;
  PushOutScratch& scratch_;
  int stamp_ = 0;
};

// Marks the rigid pairs that overlap now, and all pairs of deformable bodies: their particles are moved by
// every rigid body that they touch.
void find_overlaps(const Bodies& bodies, const ContactGraph& graph, const ContactSet& contacts,
                   std::vector<char>& suspect) {
  suspect.assign(contacts.pairs.size(), 0);
  parallel_for(graph.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ContactPair& pair = contacts.pairs[as_index(graph.pairs[i])];
      char& overlaps = suspect[as_index(graph.pairs[i])];
      overlaps = pair.guest_rigid < 0;
      for (int k = pair.begin; k < pair.end && !overlaps; ++k)
        overlaps = gap_now(bodies, contacts.points[as_index(k)]) < -overlap_tolerance;
    }
  });
}

// All rigid bodies that take part in contact, in the order of the contact graph.
void sort_central(const Bodies& bodies, const ContactGraph& graph, std::vector<int>& central) {
  central.clear();
  for (std::size_t body = 0; body < bodies.rigid.size(); ++body)
    if (graph.first_pair[body] < graph.first_pair[body + 1]) central.push_back(static_cast<int>(body));
  std::sort(central.begin(), central.end(), [&](int a, int b) {
    // Of one level the lightest first: between heavy bodies it then meets all of them at once, before one of
    // them alone throws it into the next (the messenger problem).
    const auto key = [&](int body) {
      return std::tuple(graph.level[as_index(body)], bodies.rigid.properties[as_index(body)].mass, body);
    };
    return key(a) < key(b);
  });
}

}  // namespace

void displace(RigidState& state, const RigidProperties& properties, const Vec3& shift, const Vec3& turn) {
  state.pose.position += shift;
  const double angle = turn.norm();
  if (angle > 0)
    state.pose.orientation =
        (Quat(Eigen::AngleAxisd(angle, turn / angle)) * state.pose.orientation).normalized();
  update_orientation_dependents(state, properties);
}

int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch) {
  PushOut push_out(bodies, contacts, graph, settings.rigid_pairs, scratch);
  const int iterations = settings.iterations;
  sort_central(bodies, graph, scratch.central);
  find_overlaps(bodies, graph, contacts, scratch.suspect);
  int pushed = 0;
  for (int iteration = 1; iteration <= iterations; ++iteration) {
    // Removing all of every overlap at once over-corrects stacks: the first half of the sweeps goes
    // gradually.
    const double fraction = std::min(1.0, 2.0 * iteration / (iterations + 1.0));
    int now = 0;
    for (int body : scratch.central) now += push_out.push_from(body, fraction);
    pushed += now;
    if (now == 0) break;
  }
  return pushed;
}

}  // namespace duet
