// A growing text to which numbers are appended fast. std::to_chars is an order of magnitude faster than
// general formatting, and a long run writes gigabytes of numbers.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

namespace duet::io {

/// A growing text. Numbers are written in place, with the fewest digits that read back to the same bits.
class TextBuilder {
 public:
  /// Makes an empty text with room for `expected` characters. The text grows beyond them if need be.
  explicit TextBuilder(std::size_t expected = 0) { text_.resize(expected + 1024); }

  /// Appends text.
  void add(std::string_view part) {
    reserve(part.size());
    part.copy(text_.data() + size_, part.size());
    size_ += part.size();
  }
  /// Appends an integer or a floating-point number of type `Number`.
  template <class Number>
  void number(Number value) {
    reserve(max_number);
    char* begin = text_.data() + size_;
    size_ += static_cast<std::size_t>(std::to_chars(begin, begin + max_number, value).ptr - begin);
  }
  /// Appends each number of the range `values`, with `separator` before each.
  template <class Numbers>
  void numbers(char separator, const Numbers& values) {
    for (const auto value : values) {
      reserve(1);
      text_[size_++] = separator;
      number(value);
    }
  }

  /// Returns the number of characters.
  std::size_t size() const { return size_; }
  /// Returns the text. The view is valid until the next call that changes the text.
  std::string_view view() const { return {text_.data(), size_}; }
  /// Empties the text and keeps its memory.
  void clear() { size_ = 0; }
  /// Moves the text out and leaves an empty one.
  std::string take() {
    text_.resize(size_);
    size_ = 0;
    return std::move(text_);
  }

 private:
  static constexpr std::size_t max_number = 25;  // characters; the shortest form of a double has at most 24

  void reserve(std::size_t more) {
    if (size_ + more + 1 > text_.size()) text_.resize(2 * (size_ + more + 1));
  }

  std::string text_;      // its size is the memory reserved
  std::size_t size_ = 0;  // number of characters in use
};

}  // namespace duet::io
