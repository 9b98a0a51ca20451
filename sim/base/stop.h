// A request to give up long work: asked for by the caller of the simulator, looked at inside its loops.
#pragma once

#include <atomic>

#include "sim/base/error.h"

namespace duet {

/// Thrown where work was given up because its caller asked for it; not a failure.
class Stopped : public Error {
 public:
  Stopped();
};

/// For its lifetime, stop_if_asked() of this thread looks at `flag`; null: at nothing. Scopes nest: the
/// innermost counts.
class StopScope {
 public:
  explicit StopScope(const std::atomic<bool>* flag);
  ~StopScope();
  StopScope(const StopScope&) = delete;
  StopScope& operator=(const StopScope&) = delete;

 private:
  const std::atomic<bool>* before_;
};

/// Throws Stopped if the flag of the thread's StopScope is set. Costs one load: iterations of solvers call
/// it.
void stop_if_asked();

}  // namespace duet
