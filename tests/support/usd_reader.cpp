#include "tests/support/usd_reader.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace duet::test {
namespace {

// Key of values that hold for all frames.
constexpr int no_frame = -1;

std::string trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(' ');
  return begin == std::string::npos ? "" : line.substr(begin, line.find_last_not_of(" ,") - begin + 1);
}

std::string quoted(const std::string& line) {
  const std::size_t begin = line.find('"') + 1;
  return line.substr(begin, line.find('"', begin) - begin);
}

}  // namespace

// Reads text.
class UsdText {
 public:
  UsdText(const std::string& text, Usda& layer) : layer_(layer), lines_(text) {
    std::string line;
    EXPECT_TRUE(next(line));
    EXPECT_EQ(line, "#usda 1.0");
    while (next(line)) read_line(line);
    EXPECT_TRUE(path_.empty()) << "prims are closed";
  }

 private:
  bool next(std::string& line) {
    if (!std::getline(lines_, line)) return false;
    line = trimmed(line);
    return true;
  }
  std::string here() const {
    std::string path;
    for (const std::string& name : path_) path += "/" + name;
    return path;
  }
  void read_line(const std::string& line) {
    if (line.starts_with("def ") || line.starts_with("over ") || line.starts_with("class ")) {
      path_.push_back(quoted(line));
      layer_.in_order_.push_back(here());
      EXPECT_TRUE(layer_.prims_.emplace(here(), line.ends_with("(") ? block(")") : "").second)
          << here() << " is twice";
    } else if (line == "}") {
      path_.pop_back();
    } else if (line == "(") {
      layer_.prims_["/"] = block(")");
    } else if (line.find(" = ") != std::string::npos) {
      read_value(line);
    }
  }
  std::string block(const std::string& end) {
    std::string text, line;
    while (next(line) && line != end) text += line + "\n";
    return text;
  }
  void read_value(const std::string& line) {
    const std::size_t equals = line.find(" = ");
    std::string name = line.substr(0, equals), value = line.substr(equals + 3);
    name = name.substr(name.rfind(' ') + 1);
    const std::string mark = ".timeSamples";
    if (!name.ends_with(mark)) {
      if (const std::size_t end = value.find("] ("); end != std::string::npos) value.resize(end + 1);
      if (name == "interpolation") return;
      layer_.values_[here() + "." + name][no_frame] = value;
      return;
    }
    name.resize(name.size() - mark.size());
    auto& samples = layer_.values_[here() + "." + name];
    const auto add = [&](const std::string& sample) {
      const std::size_t colon = sample.find(": ");
      samples[std::stoi(sample.substr(0, colon))] = sample.substr(colon + 2);
    };
    if (value != "{") return add(trimmed(value.substr(1, value.size() - 2)));
    for (std::string sample; next(sample) && sample != "}";) add(sample);
  }

  Usda& layer_;
  std::istringstream lines_;
  std::vector<std::string> path_;
};

// Reads the binary format: pxr/usd/sdf/crateFile.cpp of OpenUSD, where all blocks hold literals alone.
class UsdBinary {
 public:
  UsdBinary(const std::string& bytes, Usda& layer) : layer_(layer), bytes_(bytes) {
    EXPECT_EQ(bytes_.substr(0, 11), std::string("PXR-USDC\0\10\0", 11));
    at_ = static_cast<std::size_t>(take_at<std::uint64_t>(16));
    for (auto count = take<std::uint64_t>(); count > 0; --count) {
      const std::string name = bytes_.substr(at_, 16).c_str();
      at_ += 16;
      sections_[name] = take<std::uint64_t>();
      take<std::uint64_t>();
    }
    read_tokens();
    read_fields();
    go_to("FIELDSETS");
    take<std::uint64_t>();
    field_sets_ = integers();
    read_paths();
    read_specs();
  }

 private:
  template <class Number>
  Number take_at(std::size_t at) const {
    Number number;
    if (at + sizeof(Number) > bytes_.size()) throw std::runtime_error("beyond the end of the file");
    std::memcpy(&number, bytes_.data() + at, sizeof(Number));
    return number;
  }
  template <class Number>
  Number take() {
    const Number number = take_at<Number>(at_);
    at_ += sizeof(Number);
    return number;
  }
  void go_to(const char* section) { at_ = static_cast<std::size_t>(sections_.at(section)); }

