// The effects that a scene can call for. A stage whose effect is not in the plan is never entered.
#pragma once

#include <array>
#include <bitset>
#include <optional>
#include <string_view>

namespace duet {

enum class Effect {
  rigid_collision,           // II.1 between rigid bodies
  rigid_contact,             // III.3, V.4 between rigid bodies
  rigid_deformable_contact,  // II.1, III.3, V.4 and the projections of V.2 between a rigid and a deformable
                             // body
  deformable_elasticity,     // I.1, V.2: finite elements and their damping
  push_out,                  // IV.2 interpenetration resolution
  shock_propagation,         // III.3, V.4 between rigid bodies that rest on each other
  rolling_friction,          // III.3, V.4 moments of rolling and spinning friction
  kinematic_motion,          // rigid bodies that move as the scene prescribes
  incompressibility,         // I.2, V.1
  self_repulsion,            // I.3, V.2, V.4 between deformable surfaces that are near each other
  self_collision,            // IV no crossing of deformable surfaces, of one body or of several
  springs,                   // I.1, V.2: springs on edges and across tets, and their damping
  bending,                   // I.1, V.2: bending of shells and rods, and its damping
  two_way,                   // deformable bodies push back; left out for comparison only
  articulation,              // II.2, III.3, IV.3, V: joints between rigid bodies
  joint_limits,              // III.3, V.4: bounds of their angles and travels
  pd_control,                // III.2, V.4: joints that follow a target
  hard_bindings,             // particles of deformable bodies that rigid ones carry
  soft_bindings,             // I.1, V.2: springs that hold particles to rigid bodies
  embedded_surfaces,         // finer surfaces that are drawn in place of the tets'; no part of the step
  air_drag,                  // I, V: bodies that fall no faster than their terminal speed
};
inline constexpr int effect_count = 21;
inline constexpr std::array<std::string_view, effect_count> effect_names = {"rigid_collision",
                                                                            "rigid_contact",
                                                                            "rigid_deformable_contact",
                                                                            "deformable_elasticity",
                                                                            "push_out",
                                                                            "shock_propagation",
                                                                            "rolling_friction",
                                                                            "kinematic_motion",
                                                                            "incompressibility",
                                                                            "self_repulsion",
                                                                            "self_collision",
                                                                            "springs",
                                                                            "bending",
                                                                            "two_way",
                                                                            "articulation",
                                                                            "joint_limits",
                                                                            "pd_control",
                                                                            "hard_bindings",
                                                                            "soft_bindings",
                                                                            "embedded_surfaces",
                                                                            "air_drag"};

using EffectSet = std::bitset<effect_count>;
inline std::size_t index(Effect effect) { return static_cast<std::size_t>(effect); }
inline std::string_view name(Effect effect) { return effect_names[index(effect)]; }
inline std::optional<Effect> effect_from_name(std::string_view text) {
  for (int i = 0; i < effect_count; ++i)
    if (effect_names[static_cast<std::size_t>(i)] == text) return static_cast<Effect>(i);
  return std::nullopt;
}

}  // namespace duet
