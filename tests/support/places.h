// Where the tests find what ships: told by one file, so that no other is compiled anew in another folder.
#pragma once

#include <string>

namespace duet::test {

std::string source_folder();  // the project's top, without a slash at its end
std::string duet_program();
std::string
launcher();  // the program that chooses among those of a portable build; empty where there is none

}  // namespace duet::test
