// The ledger of momentum and energy (sim/contact/response/ledger.h), kept stage by stage.
#pragma once

#include <array>

#include "sim/contact/response/ledger.h"
#include "sim/step/stage_table.h"

namespace duet {

struct World;
struct StepContext;

/// Measures what each stage of a step changes of momentum and energy, and how much of it comes from outside.
///
/// It costs a pass over all bodies before and after each stage, so that it is off unless asked for. It never
/// changes a result.
class StepLedger {
 public:
  /// Returns whether the ledger has an entry of the stage: whether the stage changes momentum or energy.
  static constexpr bool counts(Stage stage) {
    const StageRow& row = row_of(stage);
    return row.work != nullptr && row.changes != Changes::nothing && row.changes != Changes::exchange;
  }

  /// Returns whether the ledger is kept.
  bool is_on() const { return on_; }
  /// Keeps the ledger from now on.
  void turn_on() { on_ = true; }
  /// Sets all sums to zero, at the start of a frame.
  void reset();

  /// Measures the state at the start of a step. If the last step did not end, its entries are dropped.
  void begin_step(const World& world);
  /// Measures the state before a stage.
  void begin_stage(const World& world, Stage stage);
  /// Measures the state after a stage, and adds the difference to the entry of the stage.
  void end_stage(const World& world, Stage stage);
  /// Measures the state at the end of a step, and closes its entries.
  void end_step(const World& world);

  /// Returns the entry of a stage, summed over the steps since reset().
  ///
  /// The entry of advance_position holds the moment that is left when positions move by v^{n+1/2} and
  /// velocities are changed at x^{n+1/2} and x^{n+1}, less what keep_spin() takes back; it is of second order
  /// in the step. The entry of post_stabilization holds an opposite moment, because joints give at x^{n+1}
  /// what they gave at x^n. The entries of push_out and spin hold energy alone; see push_out() for what
  /// interpenetration resolution moves.
  const LedgerEntry& operator[](Stage stage) const { return totals_.stage[static_cast<std::size_t>(stage)]; }
  /// Returns the entry of whole steps, summed since reset().
  const LedgerEntry& whole_step() const { return totals_.step; }
  /// Returns what the displacements of interpenetration resolution move, summed since reset().
  const DisplacementEntry& push_out() const { return totals_.push_out; }

 private:
  // Momentum about the origin, and energy.
  struct Balance {
    Momentum momentum;
    double kinetic = 0,  // J
        stored = 0;      // J, elastic and of gravity
  };
  // Measures the state, with moments for the particle positions `x` (m).
  Balance measure(const World& world, const std::vector<Vec3>& x) const;
  // Measures the state, with moments where the forces of the stage act.
  Balance measure(const World& world, Stage stage);
  // Returns the particle positions (m) at which the forces of a stage act.
  const std::vector<Vec3>& acting_at(const World& world, Stage stage);
  // Returns the part of what a stage has changed (`gain`) that comes from outside, for the particle positions
  // `x`.
  Momentum external(const World& world, Stage stage, const std::vector<Vec3>& x, const Momentum& gain);
  // Returns what bodies of infinite mass have given by contacts, and by joints if the stage has them, so far.
  Momentum given_by_contact(const World& world, Stage stage);
  // Returns the impulse of pins over `dt` (s), about the origin.
  Momentum impulse_of_pins(const World& world, const std::vector<Vec3>& x, const Vec3& gravity,
                           double dt) const;
  // Returns the impulse of mass-proportional damping over `dt` (s), about the origin.
  Momentum impulse_of_drag(const World& world, const std::vector<Vec3>& x, double dt) const;
  // Adds the difference of two balances to an entry.
  static void close(LedgerEntry& entry, const Balance& before, const Balance& after,
                    const Momentum& external);

  // Sums since reset().
  struct Totals {
    std::array<LedgerEntry, stage_count> stage{};
    LedgerEntry step;
    DisplacementEntry push_out;
  };
  bool on_ = false;
  bool in_step_ = false;        // true if a step has begun and not ended
  Totals totals_,               // sums so far
      before_step_;             // sums before this step, which come back if it fails
  Balance step_start_,          // at the start of the step
      stage_start_;             // at the start of the stage
  Momentum kept_,               // gained in this step by the stages whose change of velocity is not undone
      kept_external_;           // the part of kept_ from outside
  Momentum given_at_start_;     // given_by_contact() at the start of the stage
  Momentum holders_of_middle_;  // impulse of pins and drag in V.3
  std::vector<int> active_;     // scratch: pairs
  std::vector<Vec3> middle_,    // m, scratch: particle positions at x^{n+1/2}
      before_push_out_;         // m, particle positions before IV.2
  std::vector<RigidState> rigid_before_push_out_;  // rigid states before IV.2
};

}  // namespace duet
