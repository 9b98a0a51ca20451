// Describes a scene before it is simulated: effects, sizes, masses, time steps and warnings.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "sim/scene/plan.h"
#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"

namespace duet::scene {

/// The time step of a scene while no body moves fast.
struct TimeStepEstimate {
  /// Stability limit of the elastic forces at rest, s; 0: no deformable body, or implicit steps.
  double elastic_bound = 0;
  double time_step = 0;        ///< Time step, s, that divides a frame into equal parts.
  int substeps_per_frame = 0;  ///< Number of such steps per frame.
};
/// Estimates the time step from the elastic limit, solver.cfl, solver.max_time_step and the frame rate.
TimeStepEstimate estimate_time_step(const Scene& scene, const WorldSizes& sizes);

/// Returns a warning if a frame takes more than 1000 steps, or more than solver.max_substeps allows: the
/// reason, and the changes that allow longer steps. Otherwise returns an empty string.
std::string step_warning(const Scene& scene, const WorldSizes& sizes);

/// Returns a warning for each material of finite elements whose Poisson's ratio is so far below 0 that
/// strongly compressed elements of its model fail.
std::vector<std::string> material_warnings(const Scene& scene);

/// Returns a warning for each skin that lies farther than a hundredth of its extent from the contact surface:
/// how deep in other bodies, or how far from them, it may be drawn.
std::vector<std::string> skin_warnings(const WorldSizes& sizes);

/// Returns the ratio of the heaviest to the lightest dynamic or deformable body, 1; it is 1 if there is none.
double mass_ratio(const WorldSizes& sizes);

/// Returns what the user should know before spending time on the scene, one text for each problem.
std::vector<std::string> warnings(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes);

/// Returns the description of the scene as text for people. `further` are warnings that follow those of
/// warnings().
std::string explain(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes,
                    const std::vector<std::string>& further = {});
/// Returns the description of the scene as JSON for programs, with the same warnings.
nlohmann::json explain_json(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes,
                            const std::vector<std::string>& further = {});

}  // namespace duet::scene
