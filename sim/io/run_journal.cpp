#include "sim/io/run_journal.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/base/file_hash.h"
#include "sim/base/files.h"
#include "sim/base/frame_limits.h"
#include "sim/io/json_text.h"

namespace duet::io {
namespace {

using Json = nlohmann::ordered_json;
using State = RunJournal::Entry::State;

// Texts of "state" in the file, by State. A line without "state" lists a whole file.
constexpr const char* states[] = {"", "replacing", "removed"};
constexpr const char* flawed = "flawed";  // further text of "state", which sets Entry::is_flawed
constexpr const char* closed = "closed";  // "state" in the last line of a part

// Parses a hexadecimal number; returns none if the text is not one.
std::optional<std::uint64_t> number_of(const std::string& hexadecimal) {
  std::uint64_t number = 0;
  const char* end = hexadecimal.data() + hexadecimal.size();
  const auto [rest, error] = std::from_chars(hexadecimal.data(), end, number, 16);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

// Returns true if the name is a relative path that does not leave the folder of its run.
bool is_inside(const fs::path& name) {
  return name.is_relative() && !name.empty() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
}

// Returns a verb phrase that tells how the file differs from what is listed; empty if it does not.
std::string difference(const FileMark& found, const FileMark& listed) {
  if (found == listed) return {};
  if (found.bytes != listed.bytes)
    return fmt::format("is damaged: it has {} bytes, and {} were written", found.bytes, listed.bytes);
  return fmt::format("is damaged: its {} bytes have the hash {:016x}, and {:016x} was written", found.bytes,
                     found.hash, listed.hash);
}

// Returns whether another program lists the file with the mark `found`.
bool is_listed_by_others(const FileMark& found, const RunJournal::Entry& entry) {
  return std::find(entry.others.begin(), entry.others.end(), found) != entry.others.end();
}

fs::path parts_folder(const fs::path& root) { return root / "journal"; }

// Returns the texts of the parts of a journal by their paths. A part that vanishes meanwhile is left out.
std::map<fs::path, std::string> texts_of_parts(const fs::path& root) {
  std::map<fs::path, std::string> parts;
  std::error_code missing;
  if (!fs::is_directory(parts_folder(root), missing)) return parts;
  for (const fs::path& path : files_in(parts_folder(root)))
    if (is_growing(path))
      if (std::optional<std::string> text = read_file_if_there(path)) parts[path] = *std::move(text);
  return parts;
}

}  // namespace

fs::path journal_path(const fs::path& root) { return root / "journal.jsonl"; }

bool is_growing(const fs::path& path) { return path.extension() == ".jsonl"; }

FileMark mark_of(std::string_view bytes) {
  FileHash hash;
  hash.add(bytes);
  return {hash.size(), hash.value()};
}

FileMark mark_of_file(const fs::path& path, std::uint64_t most) {
  FileHash hash;
  read_pieces(path, [&](std::string_view piece) {
    hash.add(piece.substr(0, std::min<std::uint64_t>(piece.size(), most - hash.size())));
    return hash.size() < most;
  });
  return {hash.size(), hash.value()};
}

std::shared_ptr<RunJournal> RunJournal::read(const fs::path& root) {
  // Another program may begin a new journal meanwhile. An error that lasts is there at each of the attempts.
  constexpr int attempts = 10;
  const fs::path path = journal_path(root);
  for (int attempt = 1;; ++attempt) try {
      std::shared_ptr<RunJournal> journal(new RunJournal(root));
      const auto parts =
          texts_of_parts(root);  // first: a part that is gone is merged into the journal by now
      const std::optional<std::string> text = read_file_if_there(path);
      if (!text) return nullptr;
      journal->parse(path, *text);
      journal->merge(parts);
      return journal;
    } catch (const FileError&) {
      if (attempt == attempts) throw;
    }
}

std::shared_ptr<RunJournal> RunJournal::open(const fs::path& root, int first_frame) {
  std::shared_ptr<RunJournal> journal(new RunJournal(root));
  const fs::path path = journal_path(root);
  const std::string text = fs::exists(path) ? read_file(path) : std::string();
  if (fs::exists(path)) journal->parse(path, text);
  const std::size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
  if (whole < text.size() && ::truncate(path.c_str(), static_cast<off_t>(whole)) != 0)
    throw system_error(path, "cannot write", errno);
  if (whole == 0) {
    journal->first_frame_ = first_frame;
    journal->write_line(Json{{"journal", 1}, {"first_frame", first_frame}}.dump());
  }
  journal->absorb_parts();
  return journal;
}

RunJournal::~RunJournal() {
  if (file_ >= 0) ::close(file_);
}

void RunJournal::parse(const fs::path& path, std::string_view text) {
  int number = 0;
  for (std::size_t end = 0; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1)) {
    ++number;
    if (!parse_line(text.substr(0, end), number == 1))
      faults_.push_back(fmt::format("{}: line {} is damaged: the files of its run are not all checked",
                                    path.string(), number));
  }
  // A last line without an end was not written whole, as after a power failure. It is ignored.
  is_torn_ = !text.empty();
  if (number == 0)
    faults_.push_back(fmt::format("{}: holds no line: the files of its run are not checked", path.string()));
}

bool RunJournal::parse_line(std::string_view line, bool is_first) {
  const Json object = parse_json<Json>(line);
  if (!object.is_object()) return false;
  try {
    if (is_first) {
      const double frame = object.at("first_frame").get<double>();
      if (object.at("journal") != 1 || !(frame >= 0 && frame <= max_frames + 1.0)) return false;
      first_frame_ = static_cast<int>(frame);
      if (object.contains("writer")) writer_ = read_process(object.at("writer").dump());
      return true;
    }
    if (writer_ && object.value("state", "") == closed) {
      is_closed_ = true;
      return true;
    }
    const std::string name = object.at("file").get<std::string>();
    if (!is_inside(name)) return false;
    const std::string state = object.value("state", "");
    Entry& entry = entries_[name];
    if (state == flawed) {
      entry.is_flawed = true;
      return true;
    }
    const auto* found = std::find(std::begin(states), std::end(states), state);
    if (found == std::end(states)) return false;
    entry.state = static_cast<State>(found - std::begin(states));
    if (entry.state == State::removed) entry.is_flawed = false;
    if (entry.state != State::whole && !object.contains("hash")) return true;
    const Json& bytes = object.at("bytes");
    const std::optional<std::uint64_t> hash = number_of(object.at("hash").get<std::string>());
    if (!bytes.is_number_unsigned() || !hash) return false;
    entry.mark = {bytes.get<std::uint64_t>(), *hash};
    entry.made_of = number_of(object.value("made_of", "0")).value_or(0);
    return true;
  } catch (const Json::exception&) {
    return false;
  }
}

// Returns the path relative to the run's folder. Returns none for files outside of it, and for names that
// are not UTF-8, which JSON cannot hold.
std::optional<std::string> RunJournal::name_of(const fs::path& path) const {
  std::string name = path.lexically_relative(root_).generic_string();
  if (!is_inside(name)) return std::nullopt;
  try {
    static_cast<void>(Json(name).dump());
  } catch (const Json::exception&) {
    return std::nullopt;
  }
  return name;
}

void RunJournal::write_line(const std::string& line) {
  const fs::path path = own_path();
  if (file_ < 0) file_ = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) throw system_error(path, "cannot write", errno);
  append_line(file_, path, line);
}

