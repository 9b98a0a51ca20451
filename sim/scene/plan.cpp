#include "sim/scene/plan.h"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/near_miss.h"
#include "sim/base/wording.h"
#include "sim/scene/deformables.h"

namespace duet::scene {
namespace {

constexpr std::size_t names_shown = 4;  // in a reason, before the others are counted

// Returns names as text: "`a`, `b`, `c`, `d` and 3 more".
std::string listed(const std::vector<std::string>& names) {
  const std::size_t shown = std::min(names.size(), names_shown);
  std::string text = fmt::format(
      "`{}`", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), "`, `"));
  if (names.size() > shown) text += fmt::format(" and {} more", names.size() - shown);
  return text;
}

// Names of the bodies of a scene by kind.
struct Bodies {
  std::vector<std::string> dynamic, kinematic, deformable;
  std::vector<std::string> fixed;  // static rigid bodies and the ground
  // Number of the rigid bodies that impulses do not move.
  std::size_t immovable() const { return kinematic.size() + fixed.size(); }
};

Bodies sort_bodies(const Scene& scene) {
  Bodies bodies;
  for (const RigidBody& body : scene.rigid)
    (body.is_static      ? bodies.fixed
     : body.is_kinematic ? bodies.kinematic
                         : bodies.dynamic)
        .push_back(body.name);
  if (scene.ground) bodies.fixed.emplace_back("ground");
  for (const DeformableBody& body : scene.deformable) bodies.deformable.push_back(body.name);
  return bodies;
}

// The pairs that contact excludes: bodies that a joint holds together, unless it lets them collide, and
// deformable bodies with the rigid bodies that they are attached to. Joints and bindings that --without
// removes (`removed`) exclude nothing.
class Exclusions {
 public:
  Exclusions(const Scene& scene, const EffectSet& removed) {
    if (!removed[index(Effect::articulation)])
      for (const Joint& joint : scene.joints)
        if (!joint.collide) pairs_.insert(std::minmax(joint.parent, joint.child));
    for (const DeformableBody& body : scene.deformable) {
      if (removed[index(body.attach_springs ? Effect::soft_bindings : Effect::hard_bindings)]) continue;
      for (const std::string& name : body.attach) pairs_.insert(std::minmax(name, body.name));
    }
  }
  bool may_touch(const std::string& a, const std::string& b) const {
    return a != b && (pairs_.empty() || !pairs_.contains(std::minmax(a, b)));
  }
  bool may_touch(const std::string& a, const std::vector<std::string>& others) const {
    return std::any_of(others.begin(), others.end(), [&](const std::string& b) { return may_touch(a, b); });
  }
  bool may_touch(const std::vector<std::string>& some, const std::vector<std::string>& others) const {
    return std::any_of(some.begin(), some.end(), [&](const std::string& a) { return may_touch(a, others); });
  }

  // Returns the rigid bodies that may touch another rigid body, where at least one of the two is dynamic.
  Bodies that_meet(const Bodies& bodies) const {
    Bodies met = bodies;
    std::erase_if(met.dynamic, [&](const std::string& a) {
      return !may_touch(a, bodies.dynamic) && !may_touch(a, bodies.kinematic) && !may_touch(a, bodies.fixed);
    });
    for (std::vector<std::string>* others : {&met.kinematic, &met.fixed})
      std::erase_if(*others, [&](const std::string& a) { return !may_touch(a, bodies.dynamic); });
    return met;
  }
  // Returns the rigid and the deformable bodies that may touch a body of the other kind.
  Bodies that_meet_deformable(const Bodies& bodies) const {
    Bodies met = bodies;
    for (std::vector<std::string>* rigid : {&met.dynamic, &met.kinematic, &met.fixed})
      std::erase_if(*rigid, [&](const std::string& a) { return !may_touch(a, bodies.deformable); });
    std::erase_if(met.deformable, [&](const std::string& a) {
      return !may_touch(a, bodies.dynamic) && !may_touch(a, bodies.kinematic) && !may_touch(a, bodies.fixed);
    });
    return met;
  }

