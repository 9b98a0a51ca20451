// The cache of tetrahedra, and `duet cache`, which shows its size or clears it.
#include "tools/cache.h"

#include <cstdlib>
#include <string>

#include "tools/commands.h"
#include "tools/version.h"
#include <fmt/format.h>

#include "sim/base/numerics.h"
#include "sim/base/printable.h"
#include "sim/scene/build/tet_cache.h"

namespace duet::tools {
namespace {

// Returns the value of an environment variable; empty if it is not set.
std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

std::filesystem::path cache_folder() {
  if (const std::string own = variable("DUET_CACHE"); own == "off")
    return {};
  else if (!own.empty())
    return own;
  if (const std::string caches = variable("XDG_CACHE_HOME"); !caches.empty())
    return std::filesystem::path(caches) / "duet";
  if (const std::string home = variable("HOME"); !home.empty())
    return std::filesystem::path(home) / ".cache" / "duet";
  return {};
}

void use_cache() {
  const std::string commit = git_commit;
  if (commit.ends_with("-changed")) return;
  scene::set_tet_cache({cache_folder(), fmt::format("{} {} {}", version, commit, numerics_version)});
}

Outcome cache(const CacheOptions& options) {
  const std::filesystem::path folder = cache_folder();
  if (folder.empty())
    return {ExitStatus::done,
            variable("DUET_CACHE") == "off"
                ? "nothing is kept, as DUET_CACHE=off says"
                : "nothing is kept: neither DUET_CACHE nor XDG_CACHE_HOME nor HOME names a folder"};
  const scene::TetCacheSize size =
      options.clear ? scene::clear_tet_cache(folder) : scene::tet_cache_size(folder);
  return {ExitStatus::done,
          fmt::format("{}: tetrahedra of {} mesh{}, {:.1f} MB{}", printable_line(folder.string()), size.files,
                      size.files == 1 ? "" : "es", 1e-6 * static_cast<double>(size.bytes),
                      options.clear ? ", removed" : "; at most 1074 MB are kept, --clear removes them")};
}

}  // namespace duet::tools
