/// USD stages with a choice of their own.
#pragma once

#include <cstdint>

#include "sim/io/export/exporters.h"

namespace duet::io {

/// Bytes of bodies' values that run.usda takes in. They are held in memory while they are written, and by
/// readers from opening the stage on, which takes them about a second.
inline constexpr std::uint64_t usd_most_inside = 32'000'000;

/// export_usd with another bound: values that take about more bytes than `most_inside` go into a file a
/// frame.
ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder,
                       std::uint64_t most_inside);

}  // namespace duet::io
