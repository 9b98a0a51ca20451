#include "sim/simulation/simulation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/hash.h"
#include "sim/base/stop.h"
#include "sim/contact/detection/max_penetration.h"
#include "sim/contact/detection/surface_intersections.h"
#include "sim/deformable/forces/tet_strain.h"
#include "sim/scene/build/build_world.h"
#include "sim/scene/deformables.h"
#include "sim/scene/plan.h"
#include "sim/simulation/body_output.h"
#include "sim/simulation/contact_output.h"
#include "sim/simulation/drawn_overlap.h"
#include "sim/simulation/saved_state.h"
#include "sim/simulation/sizes.h"
#include "sim/simulation/steering.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Shortest step that is retried after a failure, as a fraction of the step that the rule allows; if it fails
// too, the simulation ends. Smaller values retry longer before they give up.
constexpr double min_retry = 1.0 / 64;
// Steps longer than this fraction of the rule's step may be refused as too long for joints or energy. Shorter
// ones are taken as they come out, so that refusals end before `min_retry` is reached.
constexpr double min_refused = 1.0 / 32;

}  // namespace

struct Simulation::Impl {
  scene::BuiltWorld built;
  scene::Scene scene;
  std::int64_t frame = 0;                  // current frame
  FrameStats stats;                        // of the current frame
  std::vector<unsigned char> frame_start;  // saved state of the current frame, which is the last good one
  std::vector<float> particle_strain;      // scratch: of every particle, the strain that is drawn
  // Tetrahedra of volumes that are held by springs instead of finite elements, and the inverses of their edge
  // matrices at rest (1/m).
  std::vector<Tet> spring_tets;
  std::vector<Mat3> spring_inverse_rest;
  InitialSeparation parting;                // displacements that part the bodies that overlap at frame 0
  const std::atomic<bool>* stop = nullptr;  // flag of stop_when(), or null
  // A kinematic body on the way to a target of set_target(), by its index into RigidBodies::kinematic.
  struct Aimed {
    std::size_t kinematic;
    std::int64_t frame;  // at which it gets there
  };
  std::vector<Aimed> aimed;

  World& world() { return built.world; }

  // Returns the time of a frame, s.
  double time_of(std::int64_t number) const { return static_cast<double>(number) / scene.fps; }

  // Stops the kinematic bodies that have reached their targets.
  void stop_aimed() {
    std::erase_if(aimed, [&](const Aimed& one) {
      if (one.frame > frame) return false;
      stop_body(world().bodies.rigid, one.kinematic, time_of(one.frame));
      return true;
    });
  }

  // Loads a state from outside. If it does not fit, restores the current state and throws Error.
  void load_checked(const std::vector<unsigned char>& bytes) {
    const std::vector<RigidState> before = world().bodies.rigid.state;
    unpack_state(bytes, world(), frame);
    try {
      check_state(world(), frame, before);
    } catch (const Error&) {
      unpack_state(frame_start, world(), frame);
      throw;
    }
  }

  // Adds the bodies that were pinched in the step that began at `time` (s) to the statistics of the frame.
  void add_pinches(double time) {
    const Bodies& bodies = world().bodies;
    for (const Pinch& pinch : world().context.contact.contacts.pinches) {
      const duet::DeformableBody& guest = bodies.deformable[as_index(pinch.guest_deformable)];
      const std::string &first = bodies.rigid.name[as_index(pinch.first)],
                        &second = bodies.rigid.name[as_index(pinch.second)];
      const auto known = std::find_if(stats.pinched.begin(), stats.pinched.end(), [&](const PinchStats& one) {
        return one.body == guest.name && one.first == first && one.second == second;
      });
      if (known == stats.pinched.end())
        stats.pinched.push_back({guest.name, first, second, guest.thickness, pinch.room, time});
      else
        known->room = std::min(known->room, pinch.room);
    }
  }

  // Returns whether the frame takes more steps than the scene allows. `steps` is the number of steps that
  // would follow at the current step size. It counts only after `part` of the allowed steps, because a
  // collision may shorten the first few steps alone, and only if it exceeds the allowed number by the factor
  // `sure`, so that the estimate leaves no doubt.
  bool takes_too_many(double steps) const {
    constexpr double sure = 10, part = 0.01;
    const double most = scene.solver.max_substeps;
    return stats.substeps >= most || (stats.substeps >= part * most && stats.substeps + steps > sure * most);
  }