 private:
  std::set<std::pair<std::string, std::string>> pairs_;
};

// Returns the rigid bodies, of which there must be one, as text:
// "3 dynamic rigid bodies (`a`, `b`, `c`), 1 kinematic one (`wheel`) and 1 static one (`ground`)".
std::string rigid_text(const Bodies& bodies) {
  std::vector<std::string> parts;
  const auto add = [&](const std::vector<std::string>& names, std::string_view kind) {
    if (names.empty()) return;
    const bool one = names.size() == 1, first = parts.empty();
    const std::string_view noun = first ? (one ? "rigid body" : "rigid bodies") : (one ? "one" : "ones");
    parts.push_back(fmt::format("{} {} {} ({})", names.size(), kind, noun, listed(names)));
  };
  add(bodies.dynamic, "dynamic");
  add(bodies.kinematic, "kinematic");
  add(bodies.fixed, "static");
  const std::string last = parts.back();
  parts.pop_back();
  return parts.empty() ? last : fmt::format("{} and {}", fmt::join(parts, ", "), last);
}

std::string deformable_text(const Bodies& bodies) {
  return fmt::format("{} ({})", counted(bodies.deformable.size(), "deformable body", "deformable bodies"),
                     listed(bodies.deformable));
}

// Decides on an effect between rigid bodies; `verb` says in the reason what they can do.
PlannedEffect rigid_pairs(Effect effect, const Bodies& bodies, const Exclusions& exclusions,
                          std::string_view verb) {
  if (bodies.dynamic.empty()) return {effect, false, "no dynamic rigid body"};
  if (bodies.dynamic.size() + bodies.immovable() < 2)
    return {effect, false, fmt::format("`{}` is the only rigid body", bodies.dynamic.front())};
  const Bodies met = exclusions.that_meet(bodies);
  if (met.dynamic.empty())
    return {effect, false, fmt::format("joints hold together all of {}", rigid_text(bodies))};
  return {effect, true, fmt::format("{} {}", rigid_text(met), verb)};
}

PlannedEffect rigid_deformable_pairs(const Bodies& bodies, const Exclusions& exclusions) {
  const Effect effect = Effect::rigid_deformable_contact;
  if (bodies.deformable.empty()) return {effect, false, "no deformable body"};
  if (bodies.dynamic.empty() && bodies.immovable() == 0)
    return {effect, false, "no rigid body and no ground"};
  const Bodies met = exclusions.that_meet_deformable(bodies);
  if (met.deformable.empty())
    return {
        effect, false,
        fmt::format("{} attached to all of {}",
                    bodies.deformable.size() == 1 ? "the deformable body is" : "all deformable bodies are",
                    rigid_text(bodies))};
  return {effect, true, fmt::format("{} can touch {}", deformable_text(met), rigid_text(met))};
}

// The deformable bodies that one kind of force holds together, and descriptions of their materials.
struct Resisting {
  std::vector<std::string> bodies, materials;
};

// Finds the deformable bodies that forces of one kind, a member of Resistance, hold together.
template <class Describe>
Resisting resisting(const Scene& scene, bool Resistance::*kind, Describe&& describe) {
  Resisting found;
  for (const DeformableBody& body : scene.deformable) {
    const Material& material = material_of(scene, body);
    if (!(resistance(body.shape, material).*kind)) continue;
    found.bodies.push_back(body.name);
    const std::string text = describe(material);
    if (std::find(found.materials.begin(), found.materials.end(), text) == found.materials.end())
      found.materials.push_back(text);
  }
  return found;
}

PlannedEffect resistance_effect(Effect effect, const Scene& scene, const Resisting& resisting,
                                std::string_view none) {
  if (scene.deformable.empty()) return {effect, false, "no deformable body"};
  if (resisting.bodies.empty()) return {effect, false, std::string(none)};
  return {
      effect, true,
      fmt::format("{} ({}) of {}", counted(resisting.bodies.size(), "deformable body", "deformable bodies"),
                  listed(resisting.bodies), fmt::join(resisting.materials, "; "))};
}

