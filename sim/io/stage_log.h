// hashes.jsonl of a run directory: hashes of the state after every stage (`duet sim --hash-stages`), and the
// search for the first stage in which two runs differ.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/line_log.h"
#include "sim/step/stage_hashes.h"

namespace duet::io {

/// Writes hashes.jsonl. Its first line has the names of the bodies, each further one a StageRecord:
///   {"frame": 0, "rigid": [names], "deformable": [names]}
///   {"frame": 1, "step": 1, "stage": "I.1 advance velocity", "rigid": {"velocity": hashes, ...}, "scene":
///   {...}}
/// Hashes are those of all owners (sim/step/state_hashes.h) one after the other, 8 hexadecimal digits each. A
/// quantity that has the hashes of the line before is left out.
class StageLog {
 public:
  /// `bodies`: Simulation::state_hashes() of any frame, for the names. Keeps lines of frames up to
  /// `last_kept` that are there (-1: none). Throws FileError.
  StageLog(const RunDirectory& run, const std::vector<BodyHashes>& bodies, int last_kept = -1);

  void append(const StageRecord& record);  ///< throws FileError
  void list() const { lines_.list(); }     ///< at the end of a frame, in the run's journal; throws FileError

 private:
  LineLog lines_;
  std::vector<QuantityHashes> last_;
};

/// Where two runs part ways.
struct StageDifference {
  int frame = 0, step = 0;
  std::string stage;
  /// The stage that the second run has in that place. If it is another one (they found the same values up to
  /// there, and went on with other work) the rest is empty.
  std::string other_stage;
  std::string quantity;             ///< the first that differs
  std::string body;                 ///< the first whose quantity differs; empty for a quantity of the scene
  int bodies = 0;                   ///< how many have another quantity
  std::vector<std::string> others;  ///< further quantities that differ after the stage
};

struct StageComparison {
  int stages = 0;      ///< that both runs have and in which they are equal
  int last_frame = 0;  ///< of these stages
  std::optional<StageDifference> difference;
  bool same_length = true;  ///< whether they end together; one that was stopped earlier is no difference

  std::string text() const;  ///< a sentence
};

/// Throws FileError where a run has no hashes.jsonl or one that cannot be read, Error (usage) where they are
/// of scenes with other bodies or begin at other frames.
StageComparison compare_stages(const RunDirectory& a, const RunDirectory& b);

}  // namespace duet::io