  // Returns the time (s) of the first jump of a prescribed velocity between `time` and `end`, or `end`. A
  // jump at one of these is none between them.
  double jump_or(double end, double time) {
    if (!world().has(Effect::kinematic_motion)) return end;
    const double near = world().settings.same_time();
    const double jump = next_jump(world().bodies.rigid, time, near);
    return jump < end - near ? jump : end;
  }

  // Throws the error of a frame with too many steps. `time` and `dt` are those of the next step, s.
  [[noreturn]] void refuse_frame(double time, double dt, double steps) {
    SimulationFault fault;
    fault.stage = "time step";
    fault.time = time;
    fault.frame = static_cast<int>(frame) + 1;
    fault.substep = stats.substeps;
    fault.value = stats.substeps + steps;
    fault.bound = scene.solver.max_substeps;
    const TimeStepChoice choice = bounded_time_step(world(), time);
    fault.cause = fmt::format("the frame takes so many steps, of {:.3g} s now, bounded by {}", dt,
                              describe(choice, world().bodies));
    fault.remedy =
        "a larger `fps` or solver.max_time_step, slower motion, or bodies that are softer, coarser or "
        "heavier allow "
        "fewer; solver.max_substeps allows more";
    throw SimulationError(fault);
  }

  // Advances to the next frame. Each step is the rest of the frame, or the time to the next jump of a
  // prescribed velocity, divided into equal steps no longer than the fraction `share` of what the rule
  // allows. A step that fails or is refused is repeated with half that fraction, which doubles again after
  // each step that succeeds.
  void advance() {
    const double end = static_cast<double>(frame + 1) / scene.fps;
    double time = static_cast<double>(frame) / scene.fps;
    double share = 1;
    Refusal refusal;
    while (time < end) {
      double rule = 0;
      world().clock.time(Stage::time_step_choice, [&] { rule = choose_time_step(world(), time); });
      const double next = jump_or(end, time);
      // 1e-9 keeps rounding from adding a step where a whole number of steps fits.
      const double steps = std::max(1.0, std::ceil((next - time) / (share * rule) - 1e-9));
      const double dt = (next - time) / steps;
      if (const double all = (end - time) / (share * rule); takes_too_many(all)) refuse_frame(time, dt, all);
      try {
        refusal.is_allowed = share > min_refused;
        if (!step(world(), time, dt, &refusal)) {
          share /= 2;
          continue;
        }
      } catch (SimulationError& error) {
        restore_step_start(world());
        share /= 2;
        if (share >= min_retry) continue;
        error.fault().time = time;
        error.fault().frame = static_cast<int>(frame) + 1;
        error.fault().substep = stats.substeps;
        throw SimulationError(error.fault());
      }
      share = std::min(1.0, 2 * share);
      refusal = {};
      add_pinches(time);
      time = steps > 1 ? time + dt : next;
      ++stats.substeps;
      stats.dt_min = stats.substeps == 1 ? dt : std::min(stats.dt_min, dt);
      stats.dt_max = std::max(stats.dt_max, dt);
    }
    ++frame;
  }

  // Finds the tetrahedra of volumes that are held by springs. Must be called before anything has moved.
  void take_spring_tets() {
    const Bodies& bodies = world().bodies;
    for (std::size_t d = 0; d < scene.deformable.size(); ++d) {
      if (!scene::material_of(scene, scene.deformable[d]).has_springs) continue;
      const int first = bodies.deformable[d].first_particle,
                end = first + bodies.deformable[d].particle_count;
      std::copy_if(bodies.tets.begin(), bodies.tets.end(), std::back_inserter(spring_tets),
                   [&](const Tet& tet) { return tet[0] >= first && tet[0] < end; });
    }
    for (const Tet& tet : spring_tets)
      spring_inverse_rest.push_back(edge_matrix(tet, bodies.particles.x).inverse());
  }

  // Returns the drawn surfaces of the rigid bodies, in shape space.
  std::vector<const Surface*> rigid_surfaces() const {
    std::vector<const Surface*> found;
    for (std::size_t i = 0; i < scene.rigid.size(); ++i) found.push_back(&built.shapes[i].surface.surface);
    return found;
  }

