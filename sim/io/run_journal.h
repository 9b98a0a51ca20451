// journal.jsonl: which files a run has written, with their lengths and hashes, so that whatever reads a run
// can tell a file that was damaged or lost since.
//
// A line is appended once a file has its name: {"file":"mesh/0003.obj","bytes":71,"hash":"0123456789abcdef"}.
// The last line of a file counts. A file that is about to change has a line with "state":"replacing" before
// it does, one that is about to go a line with "removed", so that a program that is killed between two calls
// leaves files that are not checked, and none that seem damaged. Files that grow (*.jsonl) are listed with
// the bytes that they had; what follows these is not checked. "flawed" is said of a growing file that was
// found damaged when its run was continued. The first line, {"journal":1,"first_frame":0}, says from which
// frame on files are listed: not from 0 where a program without journals began the run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace duet::io {

namespace fs = std::filesystem;

/// The length and the hash (FileHash) of a file.
struct FileMark {
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;
  bool operator==(const FileMark&) const = default;
};
FileMark mark_of(std::string_view bytes);

/// Of the file's first `most` bytes, read in pieces. Throws FileError.
FileMark mark_of_file(const fs::path& path, std::uint64_t most = UINT64_MAX);

/// Whether files of this name grow line by line.
bool is_growing(const fs::path& path);

/// All members may be called from any thread. Paths are those of files in the run's folder.
class RunJournal {
 public:
  struct Entry {
    enum class State { whole, replacing, removed } state = State::whole;
    bool is_flawed = false;
    FileMark mark;
  };

  /// The journal of the run in the folder; none where it has none. Throws FileError where it cannot be read.
  static std::shared_ptr<RunJournal> read(const fs::path& root);

  /// The same for a simulation that continues the run after the frame before `first_frame`; makes a journal
  /// where there is none, and cuts off a line that was not written to its end. Throws FileError.
  static std::shared_ptr<RunJournal> open(const fs::path& root, int first_frame);

  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  void list(const fs::path& path, const FileMark& mark);  ///< after the file is written; throws FileError
  void replace(const fs::path& path);                     ///< before another file takes its place
  void remove(const fs::path& path);                      ///< before it is removed
  void flaw(const fs::path& path);                        ///< of a growing file that is damaged, and goes on

  /// What the last line of the file says; none where there is no line.
  std::optional<Entry> entry(const fs::path& path) const;
  std::map<std::string, Entry> entries() const;  ///< by the path from the run's folder on

  /// Why the file is not what is listed: "is missing", "is damaged: ..."; empty where it is, or is not listed
  /// as whole.
  std::string fault(const fs::path& path) const;
  /// The same for a file whose bytes are read already.
  std::string fault(const fs::path& path, std::string_view bytes) const;

  int first_frame() const { return first_frame_; }
  /// Lines of the file that are none of a journal, in words.
  const std::vector<std::string>& faults() const { return faults_; }

 private:
  explicit RunJournal(const fs::path& root) : root_(root) {}
  void parse(std::string_view text);
  bool parse_line(std::string_view line, bool is_first);
  void append(const std::string& name, const char* state, const std::optional<FileMark>& mark);
  void write_line(const std::string& line);
  std::optional<std::string> name_of(const fs::path& path) const;

  const fs::path root_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
  std::vector<std::string> faults_;
  int first_frame_ = 0;
  int file_ = -1;  // opened for the first line that is appended
};

fs::path journal_path(const fs::path& root);

}  // namespace duet::io
