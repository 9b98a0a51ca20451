#include "sim/contact/graph/gauss_seidel_pipeline.h"

#include "tests/support/crowd.h"
#include <gtest/gtest.h>

namespace duet::gauss_seidel_pipeline_test {
namespace {

using test::Crowd;
using test::random_crowd;

constexpr int to_the_end = 1000;  // sweeps

// Restores the default number of threads after each test.
class PipelinedSweeps : public testing::Test {
 protected:
  ~PipelinedSweeps() override { set_thread_count(0); }
};

// A crowd with its coloring and its pipeline, built for the present number of threads.
struct Sweeps {
  Crowd crowd;
  PairColoring schedule;
  GaussSeidelPipeline pipeline;

  explicit Sweeps(Crowd c) : crowd(std::move(c)) {
    schedule.build(crowd.bodies, crowd.contacts, crowd.pairs);
    pipeline.build(crowd.bodies, crowd.contacts, schedule.order());
  }
};

// Parallel sweeps give the same bits as sequential ones, on any number of threads. The crowds are a row, in
// which threads share few bodies; bodies that are all in one place; and few pairs for each thread.
// Crowd::mix() depends on the order of visits, so a pair that is visited too early shows.
TEST_F(PipelinedSweeps, HasTheBitsOfSequentialSweeps) {
  for (const auto& [pairs, in_a_row] : {std::pair(900, true), {900, false}, {70, true}})
    for (const int threads : {1, 2, 3, 7}) {
      set_thread_count(threads);
      Crowd placed = random_crowd(21, 400, pairs);
      for (std::size_t i = 0; i < placed.bodies.rigid.size() && in_a_row; ++i)
        placed.bodies.rigid.state[i].pose.position.z() = static_cast<double>(i);
      const Sweeps sweeps(std::move(placed));
      const Crowd& crowd = sweeps.crowd;
      for (const int count : {1, 2, 7, 20, 50}) {
        std::vector<double> expected = crowd.numbers();
        for (int sweep = 0; sweep < count; ++sweep)
          for (const int p : sweeps.schedule.order()) crowd.mix(expected, p);
        std::vector<double> value = crowd.numbers();
        EXPECT_EQ(sweeps.pipeline.repeat(count, 0, [&](int p) { return crowd.mix(value, p); }), count);
        EXPECT_EQ(value, expected) << pairs << " pairs, " << count << " sweeps, " << threads << " threads";
      }
      std::vector<double> expected = crowd.numbers(), value = expected;
      for (const int p : sweeps.schedule.order()) crowd.mix(expected, p);
      sweeps.pipeline.once([&](int p) { crowd.mix(value, p); });
      EXPECT_EQ(value, expected) << threads << " threads, once";
    }
}

// A hundred short runs follow each other as in time steps, and each starts from a clean state.
TEST_F(PipelinedSweeps, StartsEveryRunAfresh) {
  set_thread_count(2);
  const Sweeps sweeps(random_crowd(25, 200, 400));
  std::vector<double> expected = sweeps.crowd.numbers(), value = expected;
  for (int run = 0; run < 100; ++run) {
    for (const int p : sweeps.schedule.order()) sweeps.crowd.mix(expected, p);
    sweeps.pipeline.once([&](int p) { sweeps.crowd.mix(value, p); });
  }
  EXPECT_EQ(value, expected);
}

// Every visit of a pair returns half of the value before, so sweep k returns 2^-k. The tolerance is compared
// with the last sweep alone, after 1, 3, 7, 15 ... sweeps, or after each sweep if there are few pairs.
TEST_F(PipelinedSweeps, StopAtTheToleranceOfTheLastSweep) {
  for (const auto& [pairs, threads] : {std::pair(30, 1), {30, 2}, {200, 1}, {200, 2}}) {
    set_thread_count(threads);
    const Sweeps sweeps(random_crowd(23, 100, pairs));
    const auto after = [&](double tolerance) {
      std::vector<double> left(as_index(pairs), 1);
      return sweeps.pipeline.repeat(to_the_end, tolerance, [&](int p) { return left[as_index(p)] /= 2; });
    };
    EXPECT_EQ(after(0.51), 1);
    EXPECT_EQ(after(0.26), pairs < 64 ? 2 : 3) << "one by one where there are few pairs";
    EXPECT_EQ(after(0.13), 3);
    EXPECT_EQ(after(0.06), pairs < 64 ? 5 : 7);
    EXPECT_EQ(after(std::ldexp(1.01, -15)), 15);
  }
}

// Without pairs the first sweep ends the loop.
TEST_F(PipelinedSweeps, TakeNoPairsAtAll) {
  Crowd crowd = random_crowd(24, 50, 100);
  crowd.pairs.clear();
  const Sweeps sweeps(std::move(crowd));
  EXPECT_EQ(sweeps.pipeline.repeat(to_the_end, 1e-9, [](int) { return 1.0; }), 1);
}

}  // namespace
}  // namespace duet::gauss_seidel_pipeline_test