  // Throws SceneError with one problem for each pair of bodies that overlaps at frame 0.
  [[noreturn]] void refuse_overlaps() const {
    std::vector<SceneProblem> problems;
    for (const InitialOverlap& overlap : parting.overlaps) {
      SceneProblem problem = problem_at(overlap.second);
      problem.key = "solver.initial_overlap";
      problem.message = describe(overlap) + " at frame 0";
      problem.hint = "move them apart, or have them parted with solver.initial_overlap = \"part\"";
      problems.push_back(std::move(problem));
    }
    throw SceneError(std::move(problems));
  }

  // Returns a problem with the place of a body in the scene file.
  SceneProblem problem_at(const std::string& body_name) const {
    SceneProblem problem;
    problem.file = scene.path;
    const auto locate = [&](const auto& bodies) {
      for (const auto& body : bodies)
        if (body.name == body_name)
          std::tie(problem.line, problem.column) = std::tuple(body.at.line, body.at.column);
    };
    locate(scene.rigid);
    locate(scene.deformable);
    return problem;
  }

  [[noreturn]] void refuse(const MeetingSurfaces& meeting) const {
    const std::vector<DeformableBody>& bodies = built.world.bodies.deformable;
    const std::string &first = bodies[meeting.first].name, &second = bodies[meeting.second].name;
    const Vec3& x = meeting.position;
    SceneProblem problem = problem_at(second);
    problem.key = "deformable." + second;
    problem.message =
        first == second
            ? fmt::format("parts of its surface {}, near ({:.4g}, {:.4g}, {:.4g}) m at frame 0", meeting.how,
                          x.x(), x.y(), x.z())
            : fmt::format("its surface and that of `{}` {}, near ({:.4g}, {:.4g}, {:.4g}) m at frame 0",
                          first, meeting.how, x.x(), x.y(), x.z());
    problem.hint = "leave a gap between them, or let them pass with --without self_collision";
    throw SceneError({std::move(problem)});
  }

  // Throws SceneError if surfaces of deformable bodies intersect or all but touch at frame 0, even after the
  // overlapping bodies have been parted. Leaves the state unchanged otherwise.
  void check_surfaces() {
    Bodies& bodies = world().bodies;
    const std::vector<Vec3> x = bodies.particles.x;
    const std::vector<RigidState> states = bodies.rigid.state;
    if (parting.moves()) apply(parting, world());
    const std::optional<MeetingSurfaces> meeting = find_meeting_surfaces(bodies);
    if (meeting) refuse(*meeting);
    bodies.particles.x = x;
    bodies.rigid.state = states;
  }

  // Fills the statistics that follow from the current state alone, and saves the state in `frame_start`.
  void measure_state() {
    Bodies& bodies = world().bodies;
    stats.frame = static_cast<int>(frame);
    stats.time = static_cast<double>(frame) / scene.fps;
    stats.max_penetration = max_penetration(bodies, world().contact_filter());
    if (frame == 0)
      for (const InitialOverlap& overlap : parting.overlaps)
        stats.max_penetration = std::max(stats.max_penetration, overlap.depth);
    stats.drawn_overlap = duet::drawn_overlap(built, std::nullopt);
    FiniteElements::Strain strain = bodies.forces.elements.strain(bodies.particles.x);
    take_strain(spring_tets, spring_inverse_rest, bodies.particles.x, strain);
    stats.min_det_F = strain.min_det;
    stats.inverted = strain.inverted;
    stats.max_stretch = strain.max_stretch;
    stats.volume_error = bodies.nodal_volumes.volume_error(bodies.particles.x);
    stats.kinetic = kinetic_energy(bodies);
    stats.potential = gravitational_energy(bodies, world().gravity);
    stats.elastic = world().has_internal_forces() ? bodies.forces.energy(bodies.particles.x) : 0;
    if (world().has(Effect::self_collision))
      stats.self_intersections = static_cast<std::int64_t>(self_intersections(bodies).size());
    const Momentum total = momentum(bodies);
    stats.momentum = total.linear;
    stats.angular_momentum = total.angular;
    pack_state(world(), frame, frame_start);
    stats.hash = hash_bytes(frame_start.data(), frame_start.size());
  }

  // Fills the statistics of what the steps of the frame did.
  void measure_work() {
    stats.stages.clear();
    for (const StageRow& row : stage_rows) {
      const StageClock::Entry& entry = world().clock[row.stage];
      stats.stages.push_back({std::string(row.label), entry.seconds, entry.calls});
    }
    stats.cg_iterations = world().counters.cg_iterations;
    stats.pressure_iterations = world().counters.pressure_iterations;
    stats.contacts = world().counters.contacts;
    stats.self_repulsions = world().counters.self_repulsions;
    stats.self_collisions = world().counters.self_collisions;
    stats.impact_zone_particles = world().counters.impact_zone_particles;
    if (world().ledger.is_on()) measure_ledger();
  }

