#include "sim/io/stage_log.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/io/json_text.h"

namespace duet::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t digits = 8;  // digits of a hash in the file

std::string_view name_of(Owner owner) {
  switch (owner) {
    case Owner::rigid:
      return "rigid";
    case Owner::deformable:
      return "deformable";
    case Owner::body:
      return "body";
    case Owner::scene:
      return "scene";
  }
  return {};
}

// Folds each hash of 64 bits into 8 hexadecimal digits and joins them.
std::string digits_of(const std::vector<std::uint64_t>& hashes) {
  std::string text;
  text.reserve(digits * hashes.size());
  for (const std::uint64_t hash : hashes)
    fmt::format_to(std::back_inserter(text), "{:08x}", static_cast<std::uint32_t>(hash ^ (hash >> 32)));
  return text;
}

// Reads a file hashes.jsonl line by line, and holds the hashes of all quantities after the stage it has
// reached.
class StageHashReader {
 public:
  using Quantity = std::pair<std::string, std::string>;  // name of the owner, name of the quantity

  explicit StageHashReader(const RunDirectory& run) : path_(run.stage_hashes()), file_(path_) {
    if (!file_)
      throw FileError(path_.string(), "cannot be read", "`duet sim SCENE --hash-stages --out DIR` writes it");
    run.require_whole(path_);
    const Json header = next_object();
    try {
      rigid_ = header.at("rigid").get<std::vector<std::string>>();
      deformable_ = header.at("deformable").get<std::vector<std::string>>();
    } catch (const Json::exception&) {
      damaged();
    }
  }

  // Advances to the next stage; returns false at the end of the file.
  bool advance() {
    Json object = next_object();
    if (object.is_null()) return false;
    try {
      const auto number = integer_of<int>(object.at("frame")), in_frame = integer_of<int>(object.at("step"));
      if (!number || !in_frame) damaged();
      frame = *number;
      step = *in_frame;
      stage = object.at("stage").get<std::string>();
      for (const Owner owner : {Owner::rigid, Owner::deformable, Owner::body, Owner::scene}) {
        const std::string key(name_of(owner));
        if (!object.contains(key)) continue;
        for (auto& [name, hashes] : object[key].items()) {
          std::string text = hashes.get<std::string>();
          if (text.size() != digits * owners(owner)) damaged();
          set({key, name}, std::move(text));
        }
      }
    } catch (const Json::exception&) {
      damaged();
    }
    return true;
  }

  // Returns the quantities with their hashes, in the order in which they first occurred.
  const std::vector<std::pair<Quantity, std::string>>& quantities() const { return quantities_; }
  // Returns the name of the body that the hash with this index belongs to; empty for the scene.
  std::string body(const std::string& owner, std::size_t index) const {
    if (owner == "scene") return {};
    if (owner == "deformable") return deformable_[index];
    return index < rigid_.size() ? rigid_[index] : deformable_[index - rigid_.size()];
  }
  bool has_quantities_of(const StageHashReader& other) const {
    return std::equal(quantities_.begin(), quantities_.end(), other.quantities_.begin(),
                      other.quantities_.end(),
                      [](const auto& mine, const auto& theirs) { return mine.first == theirs.first; });
  }
  bool has_bodies_of(const StageHashReader& other) const {
    return rigid_ == other.rigid_ && deformable_ == other.deformable_;
  }
  const fs::path& path() const { return path_; }

  int frame = 0, step = 0;  // frame and step of the stage reached
  std::string stage;        // label of the stage reached

 private:
  [[noreturn]] void damaged() const {
    throw FileError(path_.string(), fmt::format("line {} is no record of a stage", line_),
                    "simulate anew with --hash-stages");
  }
  // Returns the object of the next line; null at the end of the file.
  Json next_object() {
    std::string text;
    if (!std::getline(file_, text)) return {};
    ++line_;
    Json object = parse_json<Json>(text);
    if (!object.is_object()) damaged();
    return object;
  }
  // Returns how many hashes a quantity of this owner has.
  std::size_t owners(Owner owner) const {
    switch (owner) {
      case Owner::rigid:
        return rigid_.size();
      case Owner::deformable:
        return deformable_.size();
      case Owner::body:
        return rigid_.size() + deformable_.size();
      case Owner::scene:
        return 1;
    }
    return 0;
  }
  void set(const Quantity& quantity, std::string hashes) {
    const auto [found, is_new] = index_.try_emplace(quantity, quantities_.size());
    if (is_new) quantities_.emplace_back(quantity, std::string());
    quantities_[found->second].second = std::move(hashes);
  }

