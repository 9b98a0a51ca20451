// Keeps the ledger (sim/contact/response/ledger.h) stage by stage. Costs a pass over all bodies before and
// after each stage, so it is off unless asked for; it never changes a result.
#pragma once

#include <array>

#include "sim/contact/response/ledger.h"
#include "sim/step/stage_table.h"

namespace duet {

struct World;
struct StepContext;

class StepLedger {
 public:
  /// Whether the ledger has an entry of the stage: it changes what bodies have of momentum or energy.
  static constexpr bool counts(Stage stage) {
    const StageRow& row = row_of(stage);
    return row.work != nullptr && row.changes != Changes::nothing && row.changes != Changes::exchange;
  }

  bool is_on() const { return on_; }
  void turn_on() { on_ = true; }
  void reset();  // at the start of a frame

  // Around a whole step, and around each of its stages.
  void begin_step(const World& world);
  void begin_stage(const World& world, Stage stage);
  void end_stage(const World& world, Stage stage);
  void end_step(const World& world);

  // Of advance_position: the moment that is left when positions move by v^{n+1/2} and velocities are changed
  // at x^{n+1/2} and x^{n+1}, less what keep_spin() takes back; of second order in the step. Of
  // post_stabilization likewise: joints give at x^{n+1} what they gave at x^n, with a moment that is opposite
  // to that of advance_position. Of push_out and keep_spin() the energy alone: for what push_out moves see
  // below.
  const LedgerEntry& operator[](Stage stage) const { return totals_.stage[static_cast<std::size_t>(stage)]; }
  const LedgerEntry& whole_step() const { return totals_.step; }
  const DisplacementEntry& push_out() const { return totals_.push_out; }

 private:
  struct Balance {
    Momentum momentum;
    double kinetic = 0, stored = 0;
  };
  Balance measure(const World& world, const std::vector<Vec3>& x) const;
  Balance measure(const World& world, Stage stage);  // where the forces of the stage act
  // The particles' positions that the forces of a stage act at.
  const std::vector<Vec3>& acting_at(const World& world, Stage stage);
  Momentum external(const World& world, Stage stage, const std::vector<Vec3>& x, const Momentum& gain);
  // What contacts, and joints where a stage has them, have given so far.
  Momentum given_by_contact(const World& world, Stage stage);
  Momentum impulse_of_pins(const World& world, const std::vector<Vec3>& x, const Vec3& gravity,
                           double dt) const;
  Momentum impulse_of_drag(const World& world, const std::vector<Vec3>& x, double dt) const;
  static void close(LedgerEntry& entry, const Balance& before, const Balance& after,
                    const Momentum& external);

  struct Totals {
    std::array<LedgerEntry, stage_count> stage{};
    LedgerEntry step;
    DisplacementEntry push_out;
  };
  bool on_ = false;
  bool in_step_ = false;
  Totals totals_, before_step_;  // a step that fails leaves nothing behind
  Balance step_start_, stage_start_;
  Momentum kept_, kept_external_;  // of this step, by the stages whose change of velocity is not undone
  Momentum given_at_start_;        // by contact, at the start of the stage
  Momentum holders_of_middle_;     // what pins and drag gave in V.3
  std::vector<int> active_;        // scratch: pairs
  std::vector<Vec3> middle_, before_push_out_;
  std::vector<RigidState> rigid_before_push_out_;
};

}  // namespace duet
