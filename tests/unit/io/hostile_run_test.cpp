// Tests that the files of a run may hold any JSON: readers refuse it or pass over it, and neither crash nor
// end with an exception of a library. Most of the inputs are findings of tests/fuzz.
#include <string>

#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/json_text.h"
#include "sim/io/run_check.h"
#include "sim/io/run_claim.h"
#include "sim/io/run_journal.h"
#include "sim/io/run_source.h"
#include "sim/io/stage_log.h"
#include "sim/io/stats_log.h"

namespace duet::io::hostile_run_test {
namespace {

// A value that nests so deep that copying, writing or parsing it recursively overflows the stack.
const std::string deep = std::string(200000, '[') + std::string(200000, ']');

class HostileRun : public testing::Test {
 protected:
  ScratchFolder scratch;
  RunDirectory run{scratch / "run", {}};

  void write(const std::string& name, const std::string& bytes) {
    create_folder((run.root / name).parent_path());
    write_atomically(run.root / name, bytes);
  }
};

TEST_F(HostileRun, ValuesThatNestDeepAreRefused) {
  EXPECT_TRUE(parse_json("{\"a\":" + deep + "}").is_discarded());
  write("journal.jsonl",
        "{\"journal\":1,\"first_frame\":0,\"writer\":" + deep + "}\n{\"file\":" + deep + "}\n");
  EXPECT_EQ(RunJournal::read(run.root)->faults().size(), 2U);
  write("claim/0001.json", "{\"holder\":" + deep + "}");
  EXPECT_TRUE(RunClaim::holder(run.root).has_value());
  write("manifest.json", "{\"earlier\":" + deep + "}");
  EXPECT_THROW(read_manifest(run), FileError);
  write("source/source.json", "{\"scene\":" + deep + "}");
  EXPECT_THROW(read_source(run), FileError);
  write("stats.jsonl", "{\"frame\":1,\"hash\":" + deep + "}\n");
  EXPECT_FALSE(recorded_hash(run, 1).has_value());
  write("hashes.jsonl", "{\"rigid\":" + deep + "}\n");
  EXPECT_THROW(compare_stages(run, run), FileError);
}

TEST_F(HostileRun, NumbersBeyondIntegersAreRefused) {
  for (const char* number :
       {"1e300", "-1e300", "3000000000", "-3000000000", "18446744073709551615", "0.5", "\"1\""}) {
    SCOPED_TRACE(number);
    EXPECT_FALSE(integer_of<int>(nlohmann::json::parse(number)).has_value());
    write("hashes.jsonl",
          std::string("{\"rigid\":[],\"deformable\":[]}\n{\"stage\":\"\",\"step\":1,\"frame\":") + number +
              "}\n");
    EXPECT_THROW(compare_stages(run, run), FileError);
  }
  EXPECT_EQ(integer_of<int>(nlohmann::json::parse("-2147483648")), -2147483647 - 1);
  EXPECT_EQ(integer_of<int>(nlohmann::json::parse("2147483647")), 2147483647);
  const std::string process = R"({"host":"node","machine":"m","start":17,"process":)";
  EXPECT_TRUE(read_process(process + "4711}").has_value());
  EXPECT_FALSE(read_process(process + "1e300}").has_value());
}

TEST_F(HostileRun, ClaimsWithoutTextsHaveAnUnknownHolder) {
  for (const char* claim :
       {R"({"work":1,"since":[]})", R"({"holder":1,"work":null})", R"({"holder":{"host":1}})", "[]", ""}) {
    SCOPED_TRACE(claim);
    write("claim/0001.json", claim);
    ASSERT_TRUE(RunClaim::holder(run.root).has_value());
    EXPECT_EQ(RunClaim::holder(run.root)->process.host, "an unknown machine");
  }
}

}  // namespace
}  // namespace duet::io::hostile_run_test
