// What a run writes besides its frames.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace duet::scene {

/// Names of the formats of other programs that `duet export` writes.
inline constexpr std::array<std::string_view, 10> export_formats{"transforms", "obj", "ply",   "pc2", "mdd",
                                                                 "glb",        "usd", "blend", "vtk", "vdb"};

/// The table [output].
struct Output {
  /// Formats of export_formats in which `duet run` and `duet sim` export the run at its end; empty: none.
  std::vector<std::string> formats;
};

}  // namespace duet::scene
