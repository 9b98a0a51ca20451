// Handling of SIGINT and SIGTERM. Both end the program at once, unless work in progress asks to end in order.
#pragma once

#include <atomic>

namespace duet::tools {

// Installs the signal handler.
void catch_interrupts();

// While an object lives, the first signal only sets stop_flag() and prints a message; the second one ends the
// program at once.
class OrderlyStop {
 public:
  OrderlyStop();
  ~OrderlyStop();
  OrderlyStop(const OrderlyStop&) = delete;
  OrderlyStop& operator=(const OrderlyStop&) = delete;
};

// Returns whether a signal has come.
bool interrupted();

// Returns the flag that the first signal sets, for work that looks at a flag by itself.
const std::atomic<bool>& stop_flag();

}  // namespace duet::tools
