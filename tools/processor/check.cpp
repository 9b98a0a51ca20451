// Ends a program before its first instruction that the processor may lack. Linked into every program of the
// project.
#include "tools/processor/processor.h"

#if defined(__x86_64__)
#include <unistd.h>

namespace {

constexpr int usage = 2;  // duet::ExitStatus::usage, whose header is for code that runs later

void check_processor(int argc, char** argv, char** /*environment*/) {
  using namespace duet::processor;
  char text[sentence_size];
  if (!describe_lack(argc > 0 ? argv[0] : "duet", required_features, present_features(), text)) return;
  int length = 0;
  while (text[length] != '\0') ++length;
  text[length] = '\n';  // in place of the final null
  if (::write(STDERR_FILENO, text, static_cast<unsigned>(length) + 1) < 0) ::_exit(usage);
  ::_exit(usage);
}

// The dynamic linker calls these before the initializers of the program and of all its libraries.
[[gnu::section(".preinit_array"), gnu::used]] void (*check_at_start)(int, char**, char**) = check_processor;

}  // namespace
#endif
