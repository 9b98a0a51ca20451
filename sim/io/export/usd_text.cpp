#include "sim/io/export/usd_text.h"

#include <charconv>
#include <cmath>
#include <span>

#include <fmt/format.h>

#include "sim/base/assert.h"

namespace duet::io {
namespace {

constexpr std::size_t max_number = 25;  // characters; the shortest form of a double has at most 24

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Appends the shortest form of a number.
template <class Number>
void append(std::string& text, Number value) {
  std::array<char, max_number> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  text.append(digits.data(), end);
}

template <class Number>
void append_tuple(std::string& text, std::span<const Number> numbers) {
  text += '(';
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) text += ", ";
    append(text, numbers[i] + Number(0));  // + 0 removes negative zeros
  }
  text += ')';
}

// Returns an array whose values append_value(text, value) appends. `bytes_each` is an estimate of the
// length of each.
template <class Values, class Append>
std::string array(const Values& values, std::size_t bytes_each, Append&& append_value) {
  std::string text;
  text.reserve(bytes_each * values.size() + 2);
  text += '[';
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ", ";
    append_value(text, values[i]);
  }
  text += ']';
  return text;
}

template <class Vector>
std::string vectors_text(const std::vector<Vector>& vectors) {
  return array(vectors, 40, [](std::string& text, const Vector& v) {
    append_tuple(text, std::span<const float>(v.data(), static_cast<std::size_t>(v.size())));
  });
}

}  // namespace

std::string usd_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      quoted += {'\\', c};
    else if (code < 0x20 || code == 0x7f)
      quoted += fmt::format("\\x{:02x}", code);
    else
      quoted += c;
  }
  return quoted + "\"";
}

std::string UsdNames::take(std::string_view name) {
  std::string identifier;
  for (const char c : name) identifier += is_letter(c) || is_digit(c) ? c : '_';
  if (identifier.empty() || is_digit(identifier.front())) identifier = '_' + identifier;
  std::string unique = identifier;
  for (int n = 2; !taken_.insert(unique).second; ++n) unique = fmt::format("{}_{}", identifier, n);
  return unique;
}

std::string usd_display_name(std::string_view name, std::string_view identifier) {
  return name == identifier ? std::string() : "displayName = " + usd_string(name);
}

std::string usd_tuple(const Vec3& v) {
  std::string text;
  append_tuple(text, std::span<const double>(v.data(), 3));
  return text;
}

std::string usd_tuple(const Quat& q) {
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  std::string text;
  append_tuple(text, std::span<const double>(wxyz));
  return text;
}

std::string usd_array(const std::vector<Vec3f>& vectors) { return vectors_text(vectors); }

std::string usd_array(const std::vector<Vec2f>& vectors) { return vectors_text(vectors); }

std::string usd_array(const std::vector<int>& numbers) {
  return array(numbers, 8, [](std::string& text, int number) { append(text, number); });
}

std::string usd_rounded_array(const std::vector<Vec3f>& vectors) {
  constexpr double places = 1e4;
  std::vector<Vec3f> rounded;
  rounded.reserve(vectors.size());
  for (const Vec3f& v : vectors)
    rounded.emplace_back((Eigen::Array3d(v.cast<double>()) * places).round().matrix().cast<float>() /
                         static_cast<float>(places));
  return vectors_text(rounded);
}

std::string usd_rounded_array(const std::vector<float>& numbers) {
  fmt::memory_buffer text;
  text.push_back('[');
  for (std::size_t i = 0; i < numbers.size(); ++i)
    fmt::format_to(std::back_inserter(text), "{}{:.5g}", i > 0 ? ", " : "", numbers[i]);
  text.push_back(']');
  return fmt::to_string(text);
}

void UsdSamples::add(int frame, std::string value) {
  DUET_ASSERT(frames_.empty() || frame > frames_.back());
  const std::size_t count = values_.size();
  if (count >= 2 && values_[count - 1] == value && values_[count - 2] == value) {
    frames_.back() = frame;
    return;
  }
  bytes_ += value.size();
  frames_.push_back(frame);
  values_.push_back(std::move(value));
}

std::string UsdSamples::text(std::string_view indent, std::string_view declaration) const {
  DUET_ASSERT(!values_.empty());
  const bool is_constant = values_.size() <= 2 && values_.front() == values_.back();
  if (is_constant) return fmt::format("{}{} = {}\n", indent, declaration, values_.front());
  std::string text = fmt::format("{}{}.timeSamples = {{\n", indent, declaration);
  text.reserve(bytes_ + 32 * frames_.size() + 128);
  for (std::size_t i = 0; i < frames_.size(); ++i)
    text += fmt::format("{}    {}: {},\n", indent, frames_[i], values_[i]);
  return text + fmt::format("{}}}\n", indent);
}

}  // namespace duet::io
