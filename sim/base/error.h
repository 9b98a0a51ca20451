// The error types of the project, with fields that say what went wrong and where. Libraries throw them; only
// tools/ prints them and exits.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "sim/base/types.h"

namespace duet {

/// Exit statuses of the program.
enum class ExitStatus {
  /// The command did what was asked.
  done = 0,
  /// `duet compare`: the pictures differ by more than the bounds.
  differs = 1,
  /// The command line or the scene is bad.
  usage = 2,
  /// The simulation failed; the last good frame and checkpoint are kept.
  simulation = 3,
  /// A file or folder could not be read or written, or a run-time library is missing.
  files = 4,
  /// The time of --stop-after was over before the work; the same command with --resume goes on.
  unfinished = 75,
  /// SIGINT stopped the run, which can be resumed.
  interrupted = 130
};

/// Base of all errors that the libraries throw.
class Error : public std::runtime_error {
 public:
  /// Constructs an error with the exit `status` that the program ends with and a `message` for the user.
  Error(ExitStatus status, const std::string& message) : std::runtime_error(message), status_(status) {}
  /// Returns the exit status that the program ends with.
  ExitStatus status() const { return status_; }

 private:
  ExitStatus status_;
};

/// One problem in a scene file.
struct SceneProblem {
  /// Path of the scene file.
  std::string file;
  int line = 0;         ///< Line of the problem, from 1; 0 if it has no place in the file.
  int column = 0;       ///< Column of the problem, from 1.
  std::string key;      ///< Scene key that the problem is about; empty if it is about none.
  std::string message;  ///< Description of the problem.
  /// The remedy or the near miss ("did you mean `friction`?"); empty if there is none.
  std::string hint;
  /// Returns "file:line:column: key: message (hint)", without the parts that are empty.
  std::string text() const;
};

/// All problems of a scene together.
class SceneError : public Error {
 public:
  /// Constructs the error; its message has one line per problem, and its status is ExitStatus::usage.
  explicit SceneError(std::vector<SceneProblem> problems);
  /// Returns the problems in the order in which they were given.
  const std::vector<SceneProblem>& problems() const { return problems_; }

 private:
  std::vector<SceneProblem> problems_;
};

/// A file or folder that cannot be read or written.
class FileError : public Error {
 public:
  /// Constructs the message "path: what (remedy)". The status is ExitStatus::files. An empty `remedy` is left
  /// out.
  FileError(const std::string& path, const std::string& what, const std::string& remedy = {});
  /// Returns the path of the file or folder.
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Describes where and why a simulation stopped. Fields that do not apply stay empty or negative.
struct SimulationFault {
  std::string stage;             ///< Number and name of the stage, such as "V.2 constrained solve".
  double time = 0;               ///< Simulated time, s.
  int frame = -1;                ///< Number of the frame being simulated; -1: none.
  int substep = -1;              ///< Number of the time step within the frame; -1: none.
  std::string body;              ///< Name of the body; empty: none.
  std::string element;           ///< Part of the body, such as "particle 17" or "tet 204"; empty: none.
  Vec3 position = Vec3::Zero();  ///< World position of `element`, m.
  double value = 0;              ///< The value that broke the bound, in SI units.
  double bound = 0;              ///< The bound that it broke, in SI units.
  std::string cause;             ///< The likely cause; empty: unknown.
  std::string remedy;            ///< The setting to change; empty: unknown.
  /// Returns the fault as one line, without the body, element, cause and remedy that are empty.
  std::string text() const;
};

/// A simulation that failed.
class SimulationError : public Error {
 public:
  /// Constructs the error with the text of `fault` as its message. The status is ExitStatus::simulation.
  /// Fields of the fault that are changed later do not change the message.
  explicit SimulationError(SimulationFault fault);
  /// Returns the description of where and why the simulation stopped.
  const SimulationFault& fault() const { return fault_; }
  /// Returns the fault for callers that add fields, such as the frame, and throw a new error.
  SimulationFault& fault() { return fault_; }

 private:
  SimulationFault fault_;
};

}  // namespace duet
