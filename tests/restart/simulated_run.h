// A folder with a run of a scene, for tests of commands that read runs.
#pragma once

#include <string>
#include <vector>

#include "tests/restart/program.h"
#include <gtest/gtest.h>

#include "sim/base/scratch_folder.h"
#include "sim/io/run_directory.h"

namespace duet::test {

// A fixture with the run `run` in a scratch folder.
class SimulatedRun : public testing::Test {
 protected:
  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"};

  // Simulates the scene into `run`, in place of an earlier run, with the further words on the command line.
  void simulate(const std::string& scene, const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"sim", scene, "--out", run.root.string(), "--quiet", "--overwrite"};
    words.insert(words.end(), more.begin(), more.end());
    const Finished finished = run_duet(words);
    ASSERT_EQ(finished.status, 0) << scene << finished.errors;
  }
};

}  // namespace duet::test
