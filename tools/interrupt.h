// SIGINT and SIGTERM. They end the program at once, but for work that is worth to be ended in order.
#pragma once

#include <atomic>

namespace duet::tools {

void catch_interrupts();

/// While one lives, the first signal only sets stop_flag() and says so; the second ends the program at once.
class OrderlyStop {
 public:
  OrderlyStop();
  ~OrderlyStop();
  OrderlyStop(const OrderlyStop&) = delete;
  OrderlyStop& operator=(const OrderlyStop&) = delete;
};

bool interrupted();

/// True once a signal has come; for work that looks at a flag by itself.
const std::atomic<bool>& stop_flag();

}  // namespace duet::tools
