#include "tools/option_parts.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace duet::tools {

CLI::Validator between(double least, double most) {
  const auto check = [=](const std::string& text) {
    double value = 0;
    const bool is_inside = CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
    return is_inside ? std::string()
                     : fmt::format("a number from {:g} to {:g} is expected, not {}", least, most, text);
  };
  return {check, fmt::format("[{:g} - {:g}]", least, most)};
}

void add_repeatable(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                    const std::string& type, const std::string& help) {
  app.add_option(name, values, help)
      ->type_name(type)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

CLI::Option* add_scene(CLI::App& app, SceneChoice& scene) {
  add_repeatable(app, "--set", scene.set, "KEY=VALUE",
                 "Change a key of the scene, as if it were written in the file; repeatable");
  app.add_option("--accuracy", scene.accuracy, "Same as --set solver.accuracy=...")
      ->check(CLI::IsMember({"draft", "standard", "fine"}))
      ->type_name("LEVEL");
  return app
      .add_option(
          "scene", scene.name,
          "Path of a scene file, name of a scene that ships (`duet list`), or folder of a run to repeat")
      ->type_name("SCENE");
}

void add_without(CLI::App& app, SceneChoice& scene) {
  add_repeatable(app, "--without", scene.without, "EFFECT",
                 "Leave an effect out (`duet explain` names them); repeatable");
}

void add_report(CLI::App& app, CommandLine& line) {
  CLI::Option* quiet = app.add_flag("--quiet", line.quiet, "Only the outcome and errors");
  app.add_flag("--json", line.json, "One JSON object a line")->excludes(quiet);
}

}  // namespace duet::tools
