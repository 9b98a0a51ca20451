// Describes the running program: version, compiler, instruction set and version of the numerics.
#pragma once

#include <string>

namespace duet::tools {

// Returns the compiler and its version: "g++ 12.2.0".
std::string compiler_text();

// Returns the instruction set that the program was compiled for: a level of the x86-64 psABI ("x86-64-v3") or
// another architecture ("aarch64"). If it was compiled for all instructions of the building machine, the text
// is "native (x86-64-v4)".
std::string variant_text();

// Returns a description of this machine for manifests: processor, threads and operating system.
std::string machine_text();

// Returns the line that `duet --version` prints: "duet 0.1.0 (0123456789ab), g++ 12.2.0, x86-64-v3, numerics
// 1". The hexadecimal number is the git commit.
std::string version_text();

}  // namespace duet::tools
