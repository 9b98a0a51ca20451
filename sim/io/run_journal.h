// journal.jsonl: the files that a run has written, with their lengths and hashes, so that readers of a run
// recognize files that were damaged or lost later.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/io/run_claim.h"

namespace duet::io {

namespace fs = std::filesystem;

/// Length and hash of a file, by which damage is recognized.
struct FileMark {
  std::uint64_t bytes = 0;  ///< length
  std::uint64_t hash = 0;   ///< XXH64 of the bytes, see FileHash
  /// Returns true if length and hash are equal.
  bool operator==(const FileMark&) const = default;
};

/// Returns the length and the hash of the bytes.
FileMark mark_of(std::string_view bytes);

/// Returns the length and the hash of the first `most` bytes of a file, or of all if it is shorter. The
/// file is read in pieces. Throws FileError.
FileMark mark_of_file(const fs::path& path, std::uint64_t most = UINT64_MAX);

/// Returns true for names of files that grow line by line: *.jsonl.
bool is_growing(const fs::path& path);

/// The journal of a run: a file of JSON objects, one on each line, to which lines are appended.
///
/// The first line, {"journal":1,"first_frame":0}, tells from which frame on files are listed. It is not 0
/// if a program without journals began the run. A file is listed once it has its final name:
/// {"file":"mesh/0003.obj","bytes":71,"hash":"0123456789abcdef"}. The last line about a file counts. Before
/// a file is replaced, a line with "state":"replacing" is appended, and before it is removed one with
/// "removed". A program that is killed between the two calls thus leaves a file that is not checked, and
/// none that seems damaged. A growing file (*.jsonl) is listed with the bytes that it has at that time;
/// bytes after these are not checked. "state":"flawed" marks a growing file that was found damaged when its
/// run was continued.
///
/// Only the program that holds the claim of the run (RunClaim) appends to journal.jsonl. Programs that draw
/// pictures meanwhile have a part of the journal each, journal/HOST-PROCESS-START-NUMBER.jsonl, because
/// several machines cannot append to one file of a shared file system. Readers read the parts as well. A
/// picture that two programs drew is whole if it is as one of them lists it. Parts whose writers have ended
/// are merged into journal.jsonl.
///
/// All members may be called from any thread. Paths are those of files in the run's folder; other paths,
/// and names that are not UTF-8, are not listed.
class RunJournal {
 public:
  /// Knowledge about one file.
  struct Entry {
    /// State of the file after the last line about it.
    enum class State {
      whole,                 ///< written: it must be as `mark` says
      replacing,             ///< about to be replaced: it is not checked
      removed                ///< removed, or about to be: it is not checked
    } state = State::whole;  ///< state of the file
    bool is_flawed = false;  ///< true if a growing file was found damaged when its run was continued
    FileMark mark;           ///< length and hash; valid in the state `whole`
    /// Hash of what the file was made of, such as the pictures of a video; 0: unknown.
    std::uint64_t made_of = 0;
    /// Further marks of a whole file, which other programs that write it at the same time list.
    std::vector<FileMark> others = {};
  };

  /// Reads the journal of the run in the folder `root`; returns null if there is none. Throws FileError if
  /// it cannot be read.
  static std::shared_ptr<RunJournal> read(const fs::path& root);

  /// Opens the journal for a simulation that writes the frames from `first_frame` on. Creates the journal
  /// if there is none, cuts off a last line without an end, and merges the parts whose writers have ended. To
  /// be called by the holder of the run's claim. Throws FileError.
  static std::shared_ptr<RunJournal> open(const fs::path& root, int first_frame);

  /// Makes this journal, which read() returned, append to a part of its own from now on. Throws FileError.
  void begin_part();
  /// Ends the part, and merges it into journal.jsonl if no other program holds the claim of the run;
  /// otherwise its holder or a later program does so. Does nothing without a part. Throws FileError.
  void end_part();
  /// Returns the numbers of the processes that write parts, and that run or may run on another machine.
  static std::set<long> writers_of_parts(const fs::path& root);

  ~RunJournal();
  RunJournal(const RunJournal&) = delete;
  RunJournal& operator=(const RunJournal&) = delete;

  /// Lists a file after it was written, unless it is listed like this already. `made_of` is that of the
  /// entry. Throws FileError.
  void list(const fs::path& path, const FileMark& mark, std::uint64_t made_of = 0);
  /// Notes that another file, with the mark `next`, is about to take the place of a listed one. Throws
  /// FileError.
  void replace(const fs::path& path, const std::optional<FileMark>& next = std::nullopt);
  /// Notes that a file is about to be removed. Throws FileError.
  void remove(const fs::path& path);
  /// Notes that a growing file is damaged and is going to grow on. Throws FileError.
  void flaw(const fs::path& path);

  /// Returns what the last line about the file says; none if no line is about it.
  std::optional<Entry> entry(const fs::path& path) const;
  /// Returns the entries of all files, by their paths relative to the run's folder.
  std::map<std::string, Entry> entries() const;

  /// Compares the file with its entry. Returns what is wrong: "is missing", "is damaged: ..."; empty if it
  /// is as listed or is not listed as whole. Throws FileError if it cannot be read.
  std::string fault(const fs::path& path) const;
  /// Compares `bytes`, which were read from the file, with its entry. Returns what is wrong, or an empty
  /// text if they are as listed or the file is not listed as whole.
  std::string fault(const fs::path& path, std::string_view bytes) const;

  /// Returns the first frame whose files are listed.
  int first_frame() const { return first_frame_; }
  /// Returns a sentence for each line of the journal that cannot be understood, and one if it has no line.
  const std::vector<std::string>& faults() const { return faults_; }
  /// Returns true if the last line of the journal has no end, so that it was ignored.
  bool is_torn() const { return is_torn_; }

 private:
  explicit RunJournal(const fs::path& root) : root_(root) {}
  // Reads the lines of the file `path` into the members.
  void parse(const fs::path& path, std::string_view text);
  // Adds what a part lists.
  void merge(const RunJournal& part);
  // Adds what the parts of the run list, whose texts are given by their paths.
  void merge(const std::map<fs::path, std::string>& parts);
  // Appends what the parts list whose writers have ended, removes these parts, and adds the others.
  void absorb_parts();
  // Returns the file to which this journal appends.
  fs::path own_path() const;
  // Reads a line into the members. Returns false if it is not a line of a journal.
  bool parse_line(std::string_view line, bool is_first);
  // Appends a line about a file: its state, unless that is empty, and its mark, if there is one.
  void append(const std::string& name, const char* state, const std::optional<FileMark>& mark,
              std::uint64_t made_of = 0);
  // Appends a line to the file, which it opens or creates first if need be.
  void write_line(const std::string& line);
  // Returns the name under which a file is listed; none if it cannot be listed.
  std::optional<std::string> name_of(const fs::path& path) const;

  const fs::path root_;
  mutable std::mutex mutex_;              // guards entries_ and the file
  std::map<std::string, Entry> entries_;  // keys are paths relative to root_
  std::vector<std::string> faults_;
  bool is_torn_ = false;
  int first_frame_ = 0;
  int file_ = -1;  // descriptor, opened for the first line that is appended
  fs::path part_;  // part to which this journal appends; empty: none
  // Of a part that was read: its writer, and whether it has written its last line.
  std::optional<ProcessName> writer_;
  bool is_closed_ = false;
};

/// Returns the path of the journal of the run in the folder.
fs::path journal_path(const fs::path& root);

}  // namespace duet::io
