#include "tools/build_info.h"

#include "tools/processor/processor.h"
#include "tools/version.h"
#include <fmt/format.h>

#include "sim/base/numerics.h"

namespace duet::tools {

std::string compiler_text() {
#if defined(__clang__)
  return fmt::format("clang++ {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#elif defined(__GNUC__)
  return fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#else
  return "unknown compiler";
#endif
}

std::string variant_text() {
#if defined(__x86_64__)
  const std::string code = processor::level_name(processor::level_of(processor::required_features));
#else
  const std::string code = DUET_ARCHITECTURE;
#endif
  return std::string(DUET_MARCH) == "native" ? fmt::format("native ({})", code) : code;
}

std::string version_text() {
  return fmt::format("duet {} ({}), {}, {}, numerics {}", version, git_commit, compiler_text(),
                     variant_text(), numerics_version);
}

}  // namespace duet::tools
