// Completions for shells.
#pragma once

#include <string>
#include <vector>

#include "tools/manual/declarations.h"

namespace duet::tools::manual {

// Returns the completions for a shell: bash, zsh or fish. Throws Error (usage) for another one.
std::string completion(const std::string& shell, const std::vector<Command>& commands);

}  // namespace duet::tools::manual
