// Handling of SIGINT and SIGTERM. Both end the program at once, unless work in progress asks to end in order.
#pragma once

#include <atomic>
#include <optional>

namespace duet::tools {

// Installs the signal handlers.
void catch_interrupts();

// While an object lives, the first signal only sets stop_flag() and give_up_flag(), and prints a message; the
// second one ends the program at once.
class OrderlyStop {
 public:
  OrderlyStop();
  ~OrderlyStop();
  OrderlyStop(const OrderlyStop&) = delete;
  OrderlyStop& operator=(const OrderlyStop&) = delete;
};

// Longest wall time (s) for which a frame is finished after the first signal. Batch systems kill a job some
// 30 s after SIGTERM (Slurm's KillWait), and the frame has to be written within that time, too.
constexpr unsigned max_finishing_seconds = 10;

// Lives while a frame is computed, inside an OrderlyStop. The first signal then prints how long the frame may
// take. It leaves give_up_flag() unset for at most max_finishing_seconds if the frame can end by then, so
// that the work that went into the frame is not lost. One object at a time.
class FrameInHand {
 public:
  // `frame` is the number of the frame. `expected` is the wall time that it may take, s; empty: unknown, and
  // the frame is given up.
  FrameInHand(int frame, std::optional<double> expected);
  ~FrameInHand();
  FrameInHand(const FrameInHand&) = delete;
  FrameInHand& operator=(const FrameInHand&) = delete;
};

// Returns whether a signal has come.
bool interrupted();

// Thrown out of work that a signal ends, for its caller to catch.
struct Interrupted {};

// Returns the flag that the first signal sets, for work that looks at a flag by itself.
const std::atomic<bool>& stop_flag();

// Returns the flag that is set when the frame in hand has to be given up.
const std::atomic<bool>& give_up_flag();

}  // namespace duet::tools
