// hashes.jsonl of a run directory: hashes of the state after every stage (`duet sim --hash-stages`), and
// the search for the first stage in which two runs differ.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/line_log.h"
#include "sim/step/stage_hashes.h"

namespace duet::io {

/// Writes hashes.jsonl. Its first line has the names of the bodies, each further line is a StageRecord:
///
///     {"frame": 0, "rigid": [names], "deformable": [names]}
///     {"frame": 1, "step": 1, "stage": "I.1 advance velocity", "rigid": {"velocity": hashes, ...},
///      "scene": {...}}
///
/// The hashes of a quantity are one text, with 8 hexadecimal digits for each owner
/// (sim/step/state_hashes.h). A quantity whose hashes are those of the line before is left out.
class StageLog {
 public:
  /// Opens hashes.jsonl. Keeps its lines of frames up to `last_kept` (-1: none). `bodies` are
  /// Simulation::state_hashes() of any frame; only their names are used. Throws FileError.
  StageLog(const RunDirectory& run, const std::vector<BodyHashes>& bodies, int last_kept = -1);

  /// Appends the line of a stage. Throws FileError.
  void append(const StageRecord& record);
  /// Lists the file in the run's journal, at the end of a frame. Throws FileError.
  void list() const { lines_.list(); }

 private:
  LineLog lines_;
  std::vector<QuantityHashes> last_;  // hashes of the line before; empty at first
};

/// First stage after which two runs differ.
struct StageDifference {
  int frame = 0,      ///< frame that the step leads to
      step = 0;       ///< number of the step in its frame, from 1
  std::string stage;  ///< label of the stage in the first run
  /// Label of the stage that the second run has in that place. If this record is of another frame, step or
  /// stage than that of the first run, both found equal values up to there and went on with other work: the
  /// members below are empty.
  std::string other_stage;
  std::string quantity;             ///< first quantity that differs after the stage
  std::string body;                 ///< first body whose quantity differs; empty for a quantity of the scene
  int bodies = 0;                   ///< number of bodies whose quantity differs; 1 for the scene
  std::vector<std::string> others;  ///< further quantities that differ after the stage
};

/// Result of compare_stages().
struct StageComparison {
  int stages = 0;      ///< number of stages, from the beginning, after which both runs are equal
  int last_frame = 0;  ///< frame of the last of these stages
  std::optional<StageDifference> difference;  ///< first difference; none if there is none
  /// True if both runs have equally many stages. The value is valid if there is no difference; a run that
  /// was stopped earlier is not different.
  bool same_length = true;

  /// Returns the result as a phrase.
  std::string text() const;
};

/// Compares hashes.jsonl of two runs stage by stage, up to the first difference. Throws FileError if one of
/// the files is missing or malformed. Throws Error (usage) if the runs have different bodies or hash
/// different quantities, or begin at different frames.
StageComparison compare_stages(const RunDirectory& a, const RunDirectory& b);

}  // namespace duet::io
