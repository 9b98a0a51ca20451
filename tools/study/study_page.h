// The report of a study as one HTML page.
#pragma once

#include <filesystem>
#include <string>

#include "tools/study/results.h"

namespace duet::study {

// Draws the charts into the folder `charts` and returns a page with them and all tables. Throws FileError.
std::string study_page(const Results& results, const std::filesystem::path& charts);

}  // namespace duet::study
