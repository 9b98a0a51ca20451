#include "sim/step/stage_hashes.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "tests/support/random_state.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::stage_hashes_test {
namespace {

// Returns which quantities of which bodies have different hashes, for example "ball: velocity".
std::set<std::string> differences(const std::vector<BodyHashes>& a, const std::vector<BodyHashes>& b) {
  std::set<std::string> found;
  EXPECT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t q = 0; q < a[i].quantities.size(); ++q)
      if (a[i].quantities[q].hash != b[i].quantities[q].hash)
        found.insert(a[i].name + ": " + std::string(a[i].quantities[q].name));
  return found;
}

scene::Scene ball_on_cube() {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 1.3, 0), 0.25, 5);
  test::add_soft_box(scene, "cube", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  return scene;
}

// A change of one number, however small, changes the hash of its body and quantity and of no other.
TEST(StateHashes, NameBodyAndQuantityOfEveryChange) {
  const scene::Scene scene = ball_on_cube();
  Simulation simulation(scene, test::plan(scene));
  const std::vector<BodyHashes> before = simulation.state_hashes();
  Bodies& bodies = simulation.world().bodies;
  RigidState& ball = bodies.rigid.state[0];
  using Names = std::set<std::string>;

  ball.velocity.x() += 1e-300;
  EXPECT_EQ(differences(before, simulation.state_hashes()), Names{"ball: velocity"});
  ball.velocity.setZero();
  ball.angular_momentum.z() = 1;
  ball.pose.orientation.x() = 1e-9;
  EXPECT_EQ(differences(before, simulation.state_hashes()),
            (Names{"ball: angular momentum", "ball: orientation"}));
  ball.angular_momentum.setZero();
  ball.pose.orientation.setIdentity();
  Vec3& x = bodies.particles.x.back();
  const Vec3 there = x;
  x.y() += 1e-12;
  EXPECT_EQ(differences(before, simulation.state_hashes()), Names{"cube: positions"});
  x = there;
  bodies.particles.v[0].y() = -1;
  EXPECT_EQ(differences(before, simulation.state_hashes()), Names{"cube: velocities"});
}

// All bodies are listed, rigid ones first, and the entry without a name is that of the scene.
TEST(StateHashes, HaveAllBodiesRigidOnesFirst) {
  const scene::Scene scene = ball_on_cube();
  const Simulation simulation(scene, test::plan(scene));
  const std::vector<BodyHashes> hashes = simulation.state_hashes();
  std::vector<std::string> names;
  for (const BodyHashes& body : hashes) names.push_back(body.name);
  EXPECT_EQ(names, (std::vector<std::string>{"ball", "ground", "cube", ""}));
  EXPECT_EQ(hashes[0].quantities.size(), 4U);
  EXPECT_EQ(hashes[2].quantities.size(), 2U);
  EXPECT_EQ(hashes[3].quantities.size(), 5U);
}

// The contact cache and the accelerations from which solves begin are part of the state, and their changes
// are named.
TEST(StateHashes, OfTheSceneTellWhereSolvesBegin) {
  const scene::Scene scene = ball_on_cube();
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 6; ++i) simulation.advance_frame();
  const std::vector<BodyHashes> before = simulation.state_hashes();
  ASSERT_FALSE(simulation.world().last_step.contact_cache.empty());
  simulation.world().last_step.contact_cache[0].impulse.y() *= 2;
  simulation.world().last_step.acceleration.particle[0].x() += 1;
  EXPECT_EQ(differences(before, simulation.state_hashes()),
            (std::set<std::string>{": contact cache", ": particle accelerations"}));
}

// A copy of a StageRecord.
struct Record {
  int frame, step;
  std::string stage;
  std::vector<QuantityHashes> quantities;
};

// Returns the records of a scene's first two frames, with a change of its world before the second one.
template <class Change>
std::vector<Record> records(const scene::Scene& scene, Change&& change) {
  Simulation simulation(scene, test::plan(scene));
  std::vector<Record> result;
  simulation.hash_stages([&](const StageRecord& record) {
    result.push_back({record.frame, record.step, std::string(record.stage), record.quantities});
  });
  simulation.advance_frame();
  change(simulation.world());
  simulation.advance_frame();
  return result;
}

// Records are in the order of frames and steps, from the beginning of the first step to the end of the last.
TEST(StageHashes, FollowTheStagesOfEveryStep) {
  const std::vector<Record> all = records(ball_on_cube(), [](World&) {});
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.front().stage, "step begins");
  EXPECT_EQ(all[1].stage, "I.1 advance velocity");
  EXPECT_EQ(all.back().stage, "step ends");
  EXPECT_EQ(all.front().frame, 1);
  EXPECT_EQ(all.front().step, 1);
  EXPECT_EQ(all.back().frame, 2);
  EXPECT_GT(all.back().step, 1);
  for (std::size_t i = 1; i < all.size(); ++i)
    EXPECT_LE(std::tuple(all[i - 1].frame, all[i - 1].step), std::tuple(all[i].frame, all[i].step));
}

// Two runs of one scene have the same records.
TEST(StageHashes, OfTheSameSceneAreTheSame) {
  const std::vector<Record> a = records(ball_on_cube(), [](World&) {}),
                            b = records(ball_on_cube(), [](World&) {});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t q = 0; q < a[i].quantities.size(); ++q)
      ASSERT_EQ(a[i].quantities[q].hashes, b[i].quantities[q].hashes) << a[i].stage;
}

// The first record that differs names the step and the quantity of a change of 1e-12 m/s: that is how a
// difference between machines is found.
TEST(StageHashes, DifferFromTheStepWhereABodyWasChanged) {
  const std::vector<Record> a = records(ball_on_cube(), [](World&) {}),
                            b = records(ball_on_cube(), [](World&world) {
                              world.bodies.rigid.state[0].velocity.x() += 1e-12;
                            });
  std::size_t i = 0;
  const auto equal = [&](const Record& one, const Record& two) {
    return std::equal(one.quantities.begin(), one.quantities.end(), two.quantities.begin(),
                      [](const auto& x, const auto& y) { return x.hashes == y.hashes; });
  };
  while (i < a.size() && equal(a[i], b[i])) ++i;
  ASSERT_LT(i, a.size());
  EXPECT_EQ(a[i].frame, 2);
  EXPECT_EQ(a[i].step, 1);
  EXPECT_EQ(a[i].stage, "step begins");
  std::set<std::string_view> quantities;
  for (std::size_t q = 0; q < a[i].quantities.size(); ++q)
    if (a[i].quantities[q].hashes != b[i].quantities[q].hashes) quantities.insert(a[i].quantities[q].name);
  EXPECT_EQ(quantities, std::set<std::string_view>{"velocity"});
}

// A run with hashes of its stages has the same state as one without.
TEST(StageHashes, ChangeNoResult) {
  const scene::Scene scene = ball_on_cube();
  Simulation plain(scene, test::plan(scene)), hashed(scene, test::plan(scene));
  hashed.hash_stages([](const StageRecord&) {});
  for (Simulation* simulation : {&plain, &hashed})
    for (int i = 0; i < 3; ++i) simulation->advance_frame();
  EXPECT_EQ(plain.stats().hash, hashed.stats().hash);
}

}  // namespace
}  // namespace duet::stage_hashes_test
