// What a scene amounts to before it is simulated: effects, sizes, masses, time steps and warnings.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "sim/scene/plan.h"
#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"

namespace duet::scene {

// The time step that the scene allows while no body moves fast, and what it takes to fill a frame.
struct TimeStepEstimate {
  double elastic_bound = 0;  // s, stability limit of the elastic forces at rest; 0: no deformable body
  double time_step = 0;      // s
  int substeps_per_frame = 0;
};
TimeStepEstimate estimate_time_step(const Scene& scene, const WorldSizes& sizes);

/// Why a frame takes more than a thousand steps, and what allows larger ones; empty where it does not.
std::string step_warning(const Scene& scene, const WorldSizes& sizes);

/// For each drawn surface that lies farther from what touches than a hundredth of its extent, how deep it may
/// be drawn in others.
std::vector<std::string> skin_warnings(const WorldSizes& sizes);

// Heaviest to lightest dynamic body; 1 when there are none.
double mass_ratio(const WorldSizes& sizes);

// What the user should know before spending time on the scene.
std::vector<std::string> warnings(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes);

std::string explain(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes);  // for people
nlohmann::json explain_json(const Scene& scene, const EffectPlan& plan,
                            const WorldSizes& sizes);  // for programs

}  // namespace duet::scene
