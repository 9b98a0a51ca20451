// The time-step rule, and the check that every step ends with.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/parallel.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/contact/detection/surface_intersections.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Least elastic step, as a fraction of the step at rest. Elements that an impact has almost flattened are not
// followed below it: their stress is bounded (neo_hookean.h), and the implicit damping holds them.
constexpr double min_elastic_share = 1.0 / 32;

// Returns the stability limit (s) at rest that undamped elasticity has, whatever damping relaxes of it.
double elastic_limit_at_rest(const InternalForces& forces) {
  return 2 / std::sqrt(forces.elastic_omega_squared());
}

// Returns 2/omega_max (s) of the elements as they are now, between its value at rest and a fraction of that.
// It is the stability limit of the scheme for undamped elasticity, whose amplification matrix is that of
// leapfrog.
double elastic_limit(const InternalForces& forces) {
  const double now = 2 / std::sqrt(forces.max_omega_squared());
  const double at_rest = 2 / std::sqrt(forces.rest_omega_squared());
  return std::clamp(now, min_elastic_share * elastic_limit_at_rest(forces), at_rest);
}

// Largest deformation of an element within a step, as a fraction of its size at rest; the volume may change
// by twice the fraction. The stiffness that bounds the step is that of its start, and it must not grow much
// within the step. Elements that are stretched to ten times their size are inverted by several of their
// volumes on a displacement of a quarter of their size, and the energy that steps gain from that ends in a
// blow-up.
constexpr double max_stretching = 0.25;
// Least step of this bound, as a fraction of the elastic step at rest. A deformation that still grows then is
// beyond help.
constexpr double min_stretching_share = 1.0 / 1024;

// Returns the longest step (s) in which no element deforms by more than `max_stretching`.
double stretching_limit(const InternalForces& forces, const Particles& particles) {
  return std::max(max_stretching / forces.elements.max_deformation_rate(particles.x, particles.v),
                  min_stretching_share * elastic_limit_at_rest(forces));
}

// Shortens `choice` to the bounds of elasticity and stretching.
void bound_by_elasticity(const World& world, TimeStepChoice& choice) {
  if (!world.has_internal_forces() || world.settings.implicit_elasticity) return;
  const InternalForces& forces = world.bodies.forces;
  if (const double limit = world.settings.cfl * elastic_limit(forces); limit < choice.seconds)
    choice = {limit, TimeStepBound::elasticity};
  if (const double limit = stretching_limit(forces, world.bodies.particles); limit < choice.seconds)
    choice = {limit, TimeStepBound::stretching};
}

constexpr double infinity = std::numeric_limits<double>::infinity();

// Largest depth to which others may enter a body within a step, over its thickness. A point that enters by
// less than half was outside on the near side, so that the normal at its place inside leads back to where it
// came from.
constexpr double passing_share = 0.5;
// Farthest that a round body moves past a deformable one with implicit elasticity in a step, over the depth
// to which others may enter it. Contacts have one normal for the whole step, that of its middle: a body that
// rolls on by a tenth of its thickness in each step loses a third of its speed in a second.
constexpr double rolling_share = 0.25;

// Shortens `choice` to the bound on the turns of rigid bodies in a step from `time` (s) on.
void bound_by_turn(const World& world, double time, TimeStepChoice& choice) {
  const RigidBodies& rigid = world.bodies.rigid;
  const auto bound = [&](std::size_t body, double rate) {
    if (rate * choice.seconds > world.settings.max_rotation)
      choice = {world.settings.max_rotation / rate, TimeStepBound::turn, static_cast<int>(body)};
  };
  for (std::size_t i = 0; i < rigid.size(); ++i)
    if (rigid.properties[i].is_dynamic() && !rigid.properties[i].is_ball())
      bound(i, rigid.state[i].angular_velocity.norm());  // free spheres turn without error
  for (const std::size_t body : world.context.joints.solver.bodies())
    bound(body, rigid.state[body].angular_velocity.norm());
  for (const KinematicBody& kinematic : rigid.kinematic) {
    const MotionBounds ahead = motion_bounds(kinematic.motion, time, time + choice.seconds);
    bound(kinematic.body, std::max(ahead.spin, ahead.phase));
  }
}

// Largest phase through which a pendulum may swing in a step, rad. It makes periods 0.12 % too short.
constexpr double max_swing = 0.1;

