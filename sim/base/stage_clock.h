// Seconds and calls of every stage, always on. Stages are timed at their call site in sim/step/step.cpp.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

namespace duet {

enum class Stage {
  broad_phase,
  advance_velocity,
  collide,
  apply_contact,
  advance_position,
  push_out,
  constrained_solve,
  velocity_contact,
  elastic_forces,     // within I.1 and V.2
  damping_solve,      // within I.1 and V.2
  shock_propagation,  // within III.3 and V.4
  time_step_choice,
  kinematic_motion,
  volume_correction,
  make_incompressible,
  keep_volume,
  self_repulsion,
  self_collision,
  velocity_repulsion,
  joints,           // within II, III.3, IV.3 and V.4
  explicit_forces,  // V.2 where constraints come before the solve
  air_drag_halfway,
  air_drag,
};
inline constexpr int stage_count = 23;
inline constexpr std::array<std::string_view, stage_count> stage_names = {"0 contact candidates",
                                                                          "I.1 advance velocity",
                                                                          "II collide",
                                                                          "III apply contact",
                                                                          "IV.1 advance position",
                                                                          "IV.2 push out",
                                                                          "V.2-3 constrained solve",
                                                                          "V.4 contact",
                                                                          "elastic forces",
                                                                          "damping solve",
                                                                          "shock propagation",
                                                                          "time step choice",
                                                                          "kinematic motion",
                                                                          "I.2 volume correction",
                                                                          "V.1 make incompressible",
                                                                          "V.4 keep volume",
                                                                          "I.3 self-repulsion",
                                                                          "IV self-collision",
                                                                          "V.4 self-repulsion",
                                                                          "joints",
                                                                          "V.2 explicit forces",
                                                                          "I air drag",
                                                                          "V air drag"};

class StageClock {
 public:
  struct Entry {
    double seconds = 0;
    std::int64_t calls = 0;
  };
  const Entry& operator[](Stage stage) const { return entries_[static_cast<std::size_t>(stage)]; }
  void reset() { entries_ = {}; }

  // Runs `work` as one call of `stage`.
  template <class Work>
  void time(Stage stage, Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    Entry& entry = entries_[static_cast<std::size_t>(stage)];
    entry.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++entry.calls;
  }

 private:
  std::array<Entry, stage_count> entries_{};
};

}  // namespace duet
