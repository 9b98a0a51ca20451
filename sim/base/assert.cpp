#include "sim/base/assert.h"

#include <cstdio>
#include <cstdlib>

void duet::detail::end_at_assertion(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: %s does not hold: a fault of this program; please report it\n", file, line,
               condition);
  std::abort();
}