// Marks in `hangs` the dynamic bodies that joints connect with a body that is not dynamic. Bodies that carry
// particles are not marked: their flesh determines how they move.
void find_hanging(const Bodies& bodies, std::vector<char>& hangs) {
  const RigidBodies& rigid = bodies.rigid;
  hangs.assign(rigid.size(), 0);
  const auto is_held = [&](std::size_t body) { return !rigid.properties[body].is_dynamic() || hangs[body]; };
  for (bool grows = true; grows;) {
    grows = false;
    for (const Joint& joint : bodies.articulation.joints) {
      const std::size_t parent = as_index(joint.parent), child = as_index(joint.child);
      if (is_held(parent) == is_held(child)) continue;
      hangs[is_held(parent) ? child : parent] = grows = true;
    }
  }
  for (const EmbeddedParticle& particle : bodies.bound) hangs[particle.body] = false;
}

// Shortens `choice` to the bound on pendulums: bodies that hang on a joint which lets them turn. A body that
// swings about a point at the distance r from its center of mass has the frequency sqrt(m g r / (I + m r^2)).
void bound_by_swing(const World& world, StepContext& context, TimeStepChoice& choice) {
  const RigidBodies& rigid = world.bodies.rigid;
  const double g = world.gravity.norm();
  find_hanging(world.bodies, context.choice.hangs);
  const auto bound = [&](int body, const Pose& frame) {
    if (!context.choice.hangs[as_index(body)]) return;
    const RigidProperties& properties = rigid.properties[as_index(body)];
    const double r = frame.position.norm(), m = properties.mass;
    const double frequency = std::sqrt(m * g * r / (properties.inertia.minCoeff() + m * r * r));
    if (frequency * choice.seconds > max_swing) choice = {max_swing / frequency, TimeStepBound::swing, body};
  };
  for (const Joint& joint : world.bodies.articulation.joints) {
    if (!turns(joint.kind)) continue;
    bound(joint.parent, joint.parent_frame);
    bound(joint.child, joint.child_frame);
  }
}

// Distance at which a jointed ball has met what it rebounds from, over the smaller thickness of the two. An
// impact acts at the beginning of a step, so that its bodies are apart by this distance at most.
constexpr double meeting_share = 1e-4;

// Marks in `balls` the balls that have joints and restitution. Returns whether there are any. Balls without
// joints need no bound: their impacts act when they meet (impact_delay.h).
bool find_jointed_balls(const World& world, std::vector<char>& balls) {
  const RigidBodies& rigid = world.bodies.rigid;
  balls.assign(rigid.size(), 0);
  bool any = false;
  for (const std::size_t body : world.context.joints.solver.bodies()) {
    const RigidProperties& properties = rigid.properties[body];
    balls[body] = properties.is_ball() && properties.restitution > 0;
    any |= balls[body] != 0;
  }
  return any;
}

// Returns whether an impact of the pair is to act where the two meet: one is a jointed ball, and both have
// restitution.
bool rebounds_at_joints(const World& world, const BodyPair& pair) {
  if (pair.guest_rigid < 0) return false;
  const auto h = as_index(pair.host), g = as_index(pair.guest_rigid);
  const std::vector<char>& balls = world.context.choice.jointed_balls;
  const RigidBodies& rigid = world.bodies.rigid;
  return (balls[h] || balls[g]) && rigid.properties[h].restitution > 0 && rigid.properties[g].restitution > 0;
}

// Makes the bounds on kinematic bodies hold for all times from `time` (s) to `time + seconds`. The velocity
// bound is the box of the velocities at the ends and the middle, extended by how much faster they may move in
// between.
void look_ahead(const RigidBodies& rigid, double time, double seconds, std::vector<BodyBounds>& bounds) {
  for (const KinematicBody& kinematic : rigid.kinematic) {
    BodyBounds& body = bounds[kinematic.body];
    const MotionBounds ahead = motion_bounds(kinematic.motion, time, time + seconds);
    Eigen::AlignedBox3d velocities;
    double fastest_seen = 0;
    for (const double share : {0.0, 0.5, 1.0}) {
      const Vec3 velocity = motion_at(kinematic.motion, time + share * seconds).velocity;
      velocities.extend(velocity);
      fastest_seen = std::max(fastest_seen, velocity.norm());
    }
    const double arm = rigid.properties[kinematic.body].is_ball() ? 0 : body.arm;
    const double unseen = ahead.speed - fastest_seen + (ahead.spin - body.spin.norm()) * arm;
    body.velocity = velocities.center();
    body.velocity_half = velocities.sizes() / 2 + Vec3::Constant(std::max(unseen, 0.0));
  }
}

