#include "tools/interrupt.h"

#include <csignal>
#include <cstddef>

#include <unistd.h>

#include "sim/base/error.h"

namespace duet::tools {
namespace {

std::atomic<bool> asked_to_stop{false};
std::atomic<int> orderly{0};  // number of OrderlyStop objects that live
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "used by a signal handler");

// Writes to standard error, because a program may read standard output. Safe in a signal handler.
template <std::size_t size>
void say(const char (&text)[size]) {
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, size - 1);
}

extern "C" void on_interrupt(int) {
  if (orderly > 0 && !asked_to_stop.exchange(true))
    return say(
        "\nduet: interrupted: what is in hand is given up, what is whole is kept; a second signal ends the "
        "program at once\n");
  say("\nduet: interrupted: ended at once; files that were written are whole\n");
  ::_exit(static_cast<int>(ExitStatus::interrupted));
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;  // system calls in progress are restarted
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

OrderlyStop::OrderlyStop() { ++orderly; }
OrderlyStop::~OrderlyStop() { --orderly; }

bool interrupted() { return asked_to_stop; }
const std::atomic<bool>& stop_flag() { return asked_to_stop; }

}  // namespace duet::tools
