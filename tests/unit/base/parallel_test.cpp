#include "sim/base/parallel.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <time.h>

namespace duet::parallel_test {
namespace {

// Restores the default number of threads after each test.
class ThreadCount : public ::testing::Test {
 protected:
  void TearDown() override { set_thread_count(0); }
};

// The number of items is prime to the chunk size, so that the last chunk is shorter.
TEST_F(ThreadCount, EveryItemIsVisitedOnce) {
  for (int threads : {1, 2, 3}) {
    set_thread_count(threads);
    std::vector<int> visits(10007, 0);
    parallel_for(visits.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), 10007);
  }
}

// The sum is that of chunks of fixed size in a fixed order. A sum in the order in which threads finish would
// differ in the last bits.
TEST_F(ThreadCount, SumsAreBitIdenticalForAnyThreadCount) {
  const auto sum = [](std::size_t begin, std::size_t end) {
    double total = 0;
    for (std::size_t i = begin; i < end; ++i)
      total += std::sin(static_cast<double>(i)) * 1e3 / (1.0 + static_cast<double>(i));
    return total;
  };
  const auto reduce = [&] {
    return parallel_reduce(std::size_t{100003}, std::size_t{128}, 0.0, sum,
                           [](double a, double b) { return a + b; });
  };
  set_thread_count(1);
  const double one = reduce();
  for (int threads : {2, 5}) {
    set_thread_count(threads);
    EXPECT_EQ(reduce(), one);
  }
  EXPECT_NEAR(one, sum(0, 100003), 1e-9);  // rounding of another order of summation
}

// parallel_sum() adds the terms of an item one after the other, as a loop over its range does. A sum of each
// item's terms that is added as a whole would round differently.
TEST_F(ThreadCount, SumsAddTermsInTheOrderOfTheirItems) {
  const auto term = [](std::size_t i) { return std::sin(static_cast<double>(i)); };
  const double sum = parallel_sum(std::size_t{10007}, std::size_t{64}, [&](std::size_t i, double& total) {
    total += term(i);
    total += 1e-3 * term(i);
  });
  const double expected = parallel_reduce(
      std::size_t{10007}, std::size_t{64}, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double total = 0;
        for (std::size_t i = begin; i < end; ++i) {
          total += term(i);
          total += 1e-3 * term(i);
        }
        return total;
      },
      [](double a, double b) { return a + b; });
  EXPECT_EQ(sum, expected);
}

// Items are in the order of the loop for any number of threads, and a second call forgets the first one. A
// list in the order in which threads finish, or one that keeps what other ranges found before, would differ.
TEST_F(ThreadCount, CollectKeepsTheOrderAndForgetsEarlierCalls) {
  CollectScratch<int> scratch;
  std::vector<int> all;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    for (const int count : {1000, 10, 0, 500}) {
      parallel_collect(static_cast<std::size_t>(count), 7, scratch, all,
                       [](std::size_t i, std::vector<int>& found) {
                         for (std::size_t k = 0; k < i % 3; ++k) found.push_back(static_cast<int>(i));
                       });
      std::vector<int> expected;
      for (int i = 0; i < count; ++i) expected.insert(expected.end(), static_cast<std::size_t>(i % 3), i);
      EXPECT_EQ(all, expected) << threads << " threads, " << count << " items";
    }
  }
}

// Calls as short as those of a time step follow each other: helper threads are still looking out for the next
// call or are already asleep. A lost or repeated chunk would show as a count other than 2000.
TEST_F(ThreadCount, ManyShortCallsLoseAndRepeatNothing) {
  for (int threads : {2, 5}) {  // 5 is more than some machines have processors
    set_thread_count(threads);
    std::vector<int> visits(64, 0);
    for (int call = 0; call < 2000; ++call)
      parallel_for(visits.size(), 1 + static_cast<std::size_t>(call) % 40,
                   [&](std::size_t begin, std::size_t end) {
                     for (std::size_t i = begin; i < end; ++i) ++visits[i];
                   });
    EXPECT_EQ(std::count(visits.begin(), visits.end(), 2000), 64);
  }
}

// A loop inside of a loop runs to its end, without a deadlock when all helpers are inside of the outer one.
TEST_F(ThreadCount, CallsFromWithinCallsAreCarriedOut) {
  set_thread_count(3);
  std::vector<int> visits(40 * 50, 0);
  parallel_for(40, 1, [&](std::size_t row, std::size_t) {
    parallel_for(50, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++visits[50 * row + i];
    });
  });
  EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), 2000);
}

// An exception of one chunk reaches the caller on any number of threads, and leaves no state that affects the
// next call.
TEST_F(ThreadCount, WhatAChunkThrowsReachesTheCaller) {
  for (int threads : {1, 3}) {
    set_thread_count(threads);
    const auto work = [](std::size_t begin, std::size_t) {
      if (begin == 30) throw std::runtime_error("chunk 30");
    };
    EXPECT_THROW(parallel_for(100, 1, work), std::runtime_error);
    EXPECT_NO_THROW(parallel_for(30, 1, work)) << "the next call is not affected";
  }
}

// Returns the processor time of this thread, s.
double own_processor_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Occupies the processor for `seconds` of its own time.
void work_for(double seconds) {
  for (const double end = own_processor_seconds() + seconds; own_processor_seconds() < end;) {
  }
}

// The clock counts the processor time of loops and not that of other threads. Processor time does not depend
// on the load of the machine, so that the bounds hold on a busy one: six chunks take at least 0.06 s
// together, and the 0.2 s of a foreign thread do not count.
TEST_F(ThreadCount, ProcessorTimeIsThatOfLoopsAlone) {
  for (int threads : {1, 3}) {
    set_thread_count(threads);
    const double before = loop_processor_seconds();
    parallel_for(6, 1, [](std::size_t, std::size_t) { work_for(0.01); });
    EXPECT_GE(loop_processor_seconds() - before, 0.06);
    const double start = loop_processor_seconds();
    std::thread other([] { work_for(0.2); });
    other.join();
    EXPECT_LT(loop_processor_seconds() - start, 0.1);
  }
}

// A loop without items calls nothing and returns.
TEST_F(ThreadCount, NothingToDoIsFine) {
  parallel_for(0, 8, [](std::size_t, std::size_t) { FAIL(); });
}

#ifdef DUET_ASSERTS
// Ranges of no items would never end.
TEST(ParallelFor, RefusesRangesOfNoItems) {
  EXPECT_DEATH(parallel_for(3, 0, [](std::size_t, std::size_t) {}), "grain > 0 does not hold");
}
#endif

}  // namespace
}  // namespace duet::parallel_test
