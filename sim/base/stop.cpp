#include "sim/base/stop.h"

namespace duet {
namespace {

// The flag of the innermost StopScope of this thread; null: none.
thread_local const std::atomic<bool>* asked = nullptr;

}  // namespace

Stopped::Stopped()
    : Error(ExitStatus::interrupted, "the work was given up because its caller asked for it") {}

StopScope::StopScope(const std::atomic<bool>* flag) : before_(asked) { asked = flag; }
StopScope::~StopScope() { asked = before_; }

void stop_if_asked() {
  if (asked != nullptr && asked->load(std::memory_order_relaxed)) throw Stopped();
}

}  // namespace duet
