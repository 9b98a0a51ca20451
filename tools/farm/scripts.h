// The scripts of a farm: bash that people can read and edit, in which every value is quoted.
#pragma once

#include <map>
#include <string>

#include "tools/farm/plan.h"

namespace duet::farm {

// Returns the texts of all scripts by their names. `start.sh` submits or carries out the others.
std::map<std::string, std::string> scripts(const Plan& plan);

// Returns the text in single quotes, as shells read it.
std::string quoted(const std::string& text);

}  // namespace duet::farm