// Returns how deep another body may enter this one within a step, m.
double entry(const BodyBounds& body, const StepSettings& settings) {
  if (body.is_deformable) return infinity;  // a deformable body has no level set
  return body.thickness * (body.is_dynamic ? std::min(settings.max_travel, passing_share) : passing_share);
}

// Returns whether no body moves fast enough to enter another within `seconds`. `acceleration` (m/s) is the
// speed that gravity and applied forces add in that time.
bool all_are_slow(const std::vector<BodyBounds>& bounds, const StepSettings& settings, double acceleration,
                  double seconds) {
  double speed = acceleration, depth = infinity;
  for (const BodyBounds& body : bounds) {
    speed = std::max(speed, fastest(body) + acceleration);
    depth = std::min(depth, entry(body, settings));
  }
  return 2 * speed * seconds <= (settings.implicit_elasticity ? rolling_share : 1) * depth;
}

// Returns whether the pair is a round dynamic body and a deformable one with implicit elasticity.
bool rolls_implicitly(const World& world, const BodyPair& pair) {
  if (pair.guest_rigid >= 0 || !world.settings.implicit_elasticity) return false;
  const RigidProperties& host = world.bodies.rigid.properties[as_index(pair.host)];
  return host.is_dynamic() && support_point_count(host.shape) > 0;
}

// Returns how long body `a` takes to move by `way` (m) past body `b`, or to reach it if it is farther, s.
double rolling_time(const BodyBounds& a, const BodyBounds& b, double way) {
  return std::max(way, separation(a, b)) / (a.velocity - b.velocity).norm();
}

// Shortens `choice` to the bound of bodies that approach each other. Only bodies that can meet within the
// step bound it: bodies far apart may move until they almost touch, and bodies near each other may get no
// deeper into each other than the one that allows less.
void bound_by_approach(World& world, double time, TimeStepChoice& choice) {
  BroadPhase& broad_phase = world.context.choice.meeting;
  bound_bodies(world.bodies, broad_phase.bounds);
  look_ahead(world.bodies.rigid, time, choice.seconds, broad_phase.bounds);
  const double seconds = choice.seconds, push = world.applied.acceleration,
               acceleration = (world.gravity.norm() + push) * seconds;
  const bool jointed_balls = find_jointed_balls(world, world.context.choice.jointed_balls);
  if (!jointed_balls && all_are_slow(broad_phase.bounds, world.settings, acceleration, seconds)) return;
  broad_phase.margin.resize(broad_phase.bounds.size());
  for (std::size_t i = 0; i < broad_phase.margin.size(); ++i)
    broad_phase.margin[i] = seconds * (fastest(broad_phase.bounds[i]) + acceleration);

  const std::vector<BodyPair>& pairs = broad_phase.find(world.contact_filter());
  const int rigid_count = static_cast<int>(world.bodies.rigid.size());
  const auto limit_of = [&](const BodyPair& pair) {
    const int guest = pair.guest_rigid >= 0 ? pair.guest_rigid : rigid_count + pair.guest_deformable;
    if (pair.guest_rigid >= 0 && is_excluded(world.bodies, pair.host, pair.guest_rigid)) return choice;
    if (pair.guest_rigid < 0 && is_excluded_deformable(world.bodies, pair.host, pair.guest_deformable))
      return choice;
    const BodyBounds& a = broad_phase.bounds[static_cast<std::size_t>(pair.host)];
    const BodyBounds& b = broad_phase.bounds[static_cast<std::size_t>(guest)];
    const double depth = std::min(entry(a, world.settings), entry(b, world.settings));
    double apart = time_apart(a, b, depth, world.gravity);
    // u t + p t^2 = depth bounds the time of bodies that begin to move fast: t <= sqrt(depth / p).
    if (push > 0) apart = std::min(apart, std::sqrt(std::max(depth, separation(a, b)) / push));
    if (const double met = meeting_share * std::min(a.thickness, b.thickness);
        jointed_balls && rebounds_at_joints(world, pair) && separation(a, b) > met)
      apart = std::min(apart, time_apart(a, b, met, world.gravity));
    if (rolls_implicitly(world, pair))
      apart = std::min(apart, rolling_time(a, b, rolling_share * entry(a, world.settings)));
    return TimeStepChoice{apart, TimeStepBound::approach, pair.host, guest};
  };
  const auto shorter = [](const TimeStepChoice& a, const TimeStepChoice& b) {
    return b.seconds < a.seconds ? b : a;
  };
  choice = parallel_reduce(
      pairs.size(), 64, choice,
      [&](std::size_t begin, std::size_t end) {
        TimeStepChoice shortest = choice;
        for (std::size_t i = begin; i < end; ++i) shortest = shorter(shortest, limit_of(pairs[i]));
        return shortest;
      },
      shorter);
}

