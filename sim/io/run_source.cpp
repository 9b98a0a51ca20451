#include "sim/io/run_source.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/geometry/files/gltf_uri.h"
#include "sim/io/json_text.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

fs::path folder_of(const RunDirectory& run) { return run.root / "source"; }
fs::path list_of(const RunDirectory& run) { return folder_of(run) / "source.json"; }

// Returns true if a path relative to a folder does not leave that folder.
bool stays_inside(const fs::path& path) {
  return !path.empty() && path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

// Returns the paths of the buffers that a .gltf file in `folder` names, relative to it. Buffers within the
// file, and files outside of its folder, are left out.
std::vector<std::string> buffers_of(const std::string& gltf, const fs::path& folder) {
  std::vector<std::string> buffers;
  const nlohmann::json document = parse_json(gltf);
  if (!document.is_object() || !document.contains("buffers") || !document["buffers"].is_array())
    return buffers;
  for (const nlohmann::json& buffer : document["buffers"])
    if (buffer.is_object() && buffer.contains("uri") && buffer["uri"].is_string())
      if (const std::string uri = buffer["uri"]; !uri.starts_with("data:"))
        if (const std::string file = path_of_uri(folder, uri); stays_inside(file)) buffers.push_back(file);
  return buffers;
}

}  // namespace

SourceFiles collect_source(const scene::ReadResult& read, RunSource& source) {
  source.scene = fs::path(read.scene.path).filename().string();
  SourceFiles files;
  files[source.scene] = read.written;
  for (const auto& [name, path] : read.files) {
    std::string bytes = read_file(path);
    const fs::path file(path);
    const fs::path folder = fs::path("mesh") / fmt::format("{:016x}", mark_of(bytes).hash);
    if (file.extension() == ".gltf")
      for (const std::string& buffer : buffers_of(bytes, file.parent_path()))
        files[(folder / buffer).generic_string()] = read_file(file.parent_path() / buffer);
    const std::string copy = (folder / file.filename()).generic_string();
    source.files[name] = copy;
    files[copy] = std::move(bytes);
  }
  return files;
}

void write_source(const RunDirectory& run, const RunSource& source, const SourceFiles& files) {
  const fs::path folder = folder_of(run);
  std::set<fs::path> kept;
  for (const auto& [name, bytes] : files) {
    create_folder((folder / name).parent_path());
    run.write(folder / name, bytes);
    kept.insert(folder / name);
  }
  nlohmann::ordered_json list = {{"scene", source.scene}, {"set", source.set}, {"without", source.without}};
  list["files"] = nlohmann::ordered_json::object();
  for (const auto& [name, path] : source.files) list["files"][name] = path;
  run.write(list_of(run), list.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n');
  kept.insert(list_of(run));
  std::vector<fs::path> others;
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, unreadable))
    if (entry.is_regular_file(unreadable) && !kept.contains(entry.path())) others.push_back(entry.path());
  for (const fs::path& path : others) run.remove(path);
}

std::optional<RunSource> read_source(const RunDirectory& run) {
  const fs::path path = list_of(run);
  if (!fs::exists(path)) return std::nullopt;
  const nlohmann::json list = parse_json(run.read(path));
  try {
    RunSource source;
    source.scene = list.at("scene").get<std::string>();
    source.set = list.at("set").get<std::vector<std::string>>();
    source.without = list.at("without").get<std::vector<std::string>>();
    const auto inside = [&](const std::string& name) {
      if (!stays_inside(name))
        throw FileError(path.string(), fmt::format("names `{}`, which is not in the folder", name),
                        "the file is damaged: give the scene itself");
      return (folder_of(run) / name).string();
    };
    inside(source.scene);
    for (const auto& [name, file] : list.at("files").items())
      source.files[name] = inside(file.get<std::string>());
    return source;
  } catch (const nlohmann::json::exception& error) {
    throw FileError(path.string(), std::string("is no list of a run's sources: ") + error.what(),
                    "the file is damaged: give the scene itself");
  }
}

fs::path source_scene(const RunDirectory& run, const RunSource& source) {
  return folder_of(run) / source.scene;
}

}  // namespace duet::io
