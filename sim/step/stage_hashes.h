// Hashes of what a step reads and writes, after each of its stages: where two programs, or two builds of one,
// part ways. Off unless asked for; it never changes a result.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "sim/step/stage_table.h"
#include "sim/step/state_hashes.h"

namespace duet {

/// The state after a stage, or at the beginning or the end of a step.
struct StageRecord {
  int frame = 0;           ///< that the step leads to
  int step = 0;            ///< of the frame, from 1; steps that failed and were repeated count
  std::string_view stage;  ///< its label in the table of stages, or "step begins" or "step ends"
  const std::vector<QuantityHashes>& quantities;
};

class StageHashes {
 public:
  using Sink = std::function<void(const StageRecord&)>;

  /// Gives `sink` a record after every stage from now on.
  void turn_on(Sink sink) { sink_ = std::move(sink); }
  bool is_on() const { return static_cast<bool>(sink_); }

  void begin_frame(int frame) {
    frame_ = frame;
    step_ = 0;
  }
  void begin_step(const World& world) {
    if (!is_on()) return;
    ++step_;
    record(world, "step begins");
  }
  void end_stage(const World& world, Stage stage) {
    if (is_on()) record(world, name(stage));
  }
  void end_step(const World& world) {
    if (is_on()) record(world, "step ends");
  }

 private:
  void record(const World& world, std::string_view stage) {
    hash_step(world, quantities_);
    sink_({frame_, step_, stage, quantities_});
  }

  Sink sink_;
  int frame_ = 0, step_ = 0;
  std::vector<QuantityHashes> quantities_;
};

}  // namespace duet