  fs::path path_;
  std::ifstream file_;
  int line_ = 0;
  std::vector<std::string> rigid_, deformable_;
  std::vector<std::pair<Quantity, std::string>> quantities_;
  std::map<Quantity, std::size_t> index_;
};

// Compares the stages that two readers have reached.
std::optional<StageDifference> difference_of(const StageHashReader& a, const StageHashReader& b) {
  StageDifference difference;
  difference.frame = a.frame;
  difference.step = a.step;
  difference.stage = a.stage;
  difference.other_stage = b.stage;
  if (std::tie(a.frame, a.step, a.stage) != std::tie(b.frame, b.step, b.stage)) return difference;
  for (std::size_t q = 0; q < a.quantities().size(); ++q) {
    const auto& [quantity, hashes] = a.quantities()[q];
    const std::string& others = b.quantities()[q].second;
    if (hashes == others) continue;
    if (!difference.quantity.empty()) {
      difference.others.push_back(quantity.second);
      continue;
    }
    difference.quantity = quantity.second;
    for (std::size_t i = 0; i < hashes.size() / digits; ++i) {
      if (hashes.compare(digits * i, digits, others, digits * i, digits) == 0) continue;
      if (difference.bodies++ == 0) difference.body = a.body(quantity.first, i);
    }
  }
  return difference.quantity.empty() ? std::nullopt : std::optional(difference);
}

}  // namespace

StageLog::StageLog(const RunDirectory& run, const std::vector<BodyHashes>& bodies, int last_kept)
    : lines_(run, run.stage_hashes(), last_kept) {
  if (!lines_.is_empty()) return;
  Json rigid = Json::array(), deformable = Json::array();
  for (const BodyHashes& body : bodies) {
    if (body.owner == Owner::rigid) rigid.push_back(body.name);
    if (body.owner == Owner::deformable) deformable.push_back(body.name);
  }
  lines_.append(Json{{"frame", 0}, {"rigid", rigid}, {"deformable", deformable}}.dump());
}

void StageLog::append(const StageRecord& record) {
  Json object = {{"frame", record.frame}, {"step", record.step}, {"stage", record.stage}};
  for (std::size_t q = 0; q < record.quantities.size(); ++q) {
    const QuantityHashes& quantity = record.quantities[q];
    if (q < last_.size() && last_[q].hashes == quantity.hashes) continue;
    object[std::string(name_of(quantity.owner))][std::string(quantity.name)] = digits_of(quantity.hashes);
  }
  last_ = record.quantities;
  lines_.append(object.dump());
}

StageComparison compare_stages(const RunDirectory& a, const RunDirectory& b) {
  StageHashReader one(a), two(b);
  if (!one.has_bodies_of(two))
    throw Error(ExitStatus::usage, fmt::format("{} and {} are of scenes with other bodies",
                                               one.path().string(), two.path().string()));
  StageComparison comparison;
  while (true) {
    const bool more = one.advance(), more_too = two.advance();
    comparison.same_length = more == more_too;
    if (!more || !more_too) return comparison;
    if (comparison.stages == 0 && one.frame != two.frame)
      throw Error(ExitStatus::usage,
                  fmt::format("{} begins with frame {}, {} with frame {}", one.path().string(), one.frame,
                              two.path().string(), two.frame));
    if (!one.has_quantities_of(two))
      throw Error(ExitStatus::usage, fmt::format("{} and {} are of programs that hash other quantities",
                                                 one.path().string(), two.path().string()));
    comparison.difference = difference_of(one, two);
    if (comparison.difference) return comparison;
    ++comparison.stages;
    comparison.last_frame = one.frame;
  }
}

std::string StageComparison::text() const {
  const std::string equal =
      fmt::format("{} stages{} are equal", stages,
                  stages > 0 ? fmt::format(" up to frame {}", last_frame) : std::string());
  if (!difference) return equal + (same_length ? "" : "; one of the runs ends there");
  const StageDifference& d = *difference;
  std::string where = fmt::format("frame {}, step {}, after `{}`", d.frame, d.step, d.stage);
  if (d.quantity.empty())
    return fmt::format("{}: the second run has `{}` there; {} before", where, d.other_stage, equal);
  where +=
      fmt::format(": {}{}", d.quantity, d.body.empty() ? std::string() : fmt::format(" of `{}`", d.body));
  if (d.bodies > 1) where += fmt::format(" and {} more", d.bodies - 1);
  if (!d.others.empty()) where += fmt::format("; also {}", fmt::join(d.others, ", "));
  return fmt::format("{} ({} before)", where, equal);
}

}  // namespace duet::io
