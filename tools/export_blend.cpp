#include "tools/export_blend.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>

#include "tools/interrupt.h"
#include "tools/view/page.h"
#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/program.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exported_run.h"

namespace duet::tools {

namespace fs = std::filesystem;

namespace {

// Returns the text of the script for Blender, which is compiled into the program.
std::string_view import_script() {
  for (const view::PageFile& file : view::page_files())
    if (file.name == "duet_import.py") return file.text;
  return {};
}

}  // namespace

io::ExportNotes export_blend(const io::ExportedRun& run, const io::FormatOptions&, const fs::path& path) {
  const fs::path root = fs::absolute(run.run().root), caches = root / "export" / "blender";
  io::create_folder(caches);
  io::write_json(io::description(run, "blend"),
                 caches / "export.json");  // from which the script takes the looks
  const ScratchFolder scratch;
  const fs::path script = scratch / "duet_import.py", made = scratch / "made.blend";
  std::ofstream(script) << import_script();
  const ProgramEnd end =
      run_program({"blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                   script.string(), "--", root.string(), "--save", made.string()},
                  scratch.path(), &stop_flag());
  if (interrupted()) throw Interrupted();
  if (end.start_error == ENOENT || end.status == 127)
    throw FileError("blender", "is not installed, and only Blender itself writes .blend files",
                    "apt install blender; or export to glb, usd or pc2, which Blender imports");
  if (end.start_error != 0)
    throw FileError("blender", fmt::format("cannot be started: {}", std::strerror(end.start_error)), "");
  if (end.status != 0 || !is_blend(made))
    throw FileError("blender", fmt::format("failed with status {}: {}", end.status, last_line(end.words)),
                    "export to glb, usd or pc2, which Blender imports");
  std::error_code problem;
  fs::copy_file(made, path, fs::copy_options::overwrite_existing, problem);
  if (problem) throw io::system_error(path, "cannot write", problem.value());
  return {fmt::format("the file refers to caches of deformable bodies in {}", caches.string())};
}

bool is_blend(const fs::path& path) {
  using namespace std::string_view_literals;
  bool is_it = false;
  if (!io::holds_bytes(path)) return false;
  io::read_pieces(path, [&](std::string_view piece) {
    is_it = piece.starts_with("BLENDER"sv) || piece.starts_with("\x28\xB5\x2F\xFD"sv);
    return false;
  });
  return is_it;
}

}  // namespace duet::tools
