// Step V: free islands keep their spin, the angular momentum about their center of mass, which moving their
// positions would change. Islands with bones that turn about a joint of a static body keep that about the
// joint, apart from the moments of gravity and of the joint's control, friction and limits.
#include <algorithm>

#include "sim/contact/detection/surface_intersections.h"
#include "sim/deformable/spin.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Returns the inertia tensor of a body in world axes, kg m^2.
Mat3 world_inertia(const RigidState& state, const RigidProperties& properties) {
  const Mat3 axes = state.pose.orientation.toRotationMatrix();
  return axes * properties.inertia.asDiagonal() * axes.transpose();
}

// Calls rigid(i) for the rigid bodies of the island of deformable body `first`, and then particle(p) for its
// particles.
template <class Rigid, class Particle>
void for_each_mass(const Bodies& bodies, const FreeIslands& islands, std::size_t first, Rigid&& rigid,
                   Particle&& particle) {
  islands.for_each_member(first, rigid,
                          [&](std::size_t d) { for_each_particle(bodies.deformable[d], particle); });
}

// Returns mass, center and inertia tensor about the center of an island.
MassMoments moments_of(const Bodies& bodies, const FreeIslands& islands, std::size_t first) {
  const RigidBodies& rigid = bodies.rigid;
  const Particles& particles = bodies.particles;
  MassMoments moments = moments_of_masses([&](auto&& visit) {
    for_each_mass(
        bodies, islands, first,
        [&](std::size_t i) { visit(rigid.properties[i].mass, rigid.state[i].pose.position); },
        [&](std::size_t p) { visit(particles.mass[p], particles.x[p]); });
  });
  islands.for_each_member(
      first, [&](std::size_t i) { moments.inertia += world_inertia(rigid.state[i], rigid.properties[i]); },
      [](std::size_t) {});
  return moments;
}

// Adds the rigid rotation -`rate` (rad/s) about the center of mass to the velocities of an island. No joint
// comes apart, and nothing deforms.
void turn_back(Bodies& bodies, const FreeIslands& islands, std::size_t first, const Vec3& center,
               const Vec3& rate) {
  for_each_mass(
      bodies, islands, first,
      [&](std::size_t i) {
        RigidState& state = bodies.rigid.state[i];
        state.velocity -= rate.cross(state.pose.position - center);
        state.angular_velocity -= rate;
        state.angular_momentum -= world_inertia(state, bodies.rigid.properties[i]) * rate;
      },
      [&](std::size_t p) { bodies.particles.v[p] -= rate.cross(bodies.particles.x[p] - center); });
}

// Returns the angular momentum (kg m^2/s) that an island of mass `mass` (kg) gains without any force as its
// positions move:
//   sum m (x^{n+1} - x^n) x (u + (w - u')/2),  without the displacement of the center of mass.
// Positions move by dt v~, with the velocities of steps I and III, and not by dt times the mean of v^n and
// v^{n+1}. Velocities are u at x^n, including the impulses of joints there; impulses of joints and drag at
// x^{n+1} lead to u', and forces at x^{n+1/2} to w. The gain is of third order in dt.
Vec3 gain_of_moving(const StepContext& context, std::size_t first, double mass, const Bodies& bodies) {
  const FreeIslands& islands = context.spin.islands;
  const RigidBodies& rigid = bodies.rigid;
  const Particles& particles = bodies.particles;
  const auto moved_body = [&](std::size_t i) -> Vec3 {
    return rigid.state[i].pose.position - context.states.rigid_n[i].pose.position;
  };
  const auto moved = [&](std::size_t p) -> Vec3 { return particles.x[p] - context.states.x_n[p]; };
  Vec3 way = Vec3::Zero(), gained = Vec3::Zero();
  for_each_mass(
      bodies, islands, first, [&](std::size_t i) { way += rigid.properties[i].mass / mass * moved_body(i); },
      [&](std::size_t p) { way += particles.mass[p] / mass * moved(p); });
  for_each_mass(
      bodies, islands, first,
      [&](std::size_t i) {
        gained +=
            rigid.properties[i].mass / 2 * (moved_body(i) - way).cross(context.spin.twice_moved.linear[i]);
      },
      [&](std::size_t p) {
        gained += particles.mass[p] / 2 * (moved(p) - way).cross(context.spin.twice_moved.particle[p]);
      });
  return gained;
}

