// Options that several commands share, and the commands whose options are declared in files of their own.
#pragma once

#include <string>
#include <vector>

#include "tools/command_line.h"
#include <CLI/CLI.hpp>

namespace duet::tools {

// Returns a validator for numbers from `least` to `most`. CLI::Range would accept NaN.
CLI::Validator between(double least, double most);

// Adds an option that can be given several times, with one value each time.
void add_repeatable(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                    const std::string& type, const std::string& help);

// Adds the scene, --set and --accuracy. Returns the option of the scene.
CLI::Option* add_scene(CLI::App& app, SceneChoice& scene);

// Adds --without.
void add_without(CLI::App& app, SceneChoice& scene);

// Adds --quiet and --json.
void add_report(CLI::App& app, CommandLine& line);

// Adds `check` and `explain`.
void add_scene_commands(CLI::App& app, CommandLine& line);

// Adds `encode` and `farm`.
void add_encode_and_farm(CLI::App& app, CommandLine& line);

// Adds `cache` and `list`.
void add_cache_and_list(CLI::App& app, CommandLine& line);

// Adds `manual`, which describes the commands of `app`.
void add_manual(CLI::App& app, CommandLine& line);

}  // namespace duet::tools