std::string modulus_text(const Material& material) {
  return fmt::format("`{}`, Young's modulus {:.4g} Pa", material.name, material.youngs_modulus);
}

PlannedEffect elasticity(const Scene& scene) {
  return resistance_effect(Effect::deformable_elasticity, scene,
                           resisting(scene, &Resistance::elements, modulus_text),
                           "no deformable body is made of finite elements");
}

PlannedEffect springs(const Scene& scene) {
  const auto text = [](const Material& material) {
    return material.has_springs
               ? fmt::format("`{}`, springs of {:.4g} N", material.name, material.springs.stiffness)
               : modulus_text(material);
  };
  return resistance_effect(Effect::springs, scene, resisting(scene, &Resistance::springs, text),
                           "no rod and no material with springs");
}

PlannedEffect bending(const Scene& scene) {
  const auto text = [](const Material& material) {
    return material.has_bending_springs
               ? fmt::format("`{}`, bending springs of {:.4g} N", material.name,
                             material.bending_springs.stiffness)
               : fmt::format("{}, {:.4g} times", modulus_text(material), material.bending_factor);
  };
  return resistance_effect(Effect::bending, scene, resisting(scene, &Resistance::bending, text),
                           "no shell and no rod that resists bending");
}

PlannedEffect push_out(const std::vector<PlannedEffect>& effects) {
  std::vector<std::string> contacts;
  for (const Effect contact : {Effect::rigid_contact, Effect::rigid_deformable_contact})
    if (effects[index(contact)].active) contacts.emplace_back(name(contact));
  if (contacts.empty()) return {Effect::push_out, false, "no contact"};
  return {Effect::push_out, true,
          fmt::format("resolves what {} leave{} overlapping", fmt::join(contacts, " and "),
                      contacts.size() == 1 ? "s" : "")};
}

// Returns the dynamic rigid bodies that no joint and no flesh holds to other bodies.
std::vector<std::string> loose_bodies(const Scene& scene) {
  std::set<std::string> held;
  for (const Joint& joint : scene.joints) held.insert({joint.parent, joint.child});
  for (const DeformableBody& body : scene.deformable)
    for (const std::string& bone : body.attach) held.insert(bone);
  std::vector<std::string> loose;
  for (const RigidBody& body : scene.rigid)
    if (!body.is_static && !body.is_kinematic && held.count(body.name) == 0) loose.push_back(body.name);
  return loose;
}

PlannedEffect shock_propagation(const Scene& scene, const Bodies& bodies, const Exclusions& exclusions,
                                bool contact) {
  const Effect effect = Effect::shock_propagation;
  const Switch wish = scene.solver.shock_propagation;
  if (wish == Switch::off) return {effect, false, "solver.shock_propagation is off"};
  if (!contact) return {effect, false, "no contact between rigid bodies"};
  if (!exclusions.may_touch(bodies.dynamic, bodies.dynamic))
    return {effect, false, "no two dynamic rigid bodies can rest on each other"};
  if (bodies.immovable() == 0) return {effect, false, "no static or kinematic body to rest on"};
  if (wish == Switch::on) return {effect, true, "solver.shock_propagation is on"};
  const std::vector<std::string> loose = loose_bodies(scene);
  if (loose.size() < 2)
    return {effect, false, "joints and flesh hold the rigid bodies together, which shocks would take apart"};
  if (scene.joints.empty() && bodies.deformable.empty())
    return {effect, true, fmt::format("{} can pile up", rigid_text(bodies))};
  return {effect, true,
          fmt::format("{} can pile up, where joints or deformable bodies do not hold them", listed(loose))};
}

PlannedEffect rolling_friction(const Scene& scene, bool contact) {
  const Effect effect = Effect::rolling_friction;
  std::vector<std::string> names;
  const auto ask = [&](const auto& body, const std::string& name) {
    if (body.rolling_friction > 0 || body.spinning_friction > 0) names.push_back(name);
  };
  for (const RigidBody& body : scene.rigid) ask(body, body.name);
  if (scene.ground) ask(*scene.ground, "ground");
  if (names.empty()) return {effect, false, "no body with rolling_friction or spinning_friction"};
  if (!contact) return {effect, false, "no contact between rigid bodies"};
  return {effect, true, fmt::format("asked for by {}", listed(names))};
}

