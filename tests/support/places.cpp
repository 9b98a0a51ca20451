#include "tests/support/places.h"

namespace duet::test {

std::string source_folder() { return DUET_SOURCE_DIR; }
std::string duet_program() { return DUET_PROGRAM; }
std::string launcher() { return DUET_LAUNCHER; }

}  // namespace duet::test
