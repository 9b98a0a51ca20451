// Manual pages in roff, for the program `man`.
#pragma once

#include <string>
#include <vector>

#include "tools/manual/declarations.h"

namespace duet::tools::manual {

// Returns the page duet(1), which lists the commands.
std::string main_page(const std::vector<Command>& commands);

// Returns the page of a command: duet-run(1).
std::string command_page(const Command& command);

}  // namespace duet::tools::manual