// Throws the error for a state that is not finite.
[[noreturn]] void fail(std::string_view stage, const std::string& body, const std::string& element,
                       const Vec3& position, double value) {
  SimulationFault fault;
  fault.stage = stage;
  fault.body = body;
  fault.element = element;
  fault.position = position;
  fault.value = value;
  fault.bound = std::numeric_limits<double>::max();
  fault.cause = "the state stopped being finite: a time step too large for the material or the contact";
  fault.remedy = "lower solver.cfl or solver.max_travel";
  throw SimulationError(fault);
}

}  // namespace

TimeStepChoice bounded_time_step(World& world, double time) {
  TimeStepChoice choice{world.settings.max_time_step, TimeStepBound::setting};
  bound_by_elasticity(world, choice);
  bound_by_turn(world, time, choice);
  if (world.has(Effect::articulation)) bound_by_swing(world, world.context, choice);
  const CandidateFilter filter = world.contact_filter();
  if (filter.rigid_pairs || filter.rigid_deformable) bound_by_approach(world, time, choice);
  return choice;
}

std::string describe(const TimeStepChoice& choice, const Bodies& bodies) {
  const auto name = [&](int body) {
    const auto i = static_cast<std::size_t>(body);
    return i < bodies.rigid.size() ? bodies.rigid.name[i] : bodies.deformable[i - bodies.rigid.size()].name;
  };
  switch (choice.bound) {
    case TimeStepBound::setting:
      return "solver.max_time_step";
    case TimeStepBound::elasticity: {
      const int particle = bodies.forces.elements.stiffest_particle();
      return particle < 0 ? "the elastic forces"
                          : fmt::format("the elastic forces of `{}`", body_name(bodies, particle));
    }
    case TimeStepBound::stretching:
      return fmt::format(
          "the pace at which elements of `{}` are deformed",
          body_name(bodies, bodies.forces.elements.fastest_particle(bodies.particles.x, bodies.particles.v)));
    case TimeStepBound::turn:
      return fmt::format("the turn of `{}`", name(choice.body));
    case TimeStepBound::swing:
      return fmt::format("the frequency at which `{}` swings", name(choice.body));
    case TimeStepBound::approach:
      return fmt::format("`{}` and `{}`, which can meet", name(choice.body), name(choice.other));
  }
  return {};
}

double choose_time_step(World& world, double time) { return bounded_time_step(world, time).seconds; }

void check_finite(const World& world, Stage stage) { check_finite(world, name(stage)); }

void check_finite(const World& world, std::string_view stage) {
  const Bodies& bodies = world.bodies;
  for (const DeformableBody& body : bodies.deformable)
    for (int i = 0; i < body.particle_count; ++i) {
      const auto p = static_cast<std::size_t>(body.first_particle) + static_cast<std::size_t>(i);
      const double sum = bodies.particles.x[p].sum() + bodies.particles.v[p].sum();
      if (!std::isfinite(sum))
        fail(stage, body.name, fmt::format("particle {}", i), world.context.states.x_n[p], sum);
    }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidState& state = bodies.rigid.state[i];
    const double sum = state.pose.position.sum() + state.pose.orientation.coeffs().sum() +
                       state.velocity.sum() + state.angular_momentum.sum();
    if (!std::isfinite(sum))
      fail(stage, bodies.rigid.name[i], {}, world.context.states.rigid_n[i].pose.position, sum);
  }
}

}  // namespace duet
