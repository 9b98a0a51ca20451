// The effect plan: what a scene calls for, and why. The single place where effects are decided.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/step/effects.h"

namespace duet::scene {

inline constexpr std::string_view removed_by_user = "removed by --without";  // reason of a PlannedEffect

struct PlannedEffect {
  Effect effect;
  bool active = false;  // false when the scene does not call for it, or it was removed by --without
  std::string reason;   // "6 boxes of tets: `soft1` ..." or "no deformable body"
};

struct EffectPlan {
  std::vector<PlannedEffect> effects;  // all of them, in the order of the enum
  EffectSet active() const;
};

// `without` holds names given by --without; an unknown name throws Error(usage) with a near-miss hint.
EffectPlan plan_effects(const Scene& scene, const std::vector<std::string>& without = {});

}  // namespace duet::scene
