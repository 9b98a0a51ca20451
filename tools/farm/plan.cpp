#include "tools/farm/plan.h"

#include <algorithm>
#include <system_error>

#include "tools/scene_files.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "sim/base/files.h"
#include "sim/io/checkpoint.h"
#include "sim/scene/plan.h"

namespace duet::farm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t max_runs = 10'000;  // of a farm; each has a folder and a line in tables

bool is_study(const fs::path& file) {
  std::error_code missing;
  if (!fs::is_regular_file(file, missing)) return false;
  try {
    const toml::table table = toml::parse_file(file.string());
    return table["scene"].is_string() && (table.contains("measures") || table.contains("knobs"));
  } catch (const toml::parse_error&) {
    return false;  // the reader of scenes tells what is wrong
  }
}

// Returns the keys of the seeds of scattered instances in the document of a scene.
std::vector<std::string> seed_keys(const std::string& document) {
  std::vector<std::string> keys;
  const toml::table table = toml::parse(document);
  if (const toml::array* instances = table["instances"].as_array())
    for (const toml::node& node : *instances)
      if (const toml::table* instance = node.as_table();
          instance != nullptr && (instance->contains("seed") || instance->contains("scatter")))
        if (const auto name = (*instance)["name"].value<std::string>())
          keys.push_back("instances." + *name + ".seed");
  return keys;
}

// A key that varies: its name in tables, and for each value its text and the changes of the scene.
struct Axis {
  std::string name;
  std::vector<std::pair<std::string, std::vector<std::string>>> values;
};

std::vector<Axis> axes_of(const tools::FarmOptions& options, const std::string& document) {
  std::vector<Axis> axes;
  for (const std::string& text : options.vary) {
    const auto [key, values] = split_variation(text);
    Axis axis{key, {}};
    for (const std::string& value : values) axis.values.push_back({value, {key + "=" + value}});
    axes.push_back(std::move(axis));
  }
  if (options.seeds == 0) return axes;
  const std::vector<std::string> keys = seed_keys(document);
  if (keys.empty())
    throw Error(ExitStatus::usage,
                "--seeds: the scene scatters no [[instances]], so that no number of it is random (vary "
                "another key by "
                "--vary)");
  Axis axis{"seed", {}};
  for (int seed = 1; seed <= options.seeds; ++seed) {
    std::vector<std::string> set;
    for (const std::string& key : keys) set.push_back(fmt::format("{}={}", key, seed));
    axis.values.push_back({std::to_string(seed), set});
  }
  axes.push_back(std::move(axis));
  return axes;
}

// Returns a run for every combination of values, the last axis first.
std::vector<PlannedRun> combine(const std::vector<Axis>& axes, const fs::path& folder) {
  std::vector<PlannedRun> runs(1);
  for (const Axis& axis : axes) {
    std::vector<PlannedRun> longer;
    for (const PlannedRun& run : runs)
      for (const auto& [text, set] : axis.values) {
        PlannedRun more = run;
        more.values.emplace_back(axis.name, text);
        more.set.insert(more.set.end(), set.begin(), set.end());
        longer.push_back(std::move(more));
      }
    if (longer.size() > max_runs)
      throw Error(ExitStatus::usage, fmt::format("--vary: {} runs are more than {} (give fewer values)",
                                                 longer.size(), max_runs));
    runs = std::move(longer);
  }
  for (std::size_t i = 0; i < runs.size(); ++i)
    runs[i].folder = folder / "runs" / fmt::format("{:04}", i + 1);
  return runs;
}