void RunJournal::append(const std::string& name, const char* state, const std::optional<FileMark>& mark,
                        std::uint64_t made_of) {
  Json object = {{"file", name}};
  if (*state != '\0') object["state"] = state;
  if (mark) {
    object["bytes"] = mark->bytes;
    object["hash"] = fmt::format("{:016x}", mark->hash);
  }
  if (made_of != 0) object["made_of"] = fmt::format("{:016x}", made_of);
  write_line(object.dump());
}

void RunJournal::list(const fs::path& path, const FileMark& mark, std::uint64_t made_of) {
  const std::optional<std::string> name = name_of(path);
  if (!name) return;
  const std::lock_guard lock(mutex_);
  if (const auto known = entries_.find(*name);
      known != entries_.end() && known->second.state == State::whole && known->second.mark == mark &&
      known->second.made_of == made_of && known->second.others.empty())
    return;
  append(*name, "", mark, made_of);
  Entry& entry = entries_[*name];
  entry.state = State::whole;
  entry.mark = mark;
  entry.made_of = made_of;
  entry.others.clear();
}

void RunJournal::replace(const fs::path& path, const std::optional<FileMark>& next) {
  const std::optional<std::string> name = name_of(path);
  if (!name) return;
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(*name);
  if (entry == entries_.end() || entry->second.state != State::whole) return;
  append(*name, states[static_cast<int>(State::replacing)], part_.empty() ? std::nullopt : next);
  entry->second.state = State::replacing;
}

void RunJournal::remove(const fs::path& path) {
  const std::optional<std::string> name = name_of(path);
  if (!name) return;
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(*name);
  if (entry == entries_.end() || entry->second.state == State::removed) return;
  append(*name, states[static_cast<int>(State::removed)], std::nullopt);
  entry->second = {State::removed, false, {}};
}

void RunJournal::flaw(const fs::path& path) {
  const std::optional<std::string> name = name_of(path);
  if (!name) return;
  const std::lock_guard lock(mutex_);
  append(*name, flawed, std::nullopt);
  entries_[*name].is_flawed = true;
}

std::optional<RunJournal::Entry> RunJournal::entry(const fs::path& path) const {
  const std::optional<std::string> name = name_of(path);
  if (!name) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(*name);
  return entry == entries_.end() ? std::nullopt : std::optional(entry->second);
}

std::map<std::string, RunJournal::Entry> RunJournal::entries() const {
  const std::lock_guard lock(mutex_);
  return entries_;
}

std::string RunJournal::fault(const fs::path& path, std::string_view bytes) const {
  const std::optional<Entry> listed = entry(path);
  if (!listed) return {};
  if (listed->is_flawed) return "was damaged when its run was continued";
  if (listed->state != State::whole) return {};
  if (is_growing(path)) bytes = bytes.substr(0, listed->mark.bytes);
  const FileMark found = mark_of(bytes);
  return is_listed_by_others(found, *listed) ? std::string() : difference(found, listed->mark);
}

std::string RunJournal::fault(const fs::path& path) const {
  const std::optional<Entry> listed = entry(path);
  if (!listed) return {};
  if (listed->is_flawed) return "was damaged when its run was continued";
  if (listed->state != State::whole) return {};
  std::error_code error;
  const std::uint64_t size = fs::file_size(path, error);
  if (error == std::errc::no_such_file_or_directory) return "is missing";
  // A file of the wrong length is damaged without reading it.
  if (!error && listed->others.empty() &&
      (is_growing(path) ? size < listed->mark.bytes : size != listed->mark.bytes))
    return difference({size, 0}, listed->mark);
  const FileMark found = mark_of_file(path, is_growing(path) ? listed->mark.bytes : UINT64_MAX);
  return is_listed_by_others(found, *listed) ? std::string() : difference(found, listed->mark);
}

}  // namespace duet::io
