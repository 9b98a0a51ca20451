#include "sim/scene/plan.h"

#include <cmath>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/error.h"
#include "sim/scene/explain.h"

namespace duet::scene::plan_test {
namespace {

// Returns a scene with these numbers of bodies of each kind.
Scene scene_with(int dynamic, int fixed, int deformable, bool ground, int kinematic = 0) {
  Scene scene;
  for (int i = 0; i < dynamic + fixed; ++i) {
    RigidBody& body = scene.rigid.emplace_back();
    body.name = "rigid" + std::to_string(i);
    body.is_static = i >= dynamic;
  }
  for (int i = 0; i < kinematic; ++i) {
    RigidBody& body = scene.rigid.emplace_back();
    body.name = "driven" + std::to_string(i);
    body.is_kinematic = true;
  }
  for (int i = 0; i < deformable; ++i) {
    DeformableBody& body = scene.deformable.emplace_back();
    body.name = "soft" + std::to_string(i);
    body.material = "rubber";
  }
  if (deformable > 0) scene.materials.emplace_back().name = "rubber";
  if (ground) scene.ground.emplace();
  return scene;
}

// Returns one letter for each active effect in the order of the enum: C rigid collision, R rigid contact, D
// rigid/deformable contact, E elasticity, P interpenetration resolution (`push_out`), S shock propagation, L
// rolling friction, K kinematic motion, I incompressibility, N self-repulsion, X self-collision, M springs, B
// bending, T two-way coupling.
std::string active(const EffectPlan& plan) {
  std::string text;
  for (std::size_t i = 0; i < plan.effects.size(); ++i) {
    EXPECT_EQ(index(plan.effects[i].effect), i);
    EXPECT_FALSE(plan.effects[i].reason.empty());
    constexpr std::string_view letters = "CRDEPSLKINXMBT";
    if (plan.active()[i] && i < letters.size()) text += letters[i];
  }
  return text;
}

TEST(EffectPlan, FollowsFromTheBodies) {
  struct Case {
    int dynamic, fixed, deformable;
    bool ground;
    const char* effects;
  };
  for (const Case& c : {Case{1, 0, 0, false, ""},
                        {1, 0, 0, true, "CRP"},
                        {2, 0, 0, false, "CRP"},
                        {1, 1, 0, false, "CRP"},
                        {0, 2, 0, true, ""},
                        {0, 0, 1, false, "E"},
                        {0, 0, 1, true, "DEP"},
                        {0, 1, 1, false, "DEP"},
                        {1, 0, 1, false, "DEPT"},
                        {1, 0, 1, true, "CRDEPT"},
                        {0, 0, 2, false, "ENX"},
                        {1, 0, 3, true, "CRDEPNXT"}}) {
    SCOPED_TRACE(testing::Message() << c.dynamic << c.fixed << c.deformable << c.ground);
    EXPECT_EQ(active(plan_effects(scene_with(c.dynamic, c.fixed, c.deformable, c.ground))), c.effects);
  }
}

TEST(EffectPlan, KinematicBodiesCarryOthersButNotEachOther) {
  EXPECT_EQ(active(plan_effects(scene_with(1, 0, 0, false, 1))), "CRPK");
  EXPECT_EQ(active(plan_effects(scene_with(0, 0, 1, false, 1))), "DEPK");
  EXPECT_EQ(active(plan_effects(scene_with(0, 1, 0, true, 2))), "K");
  EXPECT_EQ(active(plan_effects(scene_with(1, 0, 0, true, 1), {"kinematic_motion"})), "CRP");
  const EffectPlan plan = plan_effects(scene_with(1, 0, 0, true, 1));
  EXPECT_EQ(
      plan.effects[0].reason,
      "1 dynamic rigid body (`rigid0`), 1 kinematic one (`driven0`) and 1 static one (`ground`) can collide");
  EXPECT_EQ(plan.effects[index(Effect::kinematic_motion)].reason,
            "the scene prescribes the motion of 1 rigid body (`driven0`)");
}

Joint joint_between(const std::string& parent, const std::string& child) {
  Joint joint;
  joint.name = parent + child;
  joint.parent = parent;
  joint.child = child;
  return joint;
}

// Bones that a joint and their flesh hold together touch neither each other nor the flesh. The plan has no
// contact until there is something else to touch.
TEST(EffectPlan, JointsAndAttachmentsKeepPairsFromTouching) {
  const auto contacts = [](const Scene& scene, const std::vector<std::string>& without = {}) {
    std::string text;
    for (const char effect : active(plan_effects(scene, without)))
      if (std::string("CRDPSLT").find(effect) != std::string::npos) text += effect;
    return text;
  };
  Scene scene = scene_with(2, 0, 1, false);
  scene.joints = {joint_between("rigid0", "rigid1")};
  scene.deformable[0].attach = {"rigid0", "rigid1"};
  EXPECT_EQ(contacts(scene), "");
  const EffectPlan plan = plan_effects(scene);
  EXPECT_EQ(plan.effects[index(Effect::rigid_contact)].reason,
            "joints hold together all of 2 dynamic rigid bodies (`rigid0`, `rigid1`)");
  EXPECT_EQ(plan.effects[index(Effect::rigid_deformable_contact)].reason,
            "the deformable body is attached to all of 2 dynamic rigid bodies (`rigid0`, `rigid1`)");

  EXPECT_EQ(contacts(scene, {"articulation"}), "CRP");
  EXPECT_EQ(contacts(scene, {"hard_bindings"}), "DPT");
  scene.deformable[0].attach_springs = AttachSprings();
  EXPECT_EQ(contacts(scene, {"hard_bindings"}), "");
  EXPECT_EQ(contacts(scene, {"soft_bindings"}), "DPT");
  scene.joints[0].collide = true;
  EXPECT_EQ(contacts(scene), "CRP");
  scene.joints[0].collide = false;
  scene.deformable[0].attach = {"rigid0"};
  EXPECT_EQ(contacts(scene), "DPT");
  EXPECT_EQ(plan_effects(scene).effects[index(Effect::rigid_deformable_contact)].reason,
            "1 deformable body (`soft0`) can touch 1 dynamic rigid body (`rigid1`)");
  scene.deformable[0].attach = {"rigid0", "rigid1"};
  scene.ground.emplace();  // The ground carries the bones and the flesh, which push on nothing that moves.
  EXPECT_EQ(contacts(scene), "CRDP");
  scene.joints.push_back(joint_between("ground", "rigid0"));
  EXPECT_EQ(plan_effects(scene).effects[index(Effect::rigid_contact)].reason,
            "1 dynamic rigid body (`rigid1`) and 1 static one (`ground`) can rest on each other");
}

TEST(EffectPlan, ShocksNeedTwoBodiesThatMayRestOnEachOther) {
  Scene scene = scene_with(2, 0, 0, true);
  scene.solver.shock_propagation = Switch::on;
  EXPECT_EQ(active(plan_effects(scene)), "CRPS");
  scene.joints = {joint_between("rigid0", "rigid1")};
  EXPECT_EQ(active(plan_effects(scene)), "CRP");
}

TEST(EffectPlan, SurfacesMeetWhereBodiesCanOrAreAskedTo) {
  const auto reason = [](const Scene& scene) {
    const PlannedEffect planned = plan_effects(scene).effects[index(Effect::self_collision)];
    return (planned.active ? "" : "off: ") + planned.reason;
  };
  Scene scene = scene_with(0, 0, 1, true);
  EXPECT_EQ(reason(scene), "off: `soft0` is the only deformable body, and its self_collision is off");
  scene.deformable[0].self_collision = true;
  EXPECT_EQ(reason(scene), "`soft0` can touch itself");
  EXPECT_EQ(active(plan_effects(scene, {"self_repulsion"})), "DEPX");
  scene.deformable.push_back(scene.deformable[0]);
  scene.deformable[1].name = "soft1";
  scene.deformable[1].self_collision = false;
  EXPECT_EQ(reason(scene),
            "2 deformable bodies (`soft0`, `soft1`) can touch each other; `soft0` can touch itself");
  scene.solver.deformable_collision = false;
  EXPECT_EQ(reason(scene), "off: solver.deformable_collision is off");
  EXPECT_EQ(reason(scene_with(2, 0, 0, true)), "off: no deformable body");
  Scene folding = scene_with(0, 0, 1, true);  // Shells and rods touch themselves unless they are told not to.
  for (const DeformableKind kind : {DeformableKind::panel, DeformableKind::knot}) {
    folding.deformable[0].shape.kind = kind;
    EXPECT_EQ(reason(folding), "`soft0` can touch itself");
  }
  folding.deformable[0].self_collision = false;
  EXPECT_EQ(reason(folding), "off: `soft0` is the only deformable body, and its self_collision is off");
}

TEST(EffectPlan, IncompressibilityIsOnIfABodyAsksForIt) {
  Scene scene = scene_with(0, 0, 1, false);
  EXPECT_EQ(plan_effects(scene).effects[index(Effect::incompressibility)].reason,
            "no deformable body is incompressible");
  scene.deformable[0].incompressible = true;
  const EffectPlan plan = plan_effects(scene);
  EXPECT_EQ(active(plan), "EI");
  EXPECT_EQ(plan.effects[index(Effect::incompressibility)].reason, "asked for by `soft0`");
  EXPECT_EQ(active(plan_effects(scene, {"incompressibility"})), "E");
}

TEST(EffectPlan, ReasonsNameBodiesAndMaterials) {
  const EffectPlan plan = plan_effects(scene_with(6, 0, 1, true));
  EXPECT_EQ(plan.effects[0].reason,
            "6 dynamic rigid bodies (`rigid0`, `rigid1`, `rigid2`, `rigid3` and 2 more) and 1 static one "
            "(`ground`) "
            "can collide");
  EXPECT_NE(plan.effects[index(Effect::deformable_elasticity)].reason.find("`soft0`"), std::string::npos);
  EXPECT_NE(plan.effects[index(Effect::deformable_elasticity)].reason.find("`rubber`"), std::string::npos);
  EXPECT_EQ(plan_effects(scene_with(1, 0, 0, false)).effects[0].reason, "`rigid0` is the only rigid body");
}

TEST(EffectPlan, WithoutRemovesAnEffect) {
  const Scene scene = scene_with(1, 0, 1, true);
  const EffectPlan plan = plan_effects(scene, {"rigid_collision"});
  EXPECT_EQ(active(plan), "RDEPT");
  EXPECT_EQ(plan.effects[0].reason, "removed by --without");
  EXPECT_EQ(active(plan_effects(scene, {"rigid_contact", "rigid_deformable_contact"})), "CE")
      << "what has no contact left has nothing to push out";
  EXPECT_EQ(plan_effects(scene_with(2, 0, 0, false), {"deformable_elasticity"}).effects[3].reason,
            "no deformable body")
      << "nothing was there to remove";
}

TEST(EffectPlan, TellsElementsSpringsAndBendingApart) {
  Scene scene = scene_with(0, 0, 1, false);
  scene.materials[0].has_springs = true;
  scene.deformable[0].self_collision = false;
  EXPECT_EQ(active(plan_effects(scene)), "M") << "a volume of springs";
  scene.deformable[0].shape.kind = DeformableKind::panel;
  EXPECT_EQ(active(plan_effects(scene)), "MB");
  scene.materials[0].has_springs = false;
  EXPECT_EQ(active(plan_effects(scene)), "EB");
  scene.materials[0].bending_factor = 0;
  EXPECT_EQ(active(plan_effects(scene)), "E");
  EXPECT_EQ(plan_effects(scene).effects[index(Effect::bending)].reason,
            "no shell and no rod that resists bending");
  scene.materials[0].has_bending_springs = true;
  scene.deformable[0].shape.kind = DeformableKind::helix;
  EXPECT_EQ(active(plan_effects(scene)), "MB") << "a rod stretches as springs do";
  EXPECT_EQ(active(plan_effects(scene, {"bending"})), "M");
}

TEST(EffectPlan, ParticlesHaveNoSurfaceAndNoForces) {
  Scene scene = scene_with(1, 0, 2, true);
  scene.deformable[0].shape.kind = DeformableKind::particle;
  EXPECT_EQ(active(plan_effects(scene)), "CRDEPT");
  scene.deformable[1].shape.kind = DeformableKind::particle;
  EXPECT_EQ(active(plan_effects(scene)), "CRDPT");
}

TEST(EffectPlan, UnknownEffectIsAUsageErrorWithAHint) {
  try {
    plan_effects(scene_with(1, 0, 0, true), {"pushout"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    EXPECT_STREQ(error.what(), "--without pushout: unknown effect (did you mean `push_out`?)");
  }
}

WorldSizes sizes_of_two() {
  WorldSizes sizes;
  sizes.rigid_dynamic = 1;
  sizes.deformable = 1;
  sizes.particles = 343;
  sizes.lightest = 10;
  sizes.heaviest = 1000;
  sizes.elastic_dt = 0.01;
  return sizes;
}

TEST(Explain, TimeStepIsTheSmallestBound) {
  Scene scene = scene_with(1, 0, 1, true);
  scene.fps = 24;
  scene.solver.cfl = 0.5;
  TimeStepEstimate estimate = estimate_time_step(scene, sizes_of_two());
  EXPECT_EQ(estimate.substeps_per_frame, 9) << "1/24 s in steps of at most 0.005 s";
  EXPECT_DOUBLE_EQ(estimate.time_step, 1.0 / 24 / 9);
  Scene implicit = scene;  // elasticity does not bound implicit steps
  implicit.solver.integration = Integration::implicit;
  EXPECT_EQ(estimate_time_step(implicit, sizes_of_two()).substeps_per_frame,
            static_cast<int>(std::ceil(1 / (24 * implicit.solver.max_time_step))));

  WorldSizes rigid_only = sizes_of_two();
  rigid_only.elastic_dt = 0;
  scene.solver.max_time_step = 1.0 / 48;
  estimate = estimate_time_step(scene, rigid_only);
  EXPECT_EQ(estimate.substeps_per_frame, 2) << "exactly two, whatever the rounding of 1/24 and 1/48";
}

TEST(Explain, WarnsOfWhatTheUserShouldKnow) {
  Scene scene = scene_with(1, 0, 1, true);
  WorldSizes sizes = sizes_of_two();
  sizes.heaviest = 1001;
  EXPECT_TRUE(warnings(scene, plan_effects(scene), sizes).empty()) << "light bodies bear heavy volumes";
  sizes.thin = 1;
  auto found = warnings(scene, plan_effects(scene), sizes);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("100.1:1"), std::string::npos) << found[0];

  Scene before = scene_with(1, 0, 1, true);
  before.solver.velocity_constraints = VelocityConstraints::before_solve;
  EXPECT_TRUE(warnings(before, {}, sizes_of_two()).empty());
  before.deformable[0].incompressible = true;
  found = warnings(before, {}, sizes_of_two());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("after_solve"), std::string::npos) << found[0];

  found = warnings(scene, plan_effects(scene, {"push_out"}), sizes_of_two());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].find("push_out is removed"), std::string::npos);

