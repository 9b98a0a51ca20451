#include "tests/support/full.h"

#include <cstdlib>

namespace duet::test {

bool runs_in_full() { return std::getenv("DUET_FULL") != nullptr; }

Cases::Cases(int stride) : stride_(runs_in_full() ? 1 : stride) {}

bool Cases::takes() {
  const bool taken = offered_++ % stride_ == 0;
  taken_ += taken;
  return taken;
}

}  // namespace duet::test
