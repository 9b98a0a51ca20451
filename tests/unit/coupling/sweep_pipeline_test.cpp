#include "sim/coupling/sweep_pipeline.h"

#include "tests/support/crowd.h"
#include <gtest/gtest.h>

namespace duet {
namespace {

using test::Crowd;
using test::random_crowd;

constexpr int to_the_end = 1000;  // sweeps

class SweepPipelines : public testing::Test {
 protected:
  ~SweepPipelines() override { set_thread_count(0); }
};

struct Sweeps {
  Crowd crowd;
  PairSchedule schedule;
  SweepPipeline pipeline;

  explicit Sweeps(Crowd c) : crowd(std::move(c)) {
    schedule.build(crowd.bodies, crowd.contacts, crowd.pairs, false);
    pipeline.build(crowd.bodies, crowd.contacts, schedule.order());
  }
};

// Static bodies and deformable ones are among them; waves are large enough for several threads.
TEST_F(SweepPipelines, GiveTheBitsOfOneSweepAfterTheOtherOnAnyNumberOfThreads) {
  const Sweeps sweeps(random_crowd(21, 400, 900));
  const Crowd& crowd = sweeps.crowd;
  for (const int count : {1, 2, 7, 20, 50}) {
    std::vector<double> expected = crowd.numbers();
    for (int sweep = 0; sweep < count; ++sweep)
      for (const int p : sweeps.schedule.order()) crowd.mix(expected, p);
    for (const int threads : {1, 3}) {
      set_thread_count(threads);
      std::vector<double> value = crowd.numbers();
      EXPECT_EQ(sweeps.pipeline.repeat(count, 0, [&](int p) { return crowd.mix(value, p); }), count);
      EXPECT_EQ(value, expected) << count << " sweeps, " << threads << " threads";
    }
  }
}

TEST_F(SweepPipelines, OverlapIntoFewerWaves) {
  const Sweeps sweeps(random_crowd(22, 400, 900));
  const int one = sweeps.pipeline.waves(1), all = sweeps.pipeline.waves(SweepPipeline::deepest);
  EXPECT_EQ(one, sweeps.schedule.waves());
  EXPECT_LT(all, SweepPipeline::deepest * one * 3 / 4);
  // No body can be in two pairs of a wave.
  std::vector<int> degree(sweeps.crowd.bodies.rigid.size() + sweeps.crowd.bodies.deformable.size(), 0);
  for (const int p : sweeps.crowd.pairs)
    for (const std::size_t node : sweeps.crowd.nodes(p)) ++degree[node];
  EXPECT_GE(all, SweepPipeline::deepest * *std::max_element(degree.begin(), degree.end()));
}

// Every sweep a pair returns half of what it did before: what counts is the last sweep, not those that lie
// over it.
TEST_F(SweepPipelines, StopAtTheToleranceOfTheLastSweep) {
  set_thread_count(1);
  for (const int pairs : {30, 200}) {
    const Sweeps sweeps(random_crowd(23, 100, pairs));
    const auto after = [&](double tolerance) {
      std::vector<double> left(test::as_index(pairs), 1);
      return sweeps.pipeline.repeat(to_the_end, tolerance,
                                    [&](int p) { return left[test::as_index(p)] /= 2; });
    };
    EXPECT_EQ(after(0.51), 1);
    EXPECT_EQ(after(0.26), pairs < 64 ? 2 : 3) << "one by one where there are few pairs";
    EXPECT_EQ(after(0.13), 3);
    EXPECT_EQ(after(0.06), pairs < 64 ? 5 : 7);
    EXPECT_EQ(after(std::ldexp(1.01, -15)), 15);
  }
}

TEST_F(SweepPipelines, TakeNoPairsAtAll) {
  Crowd crowd = random_crowd(24, 50, 100);
  crowd.pairs.clear();
  const Sweeps sweeps(std::move(crowd));
  EXPECT_EQ(sweeps.pipeline.repeat(to_the_end, 1e-9, [](int) { return 1.0; }), 1);
}

}  // namespace
}  // namespace duet