  // Returns the content of a block, and goes to its end.
  std::string block() {
    const auto size = static_cast<std::size_t>(take<std::uint64_t>()), end = at_ + size;
    EXPECT_EQ(take<std::uint8_t>(), 0) << "one chunk";
    std::size_t length = take<std::uint8_t>() >> 4;
    if (length == 15)
      for (std::uint8_t more = 255; more == 255; length += more) more = take<std::uint8_t>();
    EXPECT_EQ(at_ + length, end) << "literals alone";
    const std::string content = bytes_.substr(at_, length);
    at_ = end;
    return content;
  }
  // Returns the integers of a block; their number is told by the length of the block, as they are all used.
  std::vector<std::int32_t> integers(std::size_t count) {
    const std::string coded = block();
    std::size_t at = 4 + (2 * count + 7) / 8;
    std::int32_t common = 0;
    std::memcpy(&common, coded.data(), 4);
    std::vector<std::int32_t> result;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const int code = static_cast<unsigned char>(coded[4 + i / 4]) >> (2 * (i % 4)) & 3;
      std::int32_t difference = common;
      if (code == 1) difference = static_cast<std::int8_t>(coded.at(at));
      if (code == 2) {
        std::int16_t two = 0;
        std::memcpy(&two, coded.data() + at, 2);
        difference = two;
      }
      if (code == 3) std::memcpy(&difference, coded.data() + at, 4);
      at += code == 3 ? 4 : static_cast<std::size_t>(code);
      value += static_cast<std::uint32_t>(difference);
      result.push_back(static_cast<std::int32_t>(value));
    }
    EXPECT_EQ(at, coded.size());
    return result;
  }
  std::vector<std::int32_t> integers() {
    return integers(static_cast<std::size_t>(take_at<std::uint64_t>(at_ - 8)));
  }

  void read_tokens() {
    go_to("TOKENS");
    const auto count = take<std::uint64_t>(), size = take<std::uint64_t>();
    const std::string plain = block();
    EXPECT_EQ(plain.size(), size);
    for (std::size_t at = 0; at < plain.size(); at += tokens_.back().size() + 1)
      tokens_.emplace_back(plain.c_str() + at);
    EXPECT_EQ(tokens_.size(), count);
  }
  void read_fields() {
    go_to("FIELDS");
    take<std::uint64_t>();
    field_names_ = integers();
    const std::string values = block();
    EXPECT_EQ(values.size(), 8 * field_names_.size());
    field_values_.resize(field_names_.size());
    std::memcpy(field_values_.data(), values.data(), values.size());
  }
  void read_paths() {
    go_to("PATHS");
    const auto count = static_cast<std::size_t>(take<std::uint64_t>());
    EXPECT_EQ(take<std::uint64_t>(), count);
    const std::vector<std::int32_t> indices = integers(count), names = integers(count),
                                    jumps = integers(count);
    paths_.resize(count);
    std::vector<std::pair<std::size_t, std::string>> siblings{{0, ""}};  // first paths and their parents
    while (!siblings.empty()) {
      auto [i, parent] = siblings.back();
      siblings.pop_back();
      for (bool goes_on = true; goes_on; ++i) {
        const std::string& name = tokens_.at(static_cast<std::size_t>(std::abs(names.at(i))));
        const std::string path = i == 0 ? "" : parent + (names[i] < 0 ? "." : "/") + name;
        paths_.at(static_cast<std::size_t>(indices[i])) = path;
        if (jumps[i] > 0) siblings.emplace_back(i + static_cast<std::size_t>(jumps[i]), parent);
        if (jumps[i] > 0 || jumps[i] == -1) parent = path;
        goes_on = jumps[i] != -2;
      }
    }
  }
  void read_specs() {
    go_to("SPECS");
    const auto count = static_cast<std::size_t>(take<std::uint64_t>());
    const std::vector<std::int32_t> paths = integers(count), sets = integers(count), kinds = integers(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string& path = paths_.at(static_cast<std::size_t>(paths[i]));
      if (kinds[i] == 6) {
        layer_.in_order_.push_back(path);
        EXPECT_TRUE(layer_.prims_.emplace(path, "").second) << path << " is twice";
      }
      for (auto k = static_cast<std::size_t>(sets[i]); field_sets_.at(k) != -1; ++k) {
        const auto field = static_cast<std::size_t>(field_sets_[k]);
        if (tokens_.at(static_cast<std::size_t>(field_names_[field])) == "timeSamples")
          read_samples(path, field_values_[field]);
      }
    }
  }
  static std::size_t payload(std::uint64_t value) { return value & 0xffffffffffff; }
  void read_samples(const std::string& path, std::uint64_t samples) {
    EXPECT_EQ(samples >> 48, 46U);
    at_ = payload(samples);
    at_ += static_cast<std::size_t>(take_at<std::int64_t>(at_));
    const auto times = take<std::uint64_t>();
    EXPECT_EQ(times >> 48, 48U);
    EXPECT_EQ(take_at<std::uint64_t>(payload(times)), 1U);
    const auto frame = static_cast<int>(take_at<double>(payload(times) + 8));
    at_ += static_cast<std::size_t>(take_at<std::int64_t>(at_));
    EXPECT_EQ(take<std::uint64_t>(), 1U);
    layer_.values_[path][frame] = value_text(take<std::uint64_t>());
  }
  std::string value_text(std::uint64_t value) {
    const auto type = static_cast<int>(value >> 48 & 0xff);
    const bool is_array = value >> 63 != 0;
    EXPECT_EQ(value >> 62 & 1, 0U) << "no value is inlined";
    at_ = payload(value);
    EXPECT_EQ(at_ % 8, 0U);
    std::string text;
    if (type == 16 || type == 23) {
      EXPECT_FALSE(is_array);
      std::vector<double> all;
      for (int i = 0; i < (type == 16 ? 4 : 3); ++i) all.push_back(take<double>());
      if (type == 16) all = {all[3], all[0], all[1], all[2]};
      for (const double number : all) text += fmt::format("{} ", number);
      return text;
    }
    EXPECT_TRUE(is_array && (type == 24 || type == 8)) << type;
    if (at_ == 0) return text;
    const auto count = take<std::uint64_t>() * (type == 24 ? 3 : 1);
    for (std::uint64_t i = 0; i < count; ++i) text += fmt::format("{} ", double{take<float>()});
    return text;
  }

  Usda& layer_;
  const std::string& bytes_;
  std::size_t at_ = 0;
  std::map<std::string, std::uint64_t> sections_;
  std::vector<std::string> tokens_, paths_;
  std::vector<std::int32_t> field_names_, field_sets_;
  std::vector<std::uint64_t> field_values_;
};

