// Defines the keys of the solver, and its presets.
#include <iterator>
#include <numbers>

#include "sim/scene/schema_parts.h"

namespace duet::scene {
namespace {

// Bounds of factors that the time step is proportional to. The smallest one takes a million times as many
// steps as 1.
const Bounds fraction_of_step{.lower = 1e-6, .upper = 1};

}  // namespace

std::vector<Key> keys(Solver& solver) {
  return {
      {"accuracy", choice(solver.accuracy, {std::begin(accuracy_names), std::end(accuracy_names)}), "", any,
       "preset of the other keys of this table, each of which can still be set"},
      {"integration", choice(solver.integration, {"semi_implicit", "implicit"}), "", any,
       "whether only damping is solved for, so that stiffness bounds the time step, or elasticity too"},
      {"newton_iterations", &solver.newton_iterations, "", between(1, 1e4),
       "bound on the iterations of an implicit solve"},
      {"cfl", &solver.cfl, "", fraction_of_step,
       "time step as a fraction of the limit that elasticity sets: that of its stability, or `relaxation`"},
      {"compression", choice(solver.compression, {"damped", "followed"}), "", any,
       "whether elements that compression stiffens are damped more or shorten the steps"},
      {"relaxation", &solver.relaxation, "", between(0, 0.25),
       "damping of tau seconds makes that limit this times tau at least; not with compression \"followed\""},
      {"max_travel", &solver.max_travel, "", fraction_of_step,
       "how far two bodies that meet may enter each other in a step, as a fraction of the smaller one's "
       "size"},
      {"max_rotation", &solver.max_rotation, "rad", between(1e-6, std::numbers::pi),
       "largest rotation of a rigid body a step; balls may turn on"},
      {"max_time_step", &solver.max_time_step, "s", positive, "largest time step"},
      {"max_substeps", &solver.max_substeps, "", between(1, 1e9),
       "time steps of a frame, after which the simulation stops and says what bounds them"},
      {"damping_at", &solver.damping_at, "", between(0.5, 1),
       "fraction of a semi-implicit step at which damping is evaluated; 0.5: as in the paper"},
      {"cg_tolerance", &solver.cg_tolerance, "m/s", positive,
       "largest residual velocity that the conjugate gradients leave"},
      {"cg_iterations", &solver.cg_iterations, "", between(1, 1e5), "bound on conjugate-gradient iterations"},
      {"collision_iterations", &solver.collision_iterations, "", between(1, 1e4),
       "sweeps over collisions (step II)"},
      {"contact_iterations", &solver.contact_iterations, "", between(1, 1e4),
       "sweeps over contacts (steps III and V.4)"},
      {"whole_islands", &solver.whole_islands, "", any,
       "whether a few rigid bodies that touch are solved for as a whole where sweeps leave an error"},
      {"volume_tolerance", &solver.volume_tolerance, "", above_up_to(0, 0.1),
       "largest error of a volume that a step leaves in incompressible bodies, relative, around a particle"},
      {"pressure_iterations", &solver.pressure_iterations, "", between(1, 1e5),
       "bound on the iterations that keep volumes (steps I.2 and V.1)"},
      {"push_out_iterations", &solver.push_out_iterations, "", between(1, 1e4),
       "times that overlaps are found and resolved (step IV.2)"},
      {"push_out_sweeps", &solver.push_out_sweeps, "", between(1, 1e4),
       "bound on the sweeps over central bodies for the overlaps found at one time"},
      {"push_out_gradual", &solver.push_out_gradual, "", any,
       "the first half of push_out_iterations removes a growing part of every overlap"},
      {"push_out_order", choice(solver.push_out_order, {"together", "levels", "frozen_levels"}), "", any,
       "central bodies of step IV.2: all, or by levels; frozen: what rests is held once its level is done"},
      {"rigid_push_out", choice(solver.rigid_push_out, {"all_contacts", "deepest_points"}), "", any,
       "between rigid bodies: all contacts at once without friction, or equations 1 and 2 of the paper"},
      {"deformable_collision", &solver.deformable_collision, "", any,
       "whether deformable bodies are kept from passing through each other and themselves"},
      {"shock_propagation", choice(solver.shock_propagation, {"auto", "on", "off"}), "", any,
       "upper bodies alone take up what contact leaves, level by level; auto: in scenes of rigid bodies"},
      {"velocity_constraints", choice(solver.velocity_constraints, {"after_solve", "before_solve"}), "", any,
       "contact and friction of step V after the implicit solve, or before it: for very large piles"},
      {"projection_iterations", &solver.projection_iterations, "", between(1, 1e3),
       "forward and backward sweeps of the contact projection in the conjugate gradients; implicit: 10 at "
       "least"},
      {"face_samples", &solver.face_samples, "", between(0, 32),
       "lattice order of contact points on deformable faces, from 2 on with their edges; 0: vertices only"},
      {"contact_reduction", &solver.contact_reduction, "", any,
       "flat faces of rigid bodies touch with the points that carry them instead of all their samples"},
      {"orientation", choice(solver.orientation, {"first_order", "second_order", "exact"}), "", any,
       "how rigid orientations are advanced: as the free body moves, or as the paper's section 4.1 does"},
      {"keep_spin", &solver.keep_spin, "", any,
       "whether deformable bodies and their bones that nothing else touches keep their spin as they move"},
      {"initial_overlap", choice(solver.initial_overlap, {"part", "refuse"}), "", any,
       "bodies that overlap at frame 0 are parted, moved as wholes before they deform, or the scene is "
       "refused"},
  };
}

Solver preset(Accuracy accuracy) {
  Solver solver;
  solver.accuracy = accuracy;
  if (accuracy == Accuracy::draft) {
    solver.cfl = 0.9;
    solver.cg_tolerance = 1e-2;
    solver.volume_tolerance = 1e-3;
    solver.contact_iterations = 10;
    solver.push_out_iterations = 2;
    solver.face_samples = 2;
  } else if (accuracy == Accuracy::fine) {
    solver.cfl = 0.175;
    solver.compression = Compression::followed;
    solver.max_travel = 0.025;
    solver.cg_tolerance = 1e-4;
    solver.volume_tolerance = 1e-6;
    solver.pressure_iterations = 400;
    solver.contact_iterations = 60;
    solver.push_out_iterations = 8;
  }
  return solver;
}

}  // namespace duet::scene
