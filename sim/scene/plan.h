// Derives the effect plan of a scene: which effects it calls for, and why. This is the only place where
// effects are decided.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/step/effects.h"

namespace duet::scene {

/// Reason of an effect that the scene calls for and --without removes.
inline constexpr std::string_view removed_by_user = "removed by --without";

/// One effect with the decision on it.
struct PlannedEffect {
  Effect effect;        ///< The effect.
  bool active = false;  ///< False if the scene does not call for it, or if --without removes it.
  std::string reason;   ///< Reason of the decision, such as "asked for by `ball`" or "no deformable body".
};

/// The decisions on all effects.
struct EffectPlan {
  std::vector<PlannedEffect> effects;  ///< All effects, in the order of the enum.
  EffectSet active() const;            ///< Returns the set of the active effects.
};

/// Decides which effects `scene` needs. `without` holds the names of effects to remove (--without). Throws
/// Error (usage), with a near miss as a hint, if one of them is unknown.
EffectPlan plan_effects(const Scene& scene, const std::vector<std::string>& without = {});

}  // namespace duet::scene