  EXPECT_NE(warnings(scene_with(0, 1, 0, true), {}, {}).at(0).find("nothing moves"), std::string::npos);
  WorldSizes driven;
  driven.rigid_kinematic = 1;
  EXPECT_TRUE(warnings(scene_with(0, 0, 0, false, 1), {}, driven).empty());
}

TEST(Explain, SaysWhatRelaxationDoesAndWhyNot) {
  Scene scene = scene_with(0, 0, 1, true);
  WorldSizes sizes = sizes_of_two();
  sizes.undamped_elastic_dt = sizes.elastic_dt;
  const auto says = [&](const std::string& what) {
    return explain(scene, plan_effects(scene), sizes).find(what) != std::string::npos;
  };
  EXPECT_FALSE(says("relaxation"));
  scene.solver.relaxation = 0.1;
  EXPECT_TRUE(says("solver.relaxation = 0.1 lifts nothing: no neo-Hookean material"));
  scene.solver.compression = Compression::followed;
  EXPECT_TRUE(says("lifts nothing: compression is \"followed\""));
  scene.solver.integration = Integration::implicit;
  EXPECT_TRUE(says("lifts nothing: elasticity is implicit"));
  scene.solver.integration = Integration::semi_implicit;
  sizes.elastic_dt = 2 * sizes.undamped_elastic_dt;
  EXPECT_TRUE(says("that of undamped materials would be 0.01 s: solver.relaxation = 0.1"));
}