// Returns the angular momentum (kg m^2/s) that an island gains without any force, if its velocities come from
// a solve with contact inside. `center` (m) is its center of mass and `mass` its mass (kg).
//
// Such a solve includes the joints at x^{n+1}, and damping at x^{n+1/2} that acts on bones at x^{n+1}. Their
// moments add up to nothing. All change of spin about the center of mass is therefore a gain, except for what
// mass-proportional damping takes.
Vec3 gain_of_solve(const StepContext& context, std::size_t first, const Vec3& center, double mass,
                   const Bodies& bodies) {
  const PaperStates& states = context.states;
  const FreeIslands& islands = context.spin.islands;
  const RigidBodies& rigid = bodies.rigid;
  const Particles& particles = bodies.particles;
  Vec3 start = Vec3::Zero();  // m, center of mass at x^n
  for_each_mass(
      bodies, islands, first,
      [&](std::size_t i) { start += rigid.properties[i].mass / mass * states.rigid_n[i].pose.position; },
      [&](std::size_t p) { start += particles.mass[p] / mass * states.x_n[p]; });
  Vec3 gained = Vec3::Zero();
  for_each_mass(
      bodies, islands, first,
      [&](std::size_t i) {
        const RigidState &now = rigid.state[i], &then = states.rigid_n[i];
        gained += now.angular_momentum - then.angular_momentum +
                  rigid.properties[i].mass * ((now.pose.position - center).cross(now.velocity) -
                                              (then.pose.position - start).cross(then.velocity));
      },
      [&](std::size_t p) {
        const Vec3 arm = particles.x[p] - center, arm_then = states.x_n[p] - start;
        gained += particles.mass[p] * (arm.cross(particles.v[p]) - arm_then.cross(states.v_n.particle[p]));
        const double drag = bodies.forces.elements.drag(p);
        if (drag > 0)
          gained += context.dt * drag / 2 * (arm + arm_then).cross(context.solve.solution.particle[p]);
      });
  return gained;
}

// Returns the angular momentum (kg m^2/s) about the fixed point `pivot` (m) that an island gains without a
// force, if its velocities come from a solve with contact inside: all that does not come from gravity, drag,
// and `drive`, the impulse that the static body gives by control, friction and limits of the joint there.
Vec3 gain_about(const World& world, std::size_t first, const Vec3& pivot, const Momentum& drive) {
  const StepContext& context = world.context;
  const Bodies& bodies = world.bodies;
  const RigidBodies& rigid = bodies.rigid;
  const Particles& particles = bodies.particles;
  Vec3 gained = pivot.cross(drive.linear) - drive.angular;
  const auto add = [&](double mass, const Vec3& x, const Vec3& x_n, const Vec3& v, const Vec3& v_n) {
    gained += mass * ((x - pivot).cross(v) - (x_n - pivot).cross(v_n) -
                      context.dt * (0.5 * (x + x_n) - pivot).cross(world.gravity));
  };
  for_each_mass(
      bodies, context.spin.islands, first,
      [&](std::size_t i) {
        const RigidState &now = rigid.state[i], &then = context.states.rigid_n[i];
        add(rigid.properties[i].mass, now.pose.position, then.pose.position, now.velocity, then.velocity);
        gained += now.angular_momentum - then.angular_momentum;
      },
      [&](std::size_t p) {
        const Vec3 &x = particles.x[p], &x_n = context.states.x_n[p];
        add(particles.mass[p], x, x_n, particles.v[p], context.states.v_n.particle[p]);
        const double drag = bodies.forces.elements.drag(p);
        if (drag > 0)
          gained += context.dt * drag * (0.5 * (x + x_n) - pivot).cross(context.solve.solution.particle[p]);
      });
  return gained;
}

// Turns the island of deformable body `first` back about the joint of a static body that holds it.
void keep_spin_about_joint(World& world, std::size_t first, const MassMoments& moments) {
  const StepContext& context = world.context;
  Bodies& bodies = world.bodies;
  if (world.applied.any) return;
  const Joint& joint = bodies.articulation.joints[as_index(context.spin.islands.pivot(first))];
  const auto parent = as_index(joint.parent), child = as_index(joint.child);
  const JointFrames frames(joint, bodies.rigid.state[parent].pose, bodies.rigid.state[child].pose);
  const Vec3 pivot = bodies.rigid.properties[parent].is_dynamic() ? frames.child : frames.parent;
  const Vec3 gained = gain_about(world, first, pivot, context.joints.forces.impulse_of_fixed(parent, child));
  const Vec3 arm = moments.center - pivot;
  const Mat3 inertia =
      moments.inertia + moments.mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  if (joint.kind == JointKind::hinge) {
    const Vec3 axis = frames.parent_axes * Vec3::UnitX();
    turn_back(bodies, context.spin.islands, first, pivot, gained.dot(axis) / axis.dot(inertia * axis) * axis);
  } else {
    MassMoments about_pivot = moments;
    about_pivot.inertia = inertia;
    turn_back(bodies, context.spin.islands, first, pivot, angular_velocity_of(about_pivot, gained));
  }
}

