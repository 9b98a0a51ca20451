// The one error type of the project, with fields. Libraries throw it; only tools/ prints it and exits.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "sim/base/types.h"

namespace duet {

// Exit statuses of the program.
enum class ExitStatus {
  done = 0,
  differs = 1,       // `duet compare`: the pictures differ by more than the bounds
  usage = 2,         // bad command line or scene
  simulation = 3,    // the simulation failed; the last good frame and checkpoint are kept
  files = 4,         // a file or folder could not be read or written, or a run-time library is missing
  unfinished = 75,   // --stop-after: the time was over before the work; the same command goes on
  interrupted = 130  // SIGINT; the run can be resumed
};

class Error : public std::runtime_error {
 public:
  Error(ExitStatus status, const std::string& message) : std::runtime_error(message), status_(status) {}
  ExitStatus status() const { return status_; }

 private:
  ExitStatus status_;
};

// One thing wrong with a scene file. `hint` holds the remedy or the near miss ("did you mean `friction`?").
struct SceneProblem {
  std::string file;
  int line = 0;    // 1-based; 0 when the problem has no place in the file
  int column = 0;  // 1-based
  std::string key;
  std::string message;
  std::string hint;
  std::string text() const;  // "file:line:column: key: message (hint)"
};

// All problems of a scene in one go.
class SceneError : public Error {
 public:
  explicit SceneError(std::vector<SceneProblem> problems);
  const std::vector<SceneProblem>& problems() const { return problems_; }

 private:
  std::vector<SceneProblem> problems_;
};

// A file that cannot be read or written: path, what went wrong, what to do.
class FileError : public Error {
 public:
  FileError(const std::string& path, const std::string& what, const std::string& remedy = {});
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Where and why a simulation stopped. Fields that do not apply stay empty or negative.
struct SimulationFault {
  std::string stage;  // "V.2 constrained solve"
  double time = 0;    // s
  int frame = -1;
  int substep = -1;
  std::string body;              // name of the body
  std::string element;           // "particle 17", "tet 204"
  Vec3 position = Vec3::Zero();  // m
  double value = 0;              // the value that broke the bound
  double bound = 0;              // the bound it broke
  std::string cause;             // likely cause
  std::string remedy;            // the setting to change
  std::string text() const;
};

class SimulationError : public Error {
 public:
  explicit SimulationError(SimulationFault fault);
  const SimulationFault& fault() const { return fault_; }
  SimulationFault& fault() { return fault_; }

 private:
  SimulationFault fault_;
};

}  // namespace duet
