/// A growing text whose numbers are written in place, with the fewest digits that read back to the same bits.
/// std::to_chars is an order of magnitude faster than formatting, and a long run writes gigabytes of numbers.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

namespace duet::io {

class TextBuilder {
 public:
  explicit TextBuilder(std::size_t expected = 0) { text_.resize(expected + 1024); }

  void add(std::string_view part) {
    reserve(part.size());
    part.copy(text_.data() + size_, part.size());
    size_ += part.size();
  }
  template <class Number>
  void number(Number value) {
    reserve(max_number);
    char* begin = text_.data() + size_;
    size_ += static_cast<std::size_t>(std::to_chars(begin, begin + max_number, value).ptr - begin);
  }
  /// Each number after `separator`.
  template <class Numbers>
  void numbers(char separator, const Numbers& values) {
    for (const auto value : values) {
      reserve(1);
      text_[size_++] = separator;
      number(value);
    }
  }

  std::size_t size() const { return size_; }
  std::string_view view() const { return {text_.data(), size_}; }
  void clear() { size_ = 0; }
  std::string take() {
    text_.resize(size_);
    size_ = 0;
    return std::move(text_);
  }

 private:
  static constexpr std::size_t max_number = 25;  // characters: a double's shortest form needs 24

  void reserve(std::size_t more) {
    if (size_ + more + 1 > text_.size()) text_.resize(2 * (size_ + more + 1));
  }

  std::string text_;
  std::size_t size_ = 0;
};

}  // namespace duet::io