// Turns the island of deformable body `first` back by what it has gained.
void keep_spin(World& world, std::size_t first) {
  const StepContext& context = world.context;
  Bodies& bodies = world.bodies;
  const MassMoments moments = moments_of(bodies, context.spin.islands, first);
  bool has_bones = false, by_solve = false;  // by_solve: contact inside the solve
  context.spin.islands.for_each_member(
      first, [&](std::size_t) { has_bones = true; },
      [&](std::size_t d) { by_solve = by_solve || context.solved.bodies[d]; });
  if (context.spin.islands.pivot(first) >= 0) {
    if (has_bones && by_solve) keep_spin_about_joint(world, first, moments);
    return;
  }
  const Vec3 gained = has_bones && by_solve
                          ? gain_of_solve(context, first, moments.center, moments.mass, bodies)
                          : gain_of_moving(context, first, moments.mass, bodies);
  turn_back(bodies, context.spin.islands, first, moments.center, angular_velocity_of(moments, gained));
}

// Returns whether bodies of a pair have exchanged an impulse. A rigid pair that collided had one in step II,
// even if it has none in step III.
bool has_met(const ContactPair& pair, const ContactSet& contacts) {
  if (pair.guest_rigid >= 0 && pair.collided) return true;
  for (int i = pair.begin; i < pair.end; ++i)
    if (!contacts.points[as_index(i)].impulse.isZero(0)) return true;
  return false;
}

}  // namespace

// Sets context.spin.islands to the islands that nothing has touched in this step.
void find_untouched(World& world, StepContext& context) {
  const Bodies& bodies = world.bodies;
  const Particles& particles = bodies.particles;
  FreeIslands& islands = context.spin.islands;
  islands.find(bodies);
  for (const DeformableBody& body : bodies.deformable)
    for_each_particle(body, [&](std::size_t p) {
      if (particles.mass[p] == 0) return;  // carried by a bone, which joints have moved as well
      if (is_held(particles, p) || particles.v[p] != context.states.v_n.particle[p])
        islands.touch_particle(static_cast<int>(p));
    });
  for (const ContactPair& pair : context.contact.contacts.pairs) {
    if (!has_met(pair, context.contact.contacts)) continue;
    islands.touch_rigid(pair.host);
    if (pair.guest_rigid >= 0) islands.touch_rigid(pair.guest_rigid);
    if (pair.guest_deformable >= 0)
      islands.touch_particle(bodies.deformable[as_index(pair.guest_deformable)].first_particle);
  }
  const std::vector<char>& solved = context.solved.bodies;
  if (world.has(Effect::air_drag) &&
      std::count(solved.begin(), solved.end(), true) > 0)  // gain_of_solve() would count drag as a gain
    for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
      if (bodies.rigid.properties[i].air_drag > 0) islands.touch_rigid(static_cast<int>(i));
  if (world.has(Effect::self_repulsion))
    for (const RepulsionPair& pair : context.surfaces.repulsion.pairs())
      for (const int p : pair.particle) islands.touch_particle(p);
  islands.finish();
}

void begin_spin(World& world, StepContext& context) {
  find_untouched(world, context);
  const RigidBodies& rigid = world.bodies.rigid;
  const bool joints = world.has(Effect::articulation);
  context.spin.twice_moved.particle = context.states.v_n.particle;
  context.spin.twice_moved.linear.resize(rigid.size());
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    Vec3 start = context.states.v_hat_n.rigid[i];
    if (joints) start += rigid.properties[i].inverse_mass * context.joints.push[i];
    context.spin.twice_moved.linear[i] = 2 * start - rigid.state[i].velocity;
  }
}

void count_middle_forces(World& world, StepContext& context, double sign) {
  const Bodies& bodies = world.bodies;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    context.spin.twice_moved.particle[p] += sign * bodies.particles.v[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    context.spin.twice_moved.linear[i] += sign * bodies.rigid.state[i].velocity;
}

bool keeps_spin(const World& world) { return world.settings.keep_spin && world.has_internal_forces(); }

// In the order in which V.4 comes before the solve, the forces of the middle have been counted when they
// acted.
void keep_spin(World& world, StepContext& context) {
  if (!world.settings.constraints_before_solve) count_middle_forces(world, context, 1);
  for (const std::size_t first : context.spin.islands.untouched()) keep_spin(world, first);
}

}  // namespace duet
