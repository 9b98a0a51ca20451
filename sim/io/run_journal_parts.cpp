// Parts of a journal: those members of RunJournal by which programs that draw a run at the same time list
// their pictures, each in a file of its own.
#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

using Json = nlohmann::ordered_json;

fs::path folder_of_parts(const fs::path& root) { return root / "journal"; }

// Returns whether nothing is appended to a part any more.
bool has_ended(const std::optional<ProcessName>& writer, bool is_closed) {
  return is_closed || (writer && life_of(*writer) == Life::ended);
}

}  // namespace

fs::path RunJournal::own_path() const { return part_.empty() ? journal_path(root_) : part_; }

void RunJournal::merge(const RunJournal& part) {
  using State = Entry::State;
  faults_.insert(faults_.end(), part.faults_.begin(), part.faults_.end());
  for (const auto& [name, entry] : part.entries_) {
    const auto known = entries_.find(name);
    if (entry.state == State::whole) {
      Entry merged = entry;
      if (known != entries_.end() && known->second.state == State::whole) {
        merged.others = known->second.others;
        if (!(known->second.mark == entry.mark)) merged.others.push_back(known->second.mark);
      }
      entries_[name] = std::move(merged);
    } else if (entry.state == State::replacing && known != entries_.end() &&
               known->second.state == State::whole) {
      // Its writer may have been killed before or after it gave the new file its name.
      known->second.others.push_back(entry.mark);
    }
  }
}

void RunJournal::merge(const std::map<fs::path, std::string>& parts) {
  for (const auto& [path, text] : parts) {
    if (text.find('\n') == std::string::npos) continue;  // its writer is about to write the first line
    RunJournal part(root_);
    part.parse(path, text);
    merge(part);
  }
}

void RunJournal::absorb_parts() {
  using State = Entry::State;
  std::error_code missing;
  if (!fs::is_directory(folder_of_parts(root_), missing)) return;
  for (const fs::path& path : files_in(folder_of_parts(root_))) {
    if (!is_growing(path)) continue;
    RunJournal part(root_);
    const std::string text = read_file(path);
    if (text.find('\n') == std::string::npos) continue;
    part.parse(path, text);
    if (!has_ended(part.writer_, part.is_closed_)) {
      merge(part);
      continue;
    }
    for (const auto& [name, entry] : part.entries_)
      if (entry.state == State::whole)
        list(root_ / name, entry.mark, entry.made_of);
      else if (entry.state == State::replacing)
        replace(root_ / name);
    remove_file(path);
  }
  ::rmdir(folder_of_parts(root_).c_str());  // fails while there are parts
}

void RunJournal::begin_part() {
  const ProcessName self = this_process();
  std::string host = self.host;
  for (char& c : host)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  constexpr int attempts = 1000;  // parts of one process, and folders that vanish
  for (int number = 0; number < attempts; ++number) {
    create_folder(folder_of_parts(root_));
    part_ = folder_of_parts(root_) / fmt::format("{}-{}-{}-{}.jsonl", host, self.process, self.start, number);
    file_ = ::open(part_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file_ < 0 && errno != EEXIST && errno != ENOENT) throw system_error(part_, "cannot write", errno);
    if (file_ < 0) continue;
    write_line(
        Json{{"journal", 1}, {"first_frame", first_frame_}, {"writer", Json::parse(process_json(self))}}
            .dump());
    return;
  }
  throw system_error(part_, "cannot write", EEXIST);
}

void RunJournal::end_part() {
  if (part_.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    write_line(Json{{"state", "closed"}}.dump());
    ::close(file_);
    file_ = -1;
    part_.clear();
  }
  if (const auto holder = RunClaim::holder(root_); holder && !holder->work.ends_with("journal")) return;
  try {
    const RunClaim claim(root_, "duet, merging the journal");
    static_cast<void>(open(root_, first_frame_));
  } catch (const FileError&) {
    // Another program took the claim meanwhile: it, or a later one, merges the part, which readers read until
    // then.
  }
}

std::set<long> RunJournal::writers_of_parts(const fs::path& root) {
  std::set<long> writers;
  std::error_code missing;
  if (!fs::is_directory(folder_of_parts(root), missing)) return writers;
  for (const fs::path& path : files_in(folder_of_parts(root))) {
    std::string text;
    try {
      text = read_file(path);
    } catch (const FileError&) {
      continue;  // it was merged meanwhile
    }
    RunJournal part(root);
    part.parse(path, text);
    if (part.writer_ && !has_ended(part.writer_, part.is_closed_)) writers.insert(part.writer_->process);
  }
  return writers;
}

}  // namespace duet::io