// Returns the path without a slash at its end.
fs::path without_slash(const fs::path& path) {
  const fs::path plain = path.lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

void plan_study(const tools::FarmOptions& options, Plan& plan) {
  if (!options.vary.empty() || options.seeds > 0 || !options.scene.set.empty() ||
      !options.scene.without.empty() || !options.scene.accuracy.empty() || options.frames)
    throw Error(ExitStatus::usage,
                fmt::format("{}: a study says itself what varies (leave --vary, --seeds, --set, "
                            "--without, --accuracy and --frames out)",
                            options.scene.name));
  plan.kind = Kind::study;
  plan.scene = fs::absolute(options.scene.name);
  plan.study =
      fs::absolute(options.out.empty() ? fs::path("out/studies") / plan.scene.stem() : fs::path(options.out))
          .lexically_normal();
  plan.name = plan.scene.stem().string();
  tools::StudyOptions study;
  study.spec = options.scene.name;
  study.untimed = true;
  plan.points = tools::study_points(study);
}

// Sets the last frame of a run, and the identity of what it simulates. `choice` is the scene of all runs.
void identify(const tools::SceneChoice& choice, PlannedRun& run) {
  tools::SceneChoice own = choice;
  own.set = tools::all_overrides(choice);
  own.accuracy.clear();
  own.set.insert(own.set.end(), run.set.begin(), run.set.end());
  const scene::ReadResult read = tools::read_scene(own);
  run.frames = read.scene.frames;
  run.identity = tools::run_identity(own, read, scene::plan_effects(read.scene, own.without).active());
}

void plan_runs(const tools::FarmOptions& options, Plan& plan) {
  tools::SceneChoice choice = options.scene;
  std::string out = options.out;
  tools::resolve_run(choice, out);
  const bool is_run = choice.name != options.scene.name;
  plan.scene =
      fs::absolute(is_run ? fs::path(options.scene.name) : tools::find_scene(choice.name)).lexically_normal();
  plan.name = tools::find_scene(choice.name).stem().string();
  for (const std::string& text : tools::all_overrides(options.scene))
    plan.changes.insert(plan.changes.end(), {"--set", text});
  for (const std::string& effect : options.scene.without)
    plan.changes.insert(plan.changes.end(), {"--without", effect});
  const fs::path folder = without_slash(fs::absolute(tools::run_folder(choice, out)));
  plan.folder = folder.string() + ".farm";
  const scene::ReadResult shipped =
      scene::read(tools::find_scene(choice.name).string(), tools::all_overrides(choice), scene::Meshes::leave,
                  choice.files);
  const std::vector<Axis> axes = axes_of(options, shipped.source);
  if (axes.empty()) {
    plan.runs = {{folder, {}, {}, 0}};
  } else {
    plan.kind = Kind::variations;
    plan.runs = combine(axes, plan.folder);
  }
  for (PlannedRun& run : plan.runs) {
    identify(choice, run);
    if (options.frames) run.frames = options.frames->last;
    plan.frames = std::max(plan.frames, run.frames);
  }
  if (options.frames) plan.changes.insert(plan.changes.end(), {"--frames", std::to_string(plan.frames)});
  plan.tasks = std::min(options.tasks.value_or(plan.kind == Kind::run ? 8 : 1), plan.frames + 1);
}

// Returns the folders in which the farm of a scene, run or study may be, the most probable one first.
std::vector<fs::path> farm_folders(const std::string& name, const std::string& out) {
  const auto beside = [](const fs::path& folder) {
    return fs::path(without_slash(folder).string() + ".farm");
  };
  if (!out.empty()) return {beside(out)};
  const fs::path plain = without_slash(name);
  std::vector<fs::path> folders = {plain, beside(plain), beside(fs::path("out") / plain)};
  std::error_code missing;
  if (fs::is_regular_file(plain, missing) && !is_study(plain)) {
    tools::SceneChoice scene;
    scene.name = name;
    folders.push_back(beside(tools::run_folder(scene, {})));
  }
  folders.push_back(beside(fs::path("out/studies") / plain.stem()));
  return folders;
}

constexpr const char* kinds[] = {"run", "variations", "study"};  // by Kind

}  // namespace

std::pair<std::string, std::vector<std::string>> split_variation(const std::string& text) {
  const std::size_t equals = text.find('=');
  const auto fail = [&](const char* what) {
    throw Error(ExitStatus::usage, fmt::format("--vary {}: {} (write --vary key=a,b,c)", text, what));
  };
  if (equals == std::string::npos || equals == 0) fail("no key");
  std::vector<std::string> values(1);
  int depth = 0;
  char quote = 0;
  for (const char c : text.substr(equals + 1)) {
    if (quote != 0)
      quote = c == quote ? '\0' : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '[' || c == '{')
      ++depth;
    else if (c == ']' || c == '}')
      --depth;
    if (c == ',' && depth == 0 && quote == 0)
      values.emplace_back();
    else
      values.back() += c;
  }
  if (std::any_of(values.begin(), values.end(), [](const std::string& value) { return value.empty(); }))
    fail("a value is missing");
  return {text.substr(0, equals), values};
}

