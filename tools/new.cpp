// `duet new`: writes a commented scene for users to begin with.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tools/commands.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/near_miss.h"
#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

constexpr const char* default_template = "drop";
// Template for --mesh. It names a mesh that ships, which --mesh replaces.
constexpr const char* mesh_template = "mesh";

// Place where the mesh of --mesh begins to fall (m): the center of its box along x and z, and the lower end
// of its box. The step below is 0.4 m high and 1.2 m wide.
constexpr double start_x = 0.25, start_y = 0.7, start_z = 0;
// Longest edge of the mesh's box (m): the size that the camera of the template has in view.
constexpr double mesh_extent = 1;

// Returns the path of the new scene, with the extension .toml. Throws Error (usage) for names of no file.
fs::path scene_path(const std::string& name) {
  const fs::path path(name);
  const std::string file = path.filename().string();
  if (file.empty() || file == "." || file == ".." || file == ".toml")
    throw Error(ExitStatus::usage, fmt::format("{}: names no file (give a name such as `ball`)",
                                               name.empty() ? "an empty name" : name));
  return path.extension() == ".toml" ? path : fs::path(name + ".toml");
}

// Throws unless a file can be written there: the folder must exist, and an existing file needs `overwrite`.
void require_free_path(const fs::path& path, bool overwrite) {
  std::error_code unknown;
  const fs::path folder = path.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, unknown))
    throw FileError(path.string(), fmt::format("there is no folder {}", folder.string()),
                    fmt::format("`mkdir -p {}` makes it", shell_word(folder.string())));
  if (fs::is_directory(path, unknown))
    throw Error(ExitStatus::usage, fmt::format("{}: is a folder (choose another name)", path.string()));
  if (!overwrite && fs::symlink_status(path, unknown).type() != fs::file_type::not_found)
    throw Error(ExitStatus::usage,
                fmt::format("{}: is there already (choose another name, or give --overwrite to replace it)",
                            path.string()));
}

// Returns the text of a template. Throws Error (usage) with a similar name if there is none.
std::string template_text(const std::string& name) {
  std::vector<std::string> names;
  for (const ShippedScene& one : templates()) {
    if (one.name == name) return io::read_file(one.path);
    if (one.name != mesh_template) names.push_back(one.name);
  }
  if (names.empty())
    throw FileError("assets/templates", "the templates of scenes are missing beside the program",
                    "run the program from its source tree, or install it with `cmake --install build`");
  throw Error(ExitStatus::usage,
              fmt::format("--template {}: no such template ({})", name, did_you_mean(name, names)));
}

// Returns a text as a basic string of TOML.
std::string toml_string(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      quoted += c;
  }
  return quoted + '"';
}

// Replaces the value in a line `key = value  # comment`. The comment keeps its column if the value leaves
// room.
void set_value(std::string& text, const std::string& key, const std::string& value) {
  constexpr std::size_t comment_column = 32;
  const std::size_t begin = text.find("\n" + key + " = ") + 1, comment = text.find('#', begin);
  std::string line = key + " = " + value;
  line.resize(std::max(comment_column, line.size() + 1), ' ');
  text.replace(begin, comment - begin, line);
}

// Returns a number with four significant digits, without trailing zeros.
std::string short_number(double value) { return fmt::format("{:.4g}", value); }

// Throws Error (usage) that names the mesh instead of the scene: the user has no scene yet to look into.
[[noreturn]] void refuse_mesh(const std::string& mesh, const std::string& why) {
  throw Error(ExitStatus::usage, fmt::format("{}: {}", mesh, why));
}

// Returns the text of the template with the mesh, scaled to mesh_extent and placed over the step.
std::string text_with_mesh(const std::string& mesh, const fs::path& scene) {
  TriangleMesh surface = read_mesh(mesh);
  if (const MeshReport found = repair(surface); !found.flaws.empty())
    refuse_mesh(mesh, fmt::format("{} ({})", found.flaws[0].message, found.flaws[0].remedy));
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
  if (!(extent > 0) || !std::isfinite(extent)) refuse_mesh(mesh, "has no extent (use a closed surface)");
  const std::string scale = short_number(mesh_extent / extent);
  const double factor = std::stod(scale);
  const Vec3 center = factor * box.center(), least = factor * box.min();
  const fs::path folder = scene.parent_path().empty() ? fs::path(".") : scene.parent_path();
  std::string text = template_text(mesh_template);
  set_value(text, "mesh", toml_string(fs::proximate(mesh, folder).generic_string()));
  set_value(text, "scale", scale);
  set_value(text, "place",
            fmt::format("[{:.4g}, {:.4g}, {:.4g}]", start_x - center.x(), start_y - least.y(),
                        start_z - center.z()));
  return text;
}

// Reads the scene, and builds it if there is a mesh, as `duet check` does. Throws for a mesh that this
// refuses.
void require_valid(const std::string& text, const fs::path& scene, const std::string& mesh) {
  try {
    const scene::ReadResult read = scene::read_text(text, scene.string());
    if (mesh.empty()) return;
    const Simulation simulation(read.scene, scene::plan_effects(read.scene).active());
  } catch (const SceneError& error) {
    if (mesh.empty()) throw;
    std::string why;
    for (const SceneProblem& problem : error.problems()) {
      why += (why.empty() ? "" : "; ") + problem.message;
      if (!problem.hint.empty()) why += " (" + problem.hint + ")";
    }
    refuse_mesh(mesh, why);
  } catch (const FileError&) {
    throw;
  } catch (const Error& error) {
    if (mesh.empty()) throw;
    refuse_mesh(mesh, error.what());
  }
}

}  // namespace

Outcome new_scene(const NewOptions& options) {
  if (options.template_name == mesh_template)
    throw Error(ExitStatus::usage, "--template mesh: no such template (give the mesh instead: --mesh FILE)");
  const fs::path path = scene_path(options.name);
  require_free_path(path, options.overwrite);
  const std::string text =
      options.mesh.empty()
          ? template_text(options.template_name.empty() ? default_template : options.template_name)
          : text_with_mesh(options.mesh, path);
  require_valid(text, path, options.mesh);
  io::write_atomically(path, text);
  const std::string word = shell_word(path.string());
  return {ExitStatus::done,
          fmt::format("{} is written; next: `duet preview {}` draws its start, `duet run {}` "
                      "simulates and draws all of it",
                      path.string(), word, word)};
}

}  // namespace duet::tools
