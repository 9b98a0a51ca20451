#include "tools/run_products.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "tools/view/page.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/run_folder.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Endings of the files that exports write into folders, with the copies of meshes and their materials.
constexpr std::array<std::string_view, 14> exported_endings = {".json", ".csv", ".obj",  ".mtl", ".ply",
                                                               ".pc2",  ".mdd", ".vtp",  ".pvd", ".usda",
                                                               ".stl",  ".glb", ".gltf", ".vtk"};

bool was_exported(const fs::path& file) {
  return std::find(exported_endings.begin(), exported_endings.end(), file.extension().string()) !=
         exported_endings.end();
}

bool is_of_report(const fs::path& file) {
  return file.filename() == "report.html" || file.extension() == ".svg" || file.extension() == ".gp" ||
         io::frame_of_file(file, ".png") >= 0;
}

// Returns whether there is a folder, which is no link to another one.
bool is_own_folder(const fs::path& folder) {
  std::error_code missing;
  return fs::is_directory(fs::symlink_status(folder, missing));
}

// Removes the files of a folder that `is_ours` recognizes, and the folder if it is empty then.
void remove_ours(const fs::path& folder, bool (*is_ours)(const fs::path&)) {
  if (!is_own_folder(folder)) return;
  std::error_code error;
  for (const fs::path& file : io::files_in(folder))
    if (fs::is_regular_file(fs::symlink_status(file, error)) && is_ours(file)) io::remove_file(file);
  if (fs::is_empty(folder, error)) fs::remove(folder, error);
}

// Removes the exports in the folder export/ of a run. A folder without export.json is none.
void remove_exports(const fs::path& folder) {
  if (!is_own_folder(folder)) return;
  for (const fs::path& entry : io::files_in(folder)) {
    if (!is_own_folder(entry) || !fs::exists(entry / "export.json")) continue;
    remove_ours(entry / "frames", was_exported);  // of a USD stage
    remove_ours(entry, was_exported);
  }
  remove_ours(folder, [](const fs::path& file) { return file.extension() == ".glb"; });
}

// Returns the paths of everything below a folder that is no folder.
std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, error))
    if (!entry.is_directory(error)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

void replace_run(const io::RunDirectory& run, Report& report) {
  io::clear_run(run);
  const fs::path page = run.root / "view.html";
  if (view::is_page(page)) io::remove_file(page);
  if (fs::exists(run.root / "report" / "report.html")) remove_ours(run.root / "report", is_of_report);
  remove_exports(run.root / "export");
  std::vector<fs::path> others = files_below(run.root / "export");
  const std::vector<fs::path> of_report = files_below(run.root / "report");
  others.insert(others.end(), of_report.begin(), of_report.end());
  if (fs::exists(page)) others.push_back(page);
  if (others.empty()) return;
  const std::string rest =
      others.size() == 1 ? std::string(" stays") : fmt::format(" and {} more stay", others.size() - 1);
  report.note(fmt::format("{}{}, and may show the run that was replaced", others.front().string(), rest));
}

}  // namespace duet::tools