Usda::Usda(const std::filesystem::path& path) {
  const std::string bytes = io::read_file(path);
  if (path.extension() == ".usdc")
    UsdBinary(bytes, *this);
  else
    UsdText(bytes, *this);
}

std::string Usda::text(const std::string& prim, const std::string& name, int frame) const {
  const auto found = values_.find(prim + "." + name);
  if (found == values_.end()) {
    ADD_FAILURE() << "no " << prim << "." << name;
    return {};
  }
  const auto after = found->second.upper_bound(frame);
  EXPECT_NE(after, found->second.begin());
  const auto at = std::prev(after);
  EXPECT_TRUE(at->first == no_frame || at->first == frame || after == found->second.end() ||
              after->second == at->second)
      << prim << "." << name << " has no value at frame " << frame;
  return at->second;
}

std::vector<double> Usda::numbers(const std::string& prim, const std::string& name, int frame) const {
  std::string plain = text(prim, name, frame);
  for (char& c : plain)
    if (std::string("[](),").find(c) != std::string::npos) c = ' ';
  std::istringstream in(plain);
  std::vector<double> result;
  for (std::string word; in >> word;) result.push_back(std::strtod(word.c_str(), nullptr));
  return result;
}

std::vector<Vec3> Usda::vectors(const std::string& prim, const std::string& name, int frame) const {
  const std::vector<double> all = numbers(prim, name, frame);
  std::vector<Vec3> result;
  for (std::size_t i = 0; i + 2 < all.size(); i += 3) result.emplace_back(all[i], all[i + 1], all[i + 2]);
  return result;
}

}  // namespace duet::test