TEST(Explain, TextAndJsonSayTheSame) {
  Scene scene = scene_with(2, 0, 1, true);
  scene.title = "Stack";
  scene.figure = "2";
  const EffectPlan plan = plan_effects(scene, {"push_out"});
  const std::string text = explain(scene, plan, sizes_of_two());
  const nlohmann::json json = explain_json(scene, plan, sizes_of_two());
  EXPECT_TRUE(text.starts_with("Stack (figure 2)\n"));
  EXPECT_EQ(json["title"], "Stack");
  ASSERT_EQ(json["effects"].size(), static_cast<std::size_t>(effect_count));
  for (const auto& effect : json["effects"]) {
    const std::string reason = effect["reason"];
    EXPECT_NE(text.find(effect["active"] ? reason : "off: " + reason), std::string::npos) << reason;
  }
  for (const std::string warning : json["warnings"])
    EXPECT_NE(text.find(warning), std::string::npos) << warning;
  EXPECT_EQ(json["sizes"]["particles"], 343);
  EXPECT_NE(text.find("343 particles"), std::string::npos);
  EXPECT_EQ(json["masses"]["ratio"], 100.0);
  EXPECT_NE(text.find("ratio 100:1"), std::string::npos);
  EXPECT_EQ(json["time"]["substeps_per_frame"], estimate_time_step(scene, sizes_of_two()).substeps_per_frame);
}

}  // namespace
}  // namespace duet::scene::plan_test
