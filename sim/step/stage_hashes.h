// Hashes of what a step reads and writes, after each of its stages. They show the first stage in which two
// programs, or two builds of one, differ.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "sim/step/stage_table.h"
#include "sim/step/state_hashes.h"

namespace duet {

/// The hashes of the state after a stage, or at the beginning or the end of a step.
struct StageRecord {
  int frame = 0;           ///< frame that the step leads to
  int step = 0;            ///< number of the step in its frame, from 1; steps that were repeated count
  std::string_view stage;  ///< label in the table of stages, or "step begins" or "step ends"
  /// Hashes by quantity, in the order of hash_step(); valid during the call of the sink.
  const std::vector<QuantityHashes>& quantities;
};

/// Passes hashes of the state to a sink after every stage. Off unless asked for; it never changes a result.
class StageHashes {
 public:
  /// The function that receives the records.
  using Sink = std::function<void(const StageRecord&)>;

  /// Passes a record to `sink` after every stage, and at both ends of every step, from now on.
  void turn_on(Sink sink) { sink_ = std::move(sink); }
  /// Returns whether there is a sink.
  bool is_on() const { return static_cast<bool>(sink_); }

  /// Starts counting the steps of `frame`.
  void begin_frame(int frame) {
    frame_ = frame;
    step_ = 0;
  }
  /// Records the state at the beginning of a step.
  void begin_step(const World& world) {
    if (!is_on()) return;
    ++step_;
    has_contacts_ = false;
    record(world, "step begins");
  }
  /// Records the state after `stage`.
  void end_stage(const World& world, Stage stage) {
    if (!is_on()) return;
    has_contacts_ = has_contacts_ || stage == Stage::contact_candidates;
    record(world, name(stage));
  }
  /// Records the state at the end of a step.
  void end_step(const World& world) {
    if (is_on()) record(world, "step ends");
  }

 private:
  // Hashes the state and passes the record to the sink.
  void record(const World& world, std::string_view stage) {
    hash_step(world, has_contacts_, quantities_);
    sink_({frame_, step_, stage, quantities_});
  }

  Sink sink_;
  int frame_ = 0,                           // see StageRecord::frame
      step_ = 0;                            // see StageRecord::step
  bool has_contacts_ = false;               // whether the step has found its contacts
  std::vector<QuantityHashes> quantities_;  // scratch, keeps its storage
};

}  // namespace duet
