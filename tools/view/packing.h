/// How the page of `duet view` holds numbers: whole numbers that are small where motion is smooth, in bytes
/// that zlib makes few of. packing.js reads what this writes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/types.h"

namespace duet::view {

/// The bytes as a zlib stream. Throws Error where zlib has no memory.
std::string deflated(std::string_view bytes);

template <class Value>
void append(std::string& bytes, const std::vector<Value>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
}

/// Rows of floats, one a frame. A row is written as the exclusive or of its bits and those of the row before:
/// first the lowest byte of all numbers, then the next one. What rests becomes zeros.
class FloatRows {
 public:
  void append_to(std::string& bytes, const std::vector<float>& row);

 private:
  std::vector<std::uint32_t> before_;
};

/// Rows of bytes, one a frame, written as differences from the row before, modulo 256.
class ByteRows {
 public:
  void append_to(std::string& bytes, const std::vector<std::uint8_t>& row);

 private:
  std::vector<std::uint8_t> before_;
};

/// Positions of a deformable body in 16 bits a coordinate, frame by frame:
///   x = center + extent * (q / 65535 - 1/2)
/// with the center of the box around the body at the frame, and the largest extent of that box in the run.
/// The rounding is extent / 131070, wherever the body goes.
///
/// A frame is a byte with the way of prediction, then for each axis the low bytes and the high bytes of the
/// differences from what was predicted, modulo 65536, with the sign in the lowest bit (0, -1, 1, -2, ...):
///   bit 0: the position goes on as between the two frames before; otherwise it stays
///   bit 1: a vertex differs from its prediction as the vertex before it does
/// The way is the one with the least sum of differences.
class PositionRows {
 public:
  explicit PositionRows(const Vec3f& extent) : extent_(extent) {}
  void append_to(std::string& bytes, const std::vector<Vec3>& positions, const Vec3f& center);

 private:
  using Row = std::vector<std::uint16_t>;
  Vec3f extent_;
  std::array<Row, 3> before_, before_that_;
};

/// A share of a largest value, at least 0, in a byte: b = round(most * sqrt(value / largest)), so that small
/// values keep two digits.
std::uint8_t root_byte(double value, double largest, int most = 255);

}  // namespace duet::view
