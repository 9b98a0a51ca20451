// Ends a program before it executes any instruction that the processor lacks. It is linked into every program
// of the project.
#include "tools/processor/processor.h"

#if defined(__x86_64__)
#include <unistd.h>

namespace {

// Equals duet::ExitStatus::usage. The header of that is for code that runs later.
constexpr int usage = 2;

void check_processor(int argc, char** argv, char** /*environment*/) {
  using namespace duet::processor;
  char text[sentence_size];
  if (!describe_lack(argc > 0 ? argv[0] : "duet", required_features, present_features(), text)) return;
  int length = 0;
  while (text[length] != '\0') ++length;
  text[length] = '\n';  // replaces the final null
  if (::write(STDERR_FILENO, text, static_cast<unsigned>(length) + 1) < 0) ::_exit(usage);
  ::_exit(usage);
}

// The dynamic linker calls the functions in this section before the initializers of the program and of all
// its libraries.
[[gnu::section(".preinit_array"), gnu::used]] void (*check_at_start)(int, char**, char**) = check_processor;

}  // namespace
#endif