  void measure_ledger() {
    const StepLedger& ledger = world().ledger;
    stats.ledger.clear();
    const auto add = [&](std::string_view name, const LedgerEntry& entry) {
      stats.ledger.push_back({std::string(name), entry.gained.linear, entry.external.linear,
                              entry.gained.angular, entry.external.angular, entry.linear_defect,
                              entry.angular_defect, entry.kinetic, entry.stored});
    };
    for (const StageRow& row : stage_rows)
      if (StepLedger::counts(row.stage)) add(row.label, ledger[row.stage]);
    add("step", ledger.whole_step());
    stats.max_mass_shift = ledger.push_out().linear_largest;
    stats.max_moment_shift = ledger.push_out().angular_largest;
  }
};

Simulation::Simulation(const scene::Scene& scene, const EffectSet& plan) : impl_(std::make_unique<Impl>()) {
  impl_->built = scene::build_world(scene, plan);
  impl_->scene = scene;
  impl_->take_spring_tets();
  check_finite(impl_->world(), "0 initial state");
  impl_->parting = separate_overlapping_bodies(impl_->world(), impl_->rigid_surfaces());
  if (scene.solver.initial_overlap == scene::OverlapPolicy::refuse && !impl_->parting.overlaps.empty())
    impl_->refuse_overlaps();
  impl_->world().settings.push_out.overlapping = impl_->parting.left;
  if (plan[index(Effect::self_collision)]) impl_->check_surfaces();
  impl_->measure_state();
  impl_->measure_work();
}

Simulation::~Simulation() = default;

int Simulation::frame() const { return static_cast<int>(impl_->frame); }
FrameStats Simulation::stats() const { return impl_->stats; }
const std::vector<InitialOverlap>& Simulation::initial_overlaps() const { return impl_->parting.overlaps; }
World& Simulation::world() { return impl_->world(); }
const World& Simulation::world() const { return impl_->world(); }

void Simulation::keep_ledger() {
  impl_->world().ledger.turn_on();
  impl_->measure_work();
}

void Simulation::hash_stages(StageHashes::Sink sink) { impl_->world().stage_hashes.turn_on(std::move(sink)); }

std::vector<BodyHashes> Simulation::state_hashes() const { return duet::state_hashes(impl_->world()); }

void Simulation::stop_when(const std::atomic<bool>* flag) { impl_->stop = flag; }

void Simulation::advance_frame() {
  Impl& impl = *impl_;
  const StopScope scope(impl.stop);
  impl.world().stage_hashes.begin_frame(frame() + 1);
  impl.world().ledger.reset();
  impl.world().contact_tally.begin_frame();
  impl.world().clock.reset();
  impl.world().counters = {};
  impl.stats.substeps = 0;
  impl.stats.pinched.clear();
  impl.stats.dt_min = impl.stats.dt_max = 0;
  const auto start = std::chrono::steady_clock::now();
  const double processor_start = loop_processor_seconds();
  try {
    impl.stop_aimed();
    if (impl.frame == 0 && impl.parting.moves()) apply(impl.parting, impl.world());
    impl.advance();
  } catch (const Error&) {
    unpack_state(impl.frame_start, impl.world(), impl.frame);
    throw;
  }
  impl.stats.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  impl.stats.processor_seconds = loop_processor_seconds() - processor_start;
  impl.world().applied.clear();
  impl.measure_state();
  impl.measure_work();
}

std::vector<unsigned char> Simulation::save_state() const { return impl_->frame_start; }

void Simulation::load_state(const std::vector<unsigned char>& bytes) {
  impl_->load_checked(bytes);
  impl_->world().contact_tally.begin_frame();  // a saved state does not tell what led to it
  impl_->measure_state();
}

void Simulation::set_target(const std::string& name, const Vec3& value) {
  aim_joint(impl_->world().bodies.articulation, name, value,
            {impl_->time_of(impl_->frame), impl_->time_of(impl_->frame + 1)});
}

