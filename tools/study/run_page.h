// The report of one run as an HTML page.
#pragma once

#include <filesystem>
#include <string>

#include "sim/io/run_directory.h"

namespace duet::study {

// Draws charts into the folder `charts` and returns a page with them, tables, and pictures of the run if
// there are any. Throws FileError.
std::string run_page(const io::RunDirectory& run, const std::filesystem::path& charts);

}  // namespace duet::study
