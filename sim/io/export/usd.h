// The export to USD with a bound of the caller's on what its main file takes in.
#pragma once

#include <cstdint>

#include "sim/io/export/exporters.h"

namespace duet::io {

/// Bound on the text of the bodies' values in run.usda, bytes; longer values go into a file a frame. The
/// text is held in memory while it is written, and by readers from opening the stage on, which takes them
/// about a second for this size. A larger bound makes fewer files, and both need more time and memory in
/// proportion.
inline constexpr std::uint64_t usd_max_inline_bytes = 32'000'000;

/// Writes a USD stage as the function of exporters.h does, with another bound: if the values of moving
/// bodies take more than about `max_inline_bytes` bytes in all frames, they go into a file a frame. Throws
/// Error (usage) once the stage exceeds FormatOptions::max_bytes, and FileError.
ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder,
                       std::uint64_t max_inline_bytes);

}  // namespace duet::io
