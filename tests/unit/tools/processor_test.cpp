// Tests of the check of the processor when a program starts, and of the choice among the programs of a
// portable build.
#include "tools/processor/processor.h"

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/restart/program.h"
#include "tests/support/environment.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::processor::processor_test {
namespace {

namespace fs = std::filesystem;
using test::Finished;

constexpr FeatureSet everything = ~FeatureSet{0};

using test::contains;

// Returns the sentence about the features that `present` lacks, or an empty string.
std::string lack(FeatureSet required, FeatureSet present) {
  char text[sentence_size];
  return describe_lack("build/test_unit", required, present, text) ? text : std::string();
}

// Returns the sentence with which the launcher refuses `wanted`.
std::string refusal(const char* wanted, FeatureSet present) {
  char text[sentence_size];
  describe_refusal(wanted, choose(wanted, present), present, text);
  return text;
}

TEST(Processor, LevelsContainTheLowerOnes) {
  EXPECT_EQ(features_of_level(1), 0U);
  for (int level = 1; level <= 4; ++level) {
    EXPECT_EQ(level_of(features_of_level(level)), level);
    EXPECT_EQ(level_of(everything), 4);
    if (level == 1) continue;
    const FeatureSet lower = features_of_level(level - 1), set = features_of_level(level);
    EXPECT_EQ(lower & set, lower);
    for (int bit = 0; bit < 64; ++bit) {  // Without any one of its own features, a level is not reached.
      const FeatureSet one = FeatureSet{1} << bit;
      if ((set & ~lower & one) == 0) continue;
      EXPECT_EQ(level_of(everything & ~one), level - 1) << bit;
    }
  }
  EXPECT_STREQ(level_name(1), "x86-64");
  EXPECT_STREQ(level_name(4), "x86-64-v4");
}

TEST(Processor, NothingIsSaidWhereNothingIsLacking) {
  EXPECT_EQ(lack(0, 0), "");
  EXPECT_EQ(lack(features_of_level(3), features_of_level(3)), "");
  EXPECT_EQ(lack(features_of_level(3), everything), "");
}

TEST(Processor, MissingFeaturesAreNamedInASentence) {
  EXPECT_EQ(
      lack(features_of_level(4), features_of_level(3)),
      "test_unit: this processor lacks AVX512F, AVX512BW, AVX512CD, AVX512DQ and AVX512VL, which the program "
      "was compiled for; build it on this machine, or with -DDUET_PORTABLE=ON for every x86-64 processor");
  EXPECT_TRUE(contains(lack(features_of_level(4), features_of_level(2)),
                       " lacks AVX, AVX2, BMI, BMI2 and 9 more extensions, which"));
  const FeatureSet lowest = features_of_level(2) & (~features_of_level(2) + 1);
  EXPECT_TRUE(contains(lack(features_of_level(2), features_of_level(2) & ~lowest), " lacks CX16, which"));
  const std::string longest = lack(everything, 0);
  EXPECT_TRUE(longest.ends_with("every x86-64 processor")) << longest;
}

TEST(Processor, TheBestCodeThatRunsIsChosen) {
  const int best[] = {1, 1, 3, 4};  // A portable program has no code for level 2.
  for (int level = 1; level <= 4; ++level)
    for (const char* nothing : {static_cast<const char*>(nullptr), ""}) {
      const Choice choice = choose(nothing, features_of_level(level));
      EXPECT_EQ(choice.level, best[level - 1]);
      EXPECT_FALSE(choice.lacking);
    }
}

TEST(Processor, TheCodeAskedForIsChosen) {
  for (const int level : portable_levels) {
    EXPECT_EQ(choose(level_name(level), everything).level, level);
    EXPECT_FALSE(choose(level_name(level), everything).lacking);
    EXPECT_EQ(choose(level_name(level), features_of_level(2)).lacking, level > 2);
  }
  for (const char* unknown : {"x86-64-v2", "x86-64-v", "x86-64-v33", "native", " "})
    EXPECT_EQ(choose(unknown, everything).level, 0) << unknown;
}

TEST(Processor, RefusalsNameWhatThereIs) {
  EXPECT_EQ(refusal("avx2", everything),
            "duet: DUET_ISA=avx2 names no code of this program; it has x86-64, x86-64-v3 and x86-64-v4");
  EXPECT_EQ(
      refusal("x86-64-v4", features_of_level(3)),
      "duet: DUET_ISA=x86-64-v4: this processor lacks AVX512F, AVX512BW, AVX512CD, AVX512DQ and AVX512VL; it "
      "runs x86-64 and x86-64-v3");
  EXPECT_TRUE(refusal("x86-64-v3", 0).ends_with("; it runs x86-64"));
  EXPECT_LT(refusal(std::string(5000, 'x').c_str(), everything).size(), 150U);
}

// This program runs, so its processor has all features that the program needs.
TEST(Processor, ThisOneRunsWhatTheTestsWereCompiledFor) {
  EXPECT_EQ(required_features & ~present_features(), 0U);
#if defined(__x86_64__)
  int level = 1;
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && defined(__AVX512DQ__) && \
    defined(__AVX512VL__)
  level = 4;
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__) && defined(__MOVBE__)
  level = 3;
#elif defined(__SSE4_2__) && defined(__POPCNT__)
  level = 2;
#endif
  EXPECT_EQ(level_of(required_features), level);
  // The compiler's own detection of the processor must agree.
  __builtin_cpu_init();
  EXPECT_EQ((present_features() & features_of_level(4) & ~features_of_level(3)) ==
                (features_of_level(4) & ~features_of_level(3)),
            __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                __builtin_cpu_supports("avx512vl"));
  EXPECT_EQ(level_of(present_features()) >= 3, __builtin_cpu_supports("avx2") &&
                                                   __builtin_cpu_supports("fma") &&
                                                   __builtin_cpu_supports("bmi2"));
#endif
}

