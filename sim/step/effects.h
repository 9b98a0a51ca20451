// The effects that a scene can call for. A stage whose effect is not in the plan of the scene is never
// entered.
#pragma once

#include <array>
#include <bitset>
#include <optional>
#include <string_view>

namespace duet {

/// A force or a stage that a scene may need.
///
/// The roman numerals name the steps of the paper in which the effect acts.
enum class Effect {
  rigid_collision,           ///< II.1: collisions between rigid bodies
  rigid_contact,             ///< III.3, V.4: contact between rigid bodies
  rigid_deformable_contact,  ///< II.1, III.3, V.4, projections of V.2: contact between rigid and deformable
                             ///< bodies
  deformable_elasticity,     ///< I.1, V.2: finite elements and their damping
  push_out,                  ///< IV.2: interpenetration resolution
  shock_propagation,         ///< III.3, V.4: shock propagation between rigid bodies that rest on each other
  rolling_friction,          ///< III.3, V.4: moments of rolling and spinning friction
  kinematic_motion,          ///< all steps: rigid bodies that move as the scene prescribes
  incompressibility,         ///< I.2, V.1: pressures that keep volumes
  self_repulsion,            ///< I.3, V.2, V.4: impulses between deformable surfaces that are near each other
  self_collision,            ///< IV: no crossing of deformable surfaces, of one body or of several
  springs,                   ///< I.1, V.2: springs on edges and across tetrahedra, and their damping
  bending,                   ///< I.1, V.2: bending of shells and rods, and its damping
  two_way,                   ///< all steps: deformable bodies push rigid ones; left out for comparison only
  articulation,              ///< II.2, III.3, IV.3, V: joints between rigid bodies
  joint_limits,              ///< III.3, V.4: limits of the angles and travels of joints
  pd_control,                ///< III.2, V.4: joints that follow a target
  hard_bindings,             ///< all steps: particles of deformable bodies that rigid bodies carry
  soft_bindings,             ///< I.1, V.2: zero-length springs that hold particles to rigid bodies
  embedded_surfaces,  ///< no part of the step: finer surfaces that are drawn instead of the tetrahedra's
  air_drag,           ///< I, IV: air drag of bodies with a terminal speed
};
/// The number of effects.
inline constexpr int effect_count = 21;
/// The names of effects, in the order of Effect, as `--without` and the plan use them.
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

/// A set of effects; index() gives the bit of an effect.
using EffectSet = std::bitset<effect_count>;
/// Returns the index of an effect in EffectSet and effect_names.
inline std::size_t index(Effect effect) { return static_cast<std::size_t>(effect); }
/// Returns the name of an effect.
inline std::string_view name(Effect effect) { return effect_names[index(effect)]; }
/// Returns the effect named `text`, or nothing if no effect has that name.
inline std::optional<Effect> effect_from_name(std::string_view text) {
  for (int i = 0; i < effect_count; ++i)
    if (effect_names[static_cast<std::size_t>(i)] == text) return static_cast<Effect>(i);
  return std::nullopt;
}

}  // namespace duet
