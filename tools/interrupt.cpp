#include "tools/interrupt.h"

#include <atomic>
#include <csignal>

#include <unistd.h>

#include "sim/base/error.h"

namespace duet::tools {
namespace {

std::atomic<int> interrupts{0};
static_assert(std::atomic<int>::is_always_lock_free, "written by a signal handler");

extern "C" void on_interrupt(int) {
  if (++interrupts < 2) return;
  static constexpr char message[] =
      "\ninterrupted: stopped at once; whole frames are kept, continue with --resume\n";
  [[maybe_unused]] const auto written = ::write(STDOUT_FILENO, message, sizeof message - 1);
  ::_exit(static_cast<int>(ExitStatus::interrupted));
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;  // a write in progress goes on
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupts > 0; }

}  // namespace duet::tools