// The launcher in a scratch folder as if installed, with scripts in place of the programs.
class Launcher : public testing::Test {
 protected:
  ScratchFolder scratch;

  void SetUp() override {
    if (test::launcher().empty()) GTEST_SKIP() << "this architecture has no launcher";
    fs::create_directories(scratch / "bin");
    fs::copy_file(test::launcher(), scratch / "bin/duet");
    install("libexec/duet");
  }
  // Writes the scripts. Each prints its folder, its level and its arguments, and exits with status 130.
  void install(const std::string& folder) {
    fs::create_directories(scratch / folder);
    for (const int level : portable_levels) {
      const fs::path program = scratch / folder / ("duet-" + std::string(level_name(level)));
      io::write_atomically(program, "#!/bin/sh\necho " + folder + ' ' + level_name(level) +
                                        "\nfor word; do echo \"$word\"; done\nexit 130\n");
      ::chmod(program.c_str(), 0700);
    }
  }
  Finished launch(const std::vector<std::string>& arguments = {}) {
    test::Program program(arguments, scratch.path(), (scratch / "bin/duet").string());
    return test::finish(program);
  }
};

TEST_F(Launcher, RunsTheBestCodeWithItsArgumentsAndStatus) {
  const test::Environment none("DUET_ISA", "");
  const Finished finished = launch({"sim", "a scene", ""});
  EXPECT_EQ(finished.status, 130);
  const std::string best = level_name(choose(nullptr, present_features()).level);
  EXPECT_EQ(finished.output, (std::vector<std::string>{"libexec/duet " + best, "sim", "a scene", ""}));
  EXPECT_EQ(finished.errors, "");
}

TEST_F(Launcher, RunsTheCodeThatTheEnvironmentNames) {
  for (const int level : portable_levels) {
    const test::Environment isa("DUET_ISA", level_name(level));
    const Finished finished = launch();
    if (level <= level_of(present_features())) {
      EXPECT_EQ(finished.status, 130);
      EXPECT_EQ(finished.last_line(), "libexec/duet " + std::string(level_name(level)));
    } else {
      EXPECT_EQ(finished.status, 2);
      EXPECT_TRUE(contains(finished.errors, "this processor lacks")) << finished.errors;
    }
  }
}

TEST_F(Launcher, RefusesCodeThatIsNotThere) {
  const test::Environment isa("DUET_ISA", "x86-64-v2");
  const Finished finished = launch();
  EXPECT_EQ(finished.status, 2);
  EXPECT_EQ(
      finished.errors,
      "duet: DUET_ISA=x86-64-v2 names no code of this program; it has x86-64, x86-64-v3 and x86-64-v4\n");
}

TEST_F(Launcher, FindsTheProgramsOfABuildBesideIt) {
  install("bin/libexec/duet");
  const test::Environment isa("DUET_ISA", "x86-64");
  EXPECT_EQ(launch().last_line(), "bin/libexec/duet x86-64");
}

TEST_F(Launcher, NamesAProgramThatIsMissing) {
  fs::remove_all(scratch / "libexec");
  const test::Environment isa("DUET_ISA", "x86-64");
  const Finished finished = launch();
  EXPECT_EQ(finished.status, 4);
  EXPECT_TRUE(contains(finished.errors, "libexec/duet/duet-x86-64: No such file")) << finished.errors;
}

// A program for a better processor stops on an emulated one of level 2 with a sentence, and not by an illegal
// instruction. Programs take seconds to start under qemu, so that only `tools/test --full` runs this test.
TEST(Processor, ProgramsStopOnALesserOneWithASentence) {
  const std::string emulator = "/usr/bin/qemu-x86_64-static";
  if (std::getenv("DUET_FULL") == nullptr) GTEST_SKIP() << "part of tools/test --full";
  if (!fs::exists(emulator)) GTEST_SKIP() << "needs the package qemu-user-static";
  test::Program program({"-cpu", "Nehalem", test::duet_program(), "--version"}, test::source_folder(),
                        emulator);
  const Finished finished = test::finish(program);
  if (level_of(required_features) > 2) {  // The program is compiled for the same processor as the tests.
    EXPECT_EQ(finished.status, 2);
    EXPECT_TRUE(contains(finished.errors, "duet: this processor lacks AVX, AVX2")) << finished.errors;
    EXPECT_TRUE(finished.output.empty());
  } else {
    EXPECT_EQ(finished.status, 0) << finished.errors;
    EXPECT_TRUE(finished.last_line().starts_with("duet ")) << finished.last_line();
  }
}

}  // namespace
}  // namespace duet::processor::processor_test
