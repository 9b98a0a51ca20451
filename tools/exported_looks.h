// What bodies wear and how they are seen, for exports and for the page of `duet view`.
#pragma once

#include "sim/io/export/exported_run.h"

namespace duet::tools {

/// The looks that bodies of the manifest wear, and the view, as pictures have them.
io::ExportedLooks looks_of(const scene::Scene& described, const io::Manifest& manifest);

}  // namespace duet::tools