void Simulation::set_target(const std::string& name, const Pose& pose) {
  const std::size_t number = aim_body(impl_->world().bodies.rigid, name, pose,
                                      {impl_->time_of(impl_->frame), impl_->time_of(impl_->frame + 1)});
  std::erase_if(impl_->aimed, [&](const Impl::Aimed& one) { return one.kinematic == number; });
  impl_->aimed.push_back({number, impl_->frame + 1});
}

void Simulation::add_force(const std::string& name, const Vec3& force, const Vec3& moment,
                           const std::optional<Vec3>& at) {
  push_body(impl_->world(), name, force, moment, at);
}

void Simulation::release(const std::string& name, std::optional<double> density) {
  const scene::Scene changed = released(impl_->scene, name, density);
  // Effects that were left out on purpose stay out.
  const EffectSet left_out = scene::plan_effects(impl_->scene).active() & ~impl_->world().plan;
  scene::BuiltWorld built = scene::build_world(changed, scene::plan_effects(changed).active() & ~left_out);
  impl_->stop_aimed();
  carry_over(impl_->world(), built.world);
  // Indices of kinematic bodies move up if one is released.
  const auto body_of = [&](const Impl::Aimed& one) {
    return impl_->world().bodies.rigid.kinematic[one.kinematic].body;
  };
  std::vector<Impl::Aimed> aimed;
  for (std::size_t k = 0; k < built.world.bodies.rigid.kinematic.size(); ++k)
    for (const Impl::Aimed& one : impl_->aimed)
      if (body_of(one) == built.world.bodies.rigid.kinematic[k].body) aimed.push_back({k, one.frame});
  impl_->aimed = std::move(aimed);
  impl_->built = std::move(built);
  impl_->scene = changed;
  impl_->measure_state();
}

void Simulation::surfaces(std::vector<BodySurface>& out) const {
  const Bodies& bodies = impl_->world().bodies;
  impl_->particle_strain.assign(bodies.particles.size(), 0);
  bodies.forces.elements.add_strain(bodies.particles.x, impl_->particle_strain);
  raise_strain(impl_->spring_tets, impl_->spring_inverse_rest, bodies.particles.x, impl_->particle_strain);
  write_surfaces(impl_->built, impl_->particle_strain, out);
}

void Simulation::rest_surfaces(std::vector<BodySurface>& out) const {
  surfaces(out);
  for (std::size_t i = 0; i < impl_->scene.rigid.size(); ++i)
    out[i].surface = impl_->built.shapes[i].surface.surface;
}

void Simulation::rigid_motion(std::vector<RigidMotion>& out) const {
  out.clear();
  for (std::size_t i = 0; i < impl_->scene.rigid.size(); ++i) {
    const RigidBodies& rigid = impl_->world().bodies.rigid;
    const RigidState& state = rigid.state[i];
    out.push_back({shape_pose(rigid, i), shape_velocity(state, rigid.properties[i]), state.angular_velocity});
  }
}

void Simulation::surface_velocities(std::vector<Vec3f>& out) const {
  write_surface_velocities(impl_->built, impl_->scene.rigid.size(), out);
}

void Simulation::surface_stress(std::vector<float>& stress, std::vector<float>& energy) const {
  const Bodies& bodies = impl_->world().bodies;
  std::vector<float> of_particles, energy_of_particles;
  bodies.forces.elements.measure_stress(bodies.particles.x, of_particles, energy_of_particles);
  write_surface_values(impl_->built, impl_->scene.rigid.size(), of_particles, stress);
  write_surface_values(impl_->built, impl_->scene.rigid.size(), energy_of_particles, energy);
}

void Simulation::contact_loads(const std::vector<BodySurface>& surfaces, ContactLoads& out) const {
  const double time = impl_->frame > 0 ? impl_->time_of(impl_->frame) - impl_->time_of(impl_->frame - 1) : 0;
  write_contact_loads(impl_->built, impl_->scene.rigid.size(), surfaces, time, out);
}

std::optional<DeepestOverlap> Simulation::drawn_overlap(double spacing) const {
  return duet::drawn_overlap(impl_->built, spacing);
}

std::vector<BodyLevelSet> Simulation::level_sets() const {
  return level_sets_of(impl_->world().bodies.rigid, impl_->scene.rigid.size());
}

WorldSizes Simulation::sizes() const {
  return sizes_of(impl_->built, impl_->parting.overlaps, impl_->time_of(impl_->frame));
}

}  // namespace duet
