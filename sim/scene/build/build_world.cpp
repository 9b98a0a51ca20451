#include "sim/scene/build/build_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "sim/articulation/taut_chains.h"
#include "sim/base/elementary.h"
#include "sim/base/error.h"
#include "sim/contact/detection/facing.h"
#include "sim/contact/detection/friction_fade.h"
#include "sim/contact/detection/internal_edges.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/geometry/queries/texture.h"
#include "sim/scene/build/add_deformable.h"
#include "sim/scene/build/attachments.h"
#include "sim/scene/build/body_damping.h"
#include "sim/scene/build/motion.h"
#include "sim/scene/build/skins.h"
#include "sim/scene/build/tet_meshes.h"
#include "sim/scene/deformables.h"
#include "sim/scene/joints.h"
#include "sim/scene/solids.h"
#include "sim/step/step.h"

namespace duet::scene {
namespace {

// Default collision thickness of volumes as a fraction of the shortest edge of their surface. It is too small
// to be seen, and much larger than the displacements of a step. A larger value leaves wider gaps.
constexpr double default_collision_thickness = 0.1;
// Largest default collision thickness of shells as a fraction of the shortest edge. Thicker shells would
// repel their own neighboring elements where they fold sharply. Rods need no such limit, because they cannot
// turn within their own width.
constexpr double max_shell_thickness = 0.5;

// Appends a rigid body to `rigid`. `mass` (kg) is 0 for static and kinematic bodies. `surface` gives the
// coefficients of friction and restitution; it is a scene::RigidBody or the ground.
template <class Surface>
void add_rigid(RigidBodies& rigid, const std::string& name, const Solid& solid, double mass,
               const Surface& surface, const Placement& placement) {
  RigidProperties properties;
  properties.shape = solid.level_set;
  properties.samples = solid.samples;
  properties.inside = solid.inside;
  properties.on_flat = solid.on_flat;
  properties.feature_edges = solid.feature_edges;
  properties.round = solid.round;
  if (solid.round) properties.on_round = solid.round->at_sample;
  properties.friction = surface.friction;
  properties.restitution = surface.restitution;
  properties.rolling_friction = surface.rolling_friction;
  properties.spinning_friction = surface.spinning_friction;
  if (mass > 0) {
    properties.mass = mass;
    properties.inverse_mass = 1 / mass;
    properties.inertia = mass * solid.unit_inertia;
  }
  RigidState state;  // the placement takes the shape's own coordinates to the world
  state.pose.position = placement.position + placement.orientation * solid.frame.position;
  state.pose.orientation = placement.orientation * solid.frame.orientation;
  if (mass > 0) {
    state.velocity = placement.velocity;
    set_angular_velocity(state, properties, placement.angular_velocity);
  }
  rigid.name.push_back(name);
  rigid.properties.push_back(std::move(properties));
  rigid.state.push_back(state);
}

// Makes the last rigid body kinematic: it follows `motion`, from the state at time 0 on.
void make_kinematic(RigidBodies& rigid, KinematicMotion motion) {
  const MotionState start = motion_at(motion, 0);
  RigidState& state = rigid.state.back();
  state.pose = start.pose;
  state.velocity = start.velocity;
  state.angular_velocity = start.angular_velocity;
  rigid.properties.back().is_kinematic = true;
  rigid.kinematic.push_back({rigid.size() - 1, std::move(motion)});
}

// Returns the lumped masses (kg) of the nodes: each node gets a quarter of the mass of every tetrahedron
// around it.
std::vector<double> lumped_masses(const TetMesh& mesh, double density) {
  std::vector<double> mass(mesh.nodes.size(), 0);
  for (const Tet& t : mesh.tets)
    for (int i : t) mass[static_cast<std::size_t>(i)] += density / 4 * volume(mesh, t);
  return mass;
}

// Returns the law of the springs of a volume. In implicit steps the springs on altitudes stay those of the
// beginning of a step, and damping has to take the energy that this gives.
SpringLaw spring_law(const Solver& solver, const Material& material) {
  constexpr double least_damping = 0.01;  // of critical; with 0.003 energy falls, without any it grows
  SpringLaw law = material.springs;
  if (solver.integration == Integration::implicit) law.damping = std::max(law.damping, least_damping);
  return law;
}

// Adds a volume: its particles, the forces of it that are in the plan, and its contact points. Returns its
// drawn surface; the size of a skin without contact is added to `skins`.
BodyShape add_volume(const Scene& scene, const EffectSet& plan, const scene::DeformableBody& description,
                     const TetMesh& mesh, Bodies& bodies, std::vector<SkinSize>& skins) {
  const Material& material = material_of(scene, description);
  const std::vector<Triangle> triangles = boundary(mesh);
  const double density = description.mass ? *description.mass / volume(mesh) : material.density;
  std::vector<double> masses = lumped_masses(mesh, density);
  std::optional<BodyShape> skin;
  const bool is_drawn = description.skin && plan[index(Effect::embedded_surfaces)];
  if (is_drawn || (description.skin && (description.skin->contact || description.skin->mass)))
    skin = skinned(description, mesh, bodies.particles.size());
  if (skin && description.skin->mass) add_skin_mass(description, *skin, masses);

  duet::DeformableBody body;
  body.name = description.name;
  body.first_particle = static_cast<int>(bodies.particles.size());
  body.particle_count = static_cast<int>(mesh.nodes.size());
  body.first_tet = static_cast<int>(bodies.forces.elements.size());
  body.first_triangle = static_cast<int>(bodies.triangles.size());
  body.triangle_count = static_cast<int>(triangles.size());

  add_particles(description, plan, mesh.nodes, masses, bodies);
  std::vector<Tet> tets = mesh.tets;
  for (Tet& tet : tets)
    for (int& i : tet) i += body.first_particle;
  for (Triangle triangle : triangles) {
    for (int& i : triangle) i += body.first_particle;
    bodies.triangles.push_back(triangle);
  }
  bodies.tets.insert(bodies.tets.end(), tets.begin(), tets.end());
  const Resistance resists = resistance(description.shape, material);
  if (resists.elements && plan[index(Effect::deformable_elasticity)])
    bodies.forces.elements.add(
        tets, bodies.particles.x,
        {lame_parameters(material.youngs_modulus, material.poisson_ratio, material.damping), material.model,
         material.mass_damping, description.incompressible});
  if (resists.springs && plan[index(Effect::springs)])
    add_volume_springs(tets, spring_law(scene.solver, material), bodies);
  if (description.incompressible) bodies.nodal_volumes.add(tets, bodies.particles.x);
  body.tet_count = static_cast<int>(bodies.forces.elements.size()) - body.first_tet;
  const bool is_skin_touched = description.skin && description.skin->contact;
  if (is_skin_touched) {
    check_skin_contact(scene, description, *skin, bodies);
    add_surface_points(skin->skin, body, bodies);
  } else {
    add_surface_points(mesh, triangles, scene.solver.face_samples, 0, body, bodies);
  }
  bodies.deformable.push_back(body);

  // Smallest angle (degrees) between normals at an edge that is drawn as sharp. On a lattice, sharp edges are
  // known. On a filled surface, or on tetrahedra from a file, few triangles follow a curved part, so that
  // they meet at large angles without an edge.
  const double crease = description.shape.kind == DeformableKind::box ? 40 : 75;
  if (is_drawn && !is_skin_touched) add_skin_size(measure_skin(*skin, mesh, triangles), skins);
  if (is_drawn) {
    skin->is_touched = is_skin_touched;
    return std::move(*skin);
  }
  BodyShape shape{description.name, boundary_surface(mesh, triangles, crease)};
  shape.is_touched = !is_skin_touched;
  for (int& node : shape.surface.vertex_nodes) node += body.first_particle;
  const Shape& source = description.shape.surface;
  if (source.mesh && !source.mesh->uvs.empty())
    transfer_texture(in_frame(*source.mesh, source.scale, Pose{}), shape.surface.surface);
  return shape;
}

// Returns the mean length (m) of the edges of a body's triangles, with inner edges counted twice, and of its
// segments. For a single particle it is the diameter.
double element_size(const duet::DeformableBody& body, const Bodies& bodies) {
  const std::vector<Vec3>& x = bodies.particles.x;
  double sum = 0;
  int count = 0;
  const auto add = [&](int a, int b) {
    sum += (x[as_index(a)] - x[as_index(b)]).norm();
    ++count;
  };
  for (int t = body.first_triangle; t < body.first_triangle + body.triangle_count; ++t)
    for (std::size_t k = 0; k < 3; ++k)
      add(bodies.triangles[as_index(t)][k], bodies.triangles[as_index(t)][(k + 1) % 3]);
  for (int s = body.first_segment; s < body.first_segment + body.segment_count; ++s)
    add(bodies.segments[as_index(s)][0], bodies.segments[as_index(s)][1]);
  return count > 0 ? sum / count : body.thickness;
}

// Returns the surface by which deformable bodies touch themselves and each other.
CollisionSurface collision_surface(const Scene& scene, const Bodies& bodies) {
  CollisionSurface surface;
  for (std::size_t i = 0; i < bodies.deformable.size(); ++i) {
    const duet::DeformableBody& body = bodies.deformable[i];
    const scene::DeformableBody& description = scene.deformable[i];
    const std::span<const Triangle> triangles(bodies.triangles.data() + body.first_triangle,
                                              static_cast<std::size_t>(body.triangle_count));
    const std::span<const std::array<int, 2>> segments(bodies.segments.data() + body.first_segment,
                                                       static_cast<std::size_t>(body.segment_count));
    const double shortest = shortest_edge(bodies.particles.x, triangles, segments);
    const double thickness = description.collision_thickness.value_or(
        description.shape.is_volume()  ? default_collision_thickness * shortest
        : description.shape.is_shell() ? std::min(body.thickness, max_shell_thickness * shortest)
                                       : body.thickness);
    surface.add({collides_with_itself(description), thickness, description.collision_friction}, triangles,
                segments);
  }
  surface.finish(bodies.particles.x);
  return surface;
}

// Returns the resolution of the drawn surfaces of round bodies, in [1/3, 1], as shape_surface() takes it. The
// file of every frame holds all surfaces, and the more round bodies there are, the smaller each of them is in
// the picture. Up to 48 bodies have full resolution; from 432 on a ball has 21 columns instead of 64.
double surface_detail(const Scene& scene) {
  const auto round = std::count_if(scene.rigid.begin(), scene.rigid.end(), [](const RigidBody& body) {
    return body.shape.kind != ShapeKind::box && body.shape.kind != ShapeKind::mesh;
  });
  return std::clamp(std::sqrt(48.0 / static_cast<double>(std::max<std::ptrdiff_t>(round, 1))), 1.0 / 3, 1.0);
}

// Smallest number of sweeps of the contact projection in an implicit solve. Velocities of approach that the
// projection leaves affect only the damping in a semi-implicit solve. In an implicit solve, in which
// repulsions between surfaces are projected as well, they affect the elastic forces. More sweeps cost time.
constexpr int implicit_projection_sweeps = 10;

// Converts the solver keys of a scene to the settings of the step.
StepSettings step_settings(const Solver& solver) {
  StepSettings settings;
  settings.implicit_elasticity = solver.integration == Integration::implicit;
  settings.newton_iterations = solver.newton_iterations;
  settings.cfl = solver.cfl;
  settings.max_travel = solver.max_travel;
  settings.max_rotation = solver.max_rotation;
  settings.max_time_step = solver.max_time_step;
  settings.damping_at = solver.damping_at;
  settings.cg_tolerance = solver.cg_tolerance;
  settings.cg_iterations = solver.cg_iterations;
  settings.pressure = {solver.volume_tolerance, solver.pressure_iterations};
  settings.push_out = {.iterations = solver.push_out_iterations,
                       .sweeps = solver.push_out_sweeps,
                       .gradual = solver.push_out_gradual,
                       .rigid_pairs = solver.rigid_push_out == RigidPushOut::deepest_points,
                       .order = solver.push_out_order};
  settings.constraints_before_solve = solver.velocity_constraints == VelocityConstraints::before_solve;
  settings.projection_sweeps =
      std::max(solver.projection_iterations, settings.implicit_elasticity ? implicit_projection_sweeps : 1);
  settings.contact_reduction = solver.contact_reduction;
  settings.orientation = solver.orientation;
  settings.keep_spin = solver.keep_spin;
  settings.collision.iterations = solver.collision_iterations;
  settings.collision.orientation = solver.orientation;
  settings.contact.iterations = solver.contact_iterations;
  settings.contact.whole_islands = solver.whole_islands;
  settings.contact.shocks_everywhere = solver.shock_propagation == Switch::on;
  return settings;
}

// Excludes contact between deformable bodies and the rigid bodies that they are attached to.
void keep_apart(const Scene& scene, const EffectSet& plan, Bodies& bodies) {
  const std::vector<std::string>& names = bodies.rigid.name;
  for (std::size_t d = 0; d < scene.deformable.size(); ++d) {
    const scene::DeformableBody& body = scene.deformable[d];
    if (!plan[index(body.attach_springs ? Effect::soft_bindings : Effect::hard_bindings)]) continue;
    for (const std::string& name : body.attach)
      bodies.collision_exclusions_deformable.emplace_back(
          std::find(names.begin(), names.end(), name) - names.begin(), static_cast<int>(d));
  }
  std::sort(bodies.collision_exclusions_deformable.begin(), bodies.collision_exclusions_deformable.end());
}

// Finalizes the internal forces with the masses that bound the time step. Bound particles have no mass of
// their own; for this bound they get an equivalent mass of their rigid body. Mass-proportional damping brakes
// the mass that they had before.
void finalize_forces(Bodies& bodies) {
  std::vector<double> mass = bodies.particles.mass, inverse_mass = bodies.particles.inverse_mass;
  std::vector<double> own_mass = mass;
  std::map<std::size_t, double> equivalent;
  for (const EmbeddedParticle& bound : bodies.bound) {
    if (!equivalent.contains(bound.body))
      equivalent[bound.body] = equivalent_mass(bodies.rigid.properties[bound.body], bodies.bound, bound.body);
    mass[bound.particle] = equivalent[bound.body];
    inverse_mass[bound.particle] = 1 / mass[bound.particle];
    own_mass[bound.particle] = bound.mass;
  }
  bodies.forces.finalize(mass, inverse_mass, own_mass);
}

// Adds the joints of the scene. `frames` are the shape spaces of the rigid bodies in the coordinates of their
// shapes.
void add_joints(const Scene& scene, const EffectSet& plan, const std::vector<Pose>& frames, Bodies& bodies) {
  std::map<std::string, int> number;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) number[bodies.rigid.name[i]] = static_cast<int>(i);
  const auto start = [&](int body) {
    const auto i = static_cast<std::size_t>(body);
    return i < scene.rigid.size() ? start_of(scene.rigid[i]) : bodies.rigid.state[i].pose;
  };
  const auto in_body_space = [&](int body, const Pose& frame) {
    const Pose& space = frames[static_cast<std::size_t>(body)];
    const Pose in_shape{space.to_body(frame.position), space.orientation.conjugate() * frame.orientation};
    const auto& shape = bodies.rigid.properties[static_cast<std::size_t>(body)].shape_frame;
    return shape ? Pose{shape->to_world(in_shape.position), shape->orientation * in_shape.orientation}
                 : in_shape;
  };
  for (const scene::Joint& description : scene.joints) {
    const int parent = number.at(description.parent), child = number.at(description.child);
    duet::Joint joint = make_joint(description, plan, start(parent), start(child));
    joint.parent = parent;
    joint.child = child;
    joint.parent_frame = in_body_space(parent, joint.parent_frame);
    joint.child_frame = in_body_space(child, joint.child_frame);
    if (!joint.collides) bodies.collision_exclusions.push_back(std::minmax(parent, child));
    bodies.articulation.joints.push_back(std::move(joint));
  }
  std::sort(bodies.collision_exclusions.begin(), bodies.collision_exclusions.end());
}

// Sets the drag coefficients k (1/m) of the bodies from their terminal speeds v:
//   m k v^2 = m |g|.
// Drag carries the weight at the terminal speed. The reader rejects terminal speeds without gravity.
void add_air_drag(const Scene& scene, Bodies& bodies) {
  const auto drag = [&](const std::optional<double>& terminal_speed) {
    return terminal_speed ? scene.gravity.norm() / (*terminal_speed * *terminal_speed) : 0;
  };
  for (std::size_t i = 0; i < scene.rigid.size(); ++i)
    bodies.rigid.properties[i].air_drag = drag(scene.rigid[i].terminal_speed);
  for (std::size_t i = 0; i < scene.deformable.size(); ++i)
    bodies.deformable[i].air_drag = drag(scene.deformable[i].terminal_speed);
}

// Sets the first guess of the accelerations (m/s^2), by which the first velocity solve begins, to free fall.
void fall_freely(const Bodies& bodies, const Vec3& gravity, GeneralizedVelocity& acceleration) {
  acceleration.particle.resize(bodies.particles.size());
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    acceleration.particle[p] = is_held(bodies.particles, p) ? Vec3(Vec3::Zero()) : gravity;
  acceleration.angular.assign(bodies.rigid.size(), Vec3::Zero());
  acceleration.linear.assign(bodies.rigid.size(), gravity);
}

// Adds the rigid bodies of the scene but for its ground. Returns for each of them its shape space in the
// coordinates of its shape.
std::vector<Pose> add_rigid_bodies(const Scene& scene, const EffectSet& plan, BuiltWorld& built) {
  RigidBodies& rigid = built.world.bodies.rigid;
  Solids solids(surface_detail(scene));
  std::vector<Pose> frames;
  for (const RigidBody& body : scene.rigid) {
    const Solid& solid = solids.of(body);
    frames.push_back(solid.frame);
    const bool is_dynamic = !body.is_static && !body.is_kinematic;
    const double mass = is_dynamic ? body.mass.value_or(body.density.value_or(0) * solid.volume) : 0;
    add_rigid(rigid, body.name, solid, mass, body, body.placement);
    if (body.is_kinematic && plan[index(Effect::kinematic_motion)])
      make_kinematic(rigid, kinematic_motion(body, solid.frame));
    built.shapes.push_back({body.name, {solid.surface, {}}});
  }
  return frames;
}

// Adds the deformable bodies of the scene, with their forces, which are not finalized yet.
void add_deformable_bodies(const Scene& scene, const EffectSet& plan, BuiltWorld& built) {
  World& world = built.world;
  Bodies& bodies = world.bodies;
  TetMeshes meshes;
  for (const scene::DeformableBody& body : scene.deformable) {
    built.shapes.push_back(body.shape.is_volume()
                               ? add_volume(scene, plan, body, meshes.of(body), bodies, built.skins)
                           : body.shape.is_shell()    ? add_shell(scene, plan, body, bodies)
                           : body.shape.is_particle() ? add_particle(scene, body, bodies)
                                                      : add_rod(scene, plan, body, bodies));
    const BodyDamping damping = damping_of_last(body, material_of(scene, body), bodies);
    world.strongly_damped.push_back(damping.is_strong());
    world.damping_time.push_back(damping.time);
  }
  for (duet::DeformableBody& body : bodies.deformable) body.element_size = element_size(body, bodies);
  built.tet_meshes = meshes.sizes();
}

// Adds the half space below the ground of the scene, as the last rigid body.
void add_ground(const Ground& ground, RigidBodies& rigid) {
  Placement placement;
  placement.position = Vec3(0, ground.height, 0);
  Solid half_space;
  half_space.level_set = LevelSet::half_space();
  add_rigid(rigid, "ground", half_space, 0, ground, placement);
}

// Adds the joints of the scene, what the step keeps about them, and what contact knows about jointed bodies.
// `frames` are the shape spaces of the rigid bodies in the coordinates of their shapes.
void add_articulation(const Scene& scene, const EffectSet& plan, const std::vector<Pose>& frames,
                      World& world) {
  Bodies& bodies = world.bodies;
  add_joints(scene, plan, frames, bodies);
  find_taut_chains(bodies.articulation, bodies.rigid);
  bodies.linked = linked_bodies(bodies);
  JointStage& joints = world.context.joints;
  joints.solver.analyze(bodies.articulation, bodies.rigid);
  joints.free_motion.analyze(bodies.articulation, bodies.rigid);
  for (RigidForces* drive : {&world.last_step.joint_drive, &joints.drive})
    drive->linear = drive->angular = std::vector<Vec3>(bodies.rigid.size(), Vec3::Zero());
  world.last_step.control_angle = starting_angles(bodies.articulation, bodies.rigid);
}

// Returns the factor on the tolerance of implicit steps: sqrt(L / 1 m) for the diameter L of the smallest
// deformable body, at most 1. Small bodies move slowly, and the tolerance must be small beside their
// velocities: those of bodies of all sizes that fall and spin alike are as sqrt(g L).
double implicit_tolerance_factor(const Bodies& bodies) {
  double least = 1;  // m
  for (const duet::DeformableBody& body : bodies.deformable) {
    Eigen::AlignedBox3d box;
    for_each_particle(body, [&](std::size_t p) { box.extend(bodies.particles.x[p]); });
    if (const double diameter = box.diagonal().norm(); diameter > 0) least = std::min(least, diameter);
  }
  return std::sqrt(least);
}

// Sets the settings of the step, and what its first step reads of a last one.
void prepare_steps(const Scene& scene, const EffectSet& plan, World& world) {
  Bodies& bodies = world.bodies;
  world.plan = plan;
  world.gravity = scene.gravity;
  world.settings = step_settings(scene.solver);
  if (world.settings.implicit_elasticity) world.settings.cg_tolerance *= implicit_tolerance_factor(bodies);
  if (scene.solver.compression == Compression::damped && !world.settings.implicit_elasticity)
    bodies.forces.rely_on_damping(scene.solver.cfl, scene.solver.relaxation);
  world.settings.collision.rigid_pairs = world.has(Effect::rigid_collision);
  world.settings.contact.angular_friction = world.has(Effect::rolling_friction);
  if (world.has(Effect::self_repulsion))
    world.last_step.surface_friction.assign(bodies.particles.size(), Vec3::Zero());
  if (world.has_internal_forces() && !world.settings.implicit_elasticity) {
    fall_freely(bodies, world.gravity, world.last_step.acceleration);
    for (std::vector<double>* pressure : {&world.last_step.pressure, &world.context.pressures.next})
      pressure->assign(bodies.nodal_volumes.size(), 0.0);
  }
}

}  // namespace

