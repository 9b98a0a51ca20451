#include "sim/base/error.h"

#include <fmt/format.h>

namespace duet {
namespace {

// Returns the texts of all problems, one per line.
std::string join(const std::vector<SceneProblem>& problems) {
  std::string text;
  for (const SceneProblem& problem : problems) {
    if (!text.empty()) text += '\n';
    text += problem.text();
  }
  return text;
}

}  // namespace

std::string SceneProblem::text() const {
  std::string text = line > 0 ? fmt::format("{}:{}:{}: ", file, line, column) : fmt::format("{}: ", file);
  if (!key.empty()) text += fmt::format("{}: ", key);
  text += message;
  if (!hint.empty()) text += fmt::format(" ({})", hint);
  return text;
}

SceneError::SceneError(std::vector<SceneProblem> problems)
    : Error(ExitStatus::usage, join(problems)), problems_(std::move(problems)) {}

FileError::FileError(const std::string& path, const std::string& what, const std::string& remedy)
    : Error(ExitStatus::files, remedy.empty() ? fmt::format("{}: {}", path, what)
                                              : fmt::format("{}: {} ({})", path, what, remedy)),
      path_(path) {}

std::string SimulationFault::text() const {
  std::string text =
      fmt::format("stage {} at t = {:.6g} s (frame {}, substep {})", stage, time, frame, substep);
  if (!body.empty()) text += fmt::format(", body `{}`", body);
  if (!element.empty())
    text +=
        fmt::format(", {} at ({:.4g}, {:.4g}, {:.4g}) m", element, position.x(), position.y(), position.z());
  text += fmt::format(": value {:.6g} breaks the bound {:.6g}", value, bound);
  if (!cause.empty()) text += fmt::format("; likely cause: {}", cause);
  if (!remedy.empty()) text += fmt::format("; remedy: {}", remedy);
  return text;
}

SimulationError::SimulationError(SimulationFault fault)
    : Error(ExitStatus::simulation, fault.text()), fault_(std::move(fault)) {}

}  // namespace duet