PlannedEffect kinematic_motion(const Bodies& bodies) {
  const Effect effect = Effect::kinematic_motion;
  if (bodies.kinematic.empty()) return {effect, false, "no rigid body has a motion"};
  return {
      effect, true,
      fmt::format("the scene prescribes the motion of {} ({})",
                  counted(bodies.kinematic.size(), "rigid body", "rigid bodies"), listed(bodies.kinematic))};
}

PlannedEffect incompressibility(const Scene& scene) {
  const Effect effect = Effect::incompressibility;
  std::vector<std::string> names;
  for (const DeformableBody& body : scene.deformable)
    if (body.incompressible) names.push_back(body.name);
  if (names.empty()) return {effect, false, "no deformable body is incompressible"};
  return {effect, true, fmt::format("asked for by {}", listed(names))};
}

// Decides on an effect between surfaces of deformable bodies.
PlannedEffect between_surfaces(Effect effect, const Scene& scene, const Bodies& bodies) {
  if (bodies.deformable.empty()) return {effect, false, "no deformable body"};
  if (!scene.solver.deformable_collision) return {effect, false, "solver.deformable_collision is off"};
  std::vector<std::string> surfaces, folding;
  for (const DeformableBody& body : scene.deformable) {
    if (!body.shape.is_particle()) surfaces.push_back(body.name);
    if (collides_with_itself(body)) folding.push_back(body.name);
  }
  if (surfaces.empty()) return {effect, false, "no deformable body with a surface"};
  std::vector<std::string> reasons;
  if (surfaces.size() > 1)
    reasons.push_back(fmt::format("{} ({}) can touch each other",
                                  counted(surfaces.size(), "deformable body", "deformable bodies"),
                                  listed(surfaces)));
  if (!folding.empty())
    reasons.push_back(
        fmt::format("{} can touch {}", listed(folding), folding.size() == 1 ? "itself" : "themselves"));
  if (reasons.empty())
    return {effect, false,
            fmt::format("`{}` is the only deformable body, and its self_collision is off", surfaces.front())};
  return {effect, true, fmt::format("{}", fmt::join(reasons, "; "))};
}

PlannedEffect two_way(const Bodies& bodies, const Exclusions& exclusions, bool contact) {
  const Effect effect = Effect::two_way;
  if (!contact) return {effect, false, "no contact between rigid and deformable bodies"};
  Bodies met = bodies;
  met.kinematic.clear();
  met.fixed.clear();
  met = exclusions.that_meet_deformable(met);
  if (met.dynamic.empty())
    return {effect, false, "no rigid body that deformable ones could push by touching it"};
  return {effect, true, fmt::format("{} push back on {}", deformable_text(met), listed(met.dynamic))};
}

PlannedEffect articulation(const Scene& scene) {
  const Effect effect = Effect::articulation;
  std::vector<std::string> names;
  for (const Joint& joint : scene.joints) names.push_back(joint.name);
  if (names.empty()) return {effect, false, "no joint"};
  return {effect, true, fmt::format("{} ({})", counted(names.size(), "joint"), listed(names))};
}

// Decides on an effect that some joints ask for: asks(joint) says which. `none` is the reason if there is
// none.
template <class Asks>
PlannedEffect joint_effect(Effect effect, const Scene& scene, bool articulated, Asks&& asks,
                           std::string_view none) {
  std::vector<std::string> names;
  for (const Joint& joint : scene.joints)
    if (asks(joint)) names.push_back(joint.name);
  if (names.empty()) return {effect, false, std::string(none)};
  if (!articulated) return {effect, false, "no articulation"};
  return {effect, true, fmt::format("asked for by {}", listed(names))};
}