fs::path this_program() {
  std::error_code unknown;
  const fs::path self = fs::read_symlink("/proc/self/exe", unknown);
  const fs::path folder = self.parent_path();
  if (folder.filename() == "duet" && folder.parent_path().filename() == "libexec")
    for (const char* launcher : {"../../bin/duet", "../../duet"})
      if (const fs::path path = (folder / launcher).lexically_normal(); fs::exists(path, unknown))
        return path;
  return self;
}

Plan make_plan(const tools::FarmOptions& options) {
  Plan plan;
  plan.engine = options.engine;
  plan.work = fs::current_path();
  plan.program = this_program();
  plan.threads = options.threads;
  plan.minutes = options.minutes;
  plan.chain = options.chain;
  plan.sbatch = options.sbatch;
  if (is_study(options.scene.name))
    plan_study(options, plan);
  else
    plan_runs(options, plan);
  if (plan.folder.empty()) plan.folder = plan.study.string() + ".farm";
  return plan;
}

std::string plan_json(const Plan& plan) {
  Json runs = Json::array();
  for (const PlannedRun& run : plan.runs) {
    Json values = Json::array();
    for (const auto& [key, value] : run.values) values.push_back({key, value});
    Json entry = {{"folder", run.folder.string()}, {"values", values}, {"frames", run.frames}};
    if (run.identity) entry["identity"] = *run.identity;
    runs.push_back(std::move(entry));
  }
  const Json document = {{"farm", 1},
                         {"kind", kinds[static_cast<int>(plan.kind)]},
                         {"engine", plan.engine},
                         {"name", plan.name},
                         {"program", plan.program.string()},
                         {"scene", plan.scene.string()},
                         {"frames", plan.frames},
                         {"tasks", plan.tasks},
                         {"study", plan.study.string()},
                         {"points", plan.points},
                         {"runs", runs}};
  return tools::json_text(document, 1) + "\n";
}

Plan read_plan(const std::string& name, const std::string& out) {
  fs::path file;
  for (const fs::path& folder : farm_folders(name, out))
    if (file.empty() && fs::exists(folder / "farm.json")) file = folder / "farm.json";
  if (file.empty())
    throw FileError(name, "has no farm: there is no farm.json",
                    "`duet farm SCENE --engine ENGINE` writes one");
  try {
    const Json document = Json::parse(io::read_file(file));
    Plan plan;
    const auto* kind = std::find(std::begin(kinds), std::end(kinds), document.at("kind").get<std::string>());
    if (document.at("farm") != 1 || kind == std::end(kinds))
      throw FileError(file.string(), "is of another version", "");
    plan.kind = static_cast<Kind>(kind - std::begin(kinds));
    plan.engine = document.at("engine");
    plan.name = document.at("name");
    plan.folder = fs::absolute(file.parent_path());
    plan.program = document.value("program", "");
    plan.scene = document.at("scene").get<std::string>();
    plan.frames = document.at("frames");
    plan.tasks = document.at("tasks");
    plan.study = document.at("study").get<std::string>();
    plan.points = document.at("points");
    for (const Json& entry : document.at("runs")) {
      PlannedRun run{entry.at("folder").get<std::string>(), {}, {}, 0};
      for (const Json& value : entry.at("values")) run.values.emplace_back(value.at(0), value.at(1));
      run.frames = entry.value("frames", plan.frames);
      if (entry.contains("identity")) run.identity = entry.at("identity").get<std::uint64_t>();
      plan.runs.push_back(std::move(run));
    }
    return plan;
  } catch (const Json::exception& error) {
    throw FileError(file.string(), fmt::format("is no plan of a farm: {}", error.what()),
                    "write the scripts anew with `duet farm --overwrite`");
  }
}

bool holds_other_run(const PlannedRun& run) {
  if (!run.identity) return false;
  const std::optional<std::uint64_t> held = io::newest_identity({run.folder});
  return held && *held != *run.identity;
}

}  // namespace duet::farm
