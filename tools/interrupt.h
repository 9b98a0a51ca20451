// SIGINT and SIGTERM: the first asks for a stop at the next whole frame, the second stops at once.
#pragma once

namespace duet::tools {

void catch_interrupts();
bool interrupted();

}  // namespace duet::tools