// Decides on an effect that some deformable bodies ask for: asks(body) says which. `none` is the reason if
// there is none.
template <class Asks>
PlannedEffect asked_for(Effect effect, const Scene& scene, Asks&& asks, std::string_view none) {
  std::vector<std::string> names;
  for (const DeformableBody& body : scene.deformable)
    if (asks(body)) names.push_back(body.name);
  if (names.empty()) return {effect, false, std::string(none)};
  return {effect, true, fmt::format("asked for by {}", listed(names))};
}

PlannedEffect air_drag(const Scene& scene) {
  std::vector<std::string> names;
  for (const RigidBody& body : scene.rigid)
    if (body.terminal_speed) names.push_back(body.name);
  for (const DeformableBody& body : scene.deformable)
    if (body.terminal_speed) names.push_back(body.name);
  if (names.empty()) return {Effect::air_drag, false, "no body has a terminal_speed"};
  return {Effect::air_drag, true, fmt::format("asked for by {}", listed(names))};
}

// Returns the effects that --without names.
EffectSet removed_effects(const std::vector<std::string>& without) {
  EffectSet removed;
  for (const std::string& word : without) {
    const std::optional<Effect> effect = effect_from_name(word);
    if (!effect)
      throw Error(ExitStatus::usage,
                  fmt::format("--without {}: unknown effect ({})", word,
                              did_you_mean(word, {effect_names.begin(), effect_names.end()})));
    removed.set(index(*effect));
  }
  return removed;
}

}  // namespace

EffectSet EffectPlan::active() const {
  EffectSet set;
  for (const PlannedEffect& planned : effects) set.set(index(planned.effect), planned.active);
  return set;
}

EffectPlan plan_effects(const Scene& scene, const std::vector<std::string>& without) {
  const EffectSet removed = removed_effects(without);
  const Bodies bodies = sort_bodies(scene);
  const Exclusions exclusions(scene, removed);
  EffectPlan plan;
  const auto add = [&](PlannedEffect planned) {  // must be called in the order of the enum
    if (planned.active && removed[index(planned.effect)])
      planned = {planned.effect, false, std::string(removed_by_user)};
    plan.effects.push_back(std::move(planned));
  };
  add(rigid_pairs(Effect::rigid_collision, bodies, exclusions, "can collide"));
  add(rigid_pairs(Effect::rigid_contact, bodies, exclusions, "can rest on each other"));
  add(rigid_deformable_pairs(bodies, exclusions));
  add(elasticity(scene));
  add(push_out(plan.effects));  // depends on the contact effects that --without leaves
  const bool contact = plan.effects[index(Effect::rigid_contact)].active;
  add(shock_propagation(scene, bodies, exclusions, contact));
  add(rolling_friction(scene, contact));
  add(kinematic_motion(bodies));
  add(incompressibility(scene));
  add(between_surfaces(Effect::self_repulsion, scene, bodies));
  add(between_surfaces(Effect::self_collision, scene, bodies));
  add(springs(scene));
  add(bending(scene));
  add(two_way(bodies, exclusions, plan.effects[index(Effect::rigid_deformable_contact)].active));
  add(articulation(scene));
  const bool articulated = plan.effects.back().active;
  add(joint_effect(
      Effect::joint_limits, scene, articulated,
      [](const Joint& joint) {
        return joint.angle.least || joint.angle.most || joint.travel.least || joint.travel.most ||
               joint.swing;
      },
      "no joint with bounds"));
  add(joint_effect(
      Effect::pd_control, scene, articulated, [](const Joint& joint) { return joint.has_control; },
      "no joint is controlled"));
  add(asked_for(
      Effect::hard_bindings, scene,
      [](const DeformableBody& body) { return !body.attach.empty() && !body.attach_springs; },
      "no deformable body is attached to rigid ones"));
  add(asked_for(
      Effect::soft_bindings, scene,
      [](const DeformableBody& body) { return body.attach_springs.has_value(); },
      "no deformable body is attached to rigid ones by springs"));
  add(asked_for(
      Effect::embedded_surfaces, scene, [](const DeformableBody& body) { return body.skin.has_value(); },
      "no deformable body is made of a mesh or has a skin"));
  add(air_drag(scene));
  return plan;
}

}  // namespace duet::scene
