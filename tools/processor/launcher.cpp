// The program `duet` of a portable build. It replaces itself by the program that was compiled for the best
// instruction set of the processor, or by the one that the environment variable DUET_ISA names. Signals,
// streams and the exit status are those of that program.
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tools/processor/processor.h"
#include <unistd.h>

namespace {

using namespace duet::processor;

constexpr int usage = 2, files = 4;  // equal to duet::ExitStatus

// Folders of the programs relative to that of the launcher: in a build, and after `cmake --install`.
constexpr const char* places[] = {"libexec/duet", "../libexec/duet"};

}  // namespace

int main(int /*argc*/, char** argv) {
  const char* wanted = std::getenv("DUET_ISA");
  const FeatureSet present = present_features();
  const Choice choice = choose(wanted, present);
  if (choice.level == 0 || choice.lacking) {
    char text[sentence_size];
    describe_refusal(wanted, choice, present, text);
    std::fprintf(stderr, "%s\n", text);
    return usage;
  }
  char folder[PATH_MAX], program[PATH_MAX + 64];
  const ssize_t length = ::readlink("/proc/self/exe", folder, sizeof folder - 1);
  if (length <= 0) {
    std::fprintf(stderr, "duet: cannot read /proc/self/exe: %s\n", std::strerror(errno));
    return files;
  }
  folder[length] = '\0';
  *std::strrchr(folder, '/') = '\0';
  for (const char* place : places) {
    std::snprintf(program, sizeof program, "%s/%s/duet-%s", folder, place, level_name(choice.level));
    ::execv(program, argv);
    if (errno != ENOENT) break;
  }
  std::fprintf(stderr, "duet: cannot run %s: %s; install the whole program again\n", program,
               std::strerror(errno));
  return files;
}