BuiltWorld build_world(const Scene& scene, const EffectSet& plan) {
  BuiltWorld built;
  World& world = built.world;
  Bodies& bodies = world.bodies;
  std::vector<Pose> frames = add_rigid_bodies(scene, plan, built);
  add_deformable_bodies(scene, plan, built);
  if (plan[index(Effect::soft_bindings)]) add_soft_bindings(scene, bodies);
  take_over_masses(bodies.rigid, bodies.bound, bodies.particles);
  for (duet::DeformableBody& body : bodies.deformable)
    for_each_particle(body, [&](std::size_t p) { body.mass += bodies.particles.mass[p]; });
  world.may_crush = may_crush(bodies);
  bodies.push_back = plan[index(Effect::two_way)];
  if (plan[index(Effect::air_drag)]) add_air_drag(scene, bodies);
  finalize_forces(bodies);
  keep_apart(scene, plan, bodies);
  bodies.neighbors = neighbors(bodies.particles.size(), bodies.tets);
  bodies.faces_around = faces_around(bodies);
  bodies.nodal_volumes.finalize(bodies.particles.inverse_mass, bodies.particles.x);
  if (plan[index(Effect::self_repulsion)] || plan[index(Effect::self_collision)])
    bodies.collision_surface = collision_surface(scene, bodies);
  if (scene.ground) {
    add_ground(*scene.ground, bodies.rigid);
    frames.emplace_back();
  }
  bodies.adjoining = adjoining_bodies(bodies);
  remove_hidden_samples(bodies);
  if (plan[index(Effect::articulation)]) add_articulation(scene, plan, frames, world);
  prepare_steps(scene, plan, world);
  return built;
}

}  // namespace duet::scene
