// Requests to give up long work: the caller of the simulator sets a flag, and loops inside the simulator look
// at it.
#pragma once

#include <atomic>

#include "sim/base/error.h"

namespace duet {

/// Thrown when work is given up because its caller asked for it. This is no failure.
class Stopped : public Error {
 public:
  /// Constructs the error; its status is ExitStatus::interrupted.
  Stopped();
};

/// Connects a flag with stop_if_asked() of the current thread for the lifetime of the scope. Scopes nest: the
/// innermost one counts.
class StopScope {
 public:
  /// Makes stop_if_asked() of this thread look at `flag`, which must outlive the scope. A null pointer means
  /// that nothing is looked at.
  explicit StopScope(const std::atomic<bool>* flag);
  /// Restores the flag of the enclosing scope.
  ~StopScope();
  /// Scopes cannot be copied.
  StopScope(const StopScope&) = delete;
  /// Scopes cannot be assigned.
  StopScope& operator=(const StopScope&) = delete;

 private:
  // The flag of the enclosing scope; null: none.
  const std::atomic<bool>* before_;
};

/// Throws Stopped if the flag of the thread's StopScope is set. It costs one load, so that solvers can call
/// it in every iteration.
void stop_if_asked();

}  // namespace duet
