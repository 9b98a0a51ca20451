// Paths of the source tree and of the programs. Only places.cpp knows them, so that no other file is compiled
// again when the build folder changes.
#pragma once

#include <string>

namespace duet::test {

// Returns the top folder of the source tree, without a slash at its end.
std::string source_folder();
// Returns the path of the program duet.
std::string duet_program();
// Returns the path of the launcher, which chooses among the programs of a portable build; empty if the build
// is not portable.
std::string launcher();

}  // namespace duet::test
