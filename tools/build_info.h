// Which program this is: its version, compiler, instructions and numerics.
#pragma once

#include <string>

namespace duet::tools {

/// The compiler and its version: "g++ 12.2.0".
std::string compiler_text();

/// The instructions that the program was compiled for: a level of the x86-64 psABI, or another architecture;
/// with "native" where they are all those of the machine that built it: "x86-64-v3", "native (x86-64-v4)",
/// "aarch64".
std::string variant_text();

/// The line that `duet --version` prints: "duet 0.1.0 (0123456789ab), g++ 12.2.0, x86-64-v3, numerics 1".
std::string version_text();

}  // namespace duet::tools
