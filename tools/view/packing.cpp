#include "tools/view/packing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <zlib.h>

#include "sim/base/error.h"

namespace duet::view {
namespace {

using Row = std::vector<std::uint16_t>;

constexpr int ways = 4;  // bits 0 and 1 of a way of prediction
constexpr unsigned goes_on = 1, like_neighbor = 2;

// The sign in the lowest bit: small differences of either sign are small numbers.
std::uint16_t folded(std::uint16_t difference) {
  const bool is_negative = (difference & 0x8000U) != 0;
  return static_cast<std::uint16_t>(is_negative ? ~(difference << 1) : difference << 1);
}

// The differences of the row from its prediction, folded.
void differences(const Row& row, const Row& before, const Row& before_that, unsigned way, Row& out) {
  out.resize(row.size());
  std::uint16_t last = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int expected = (way & goes_on) != 0 ? 2 * before[i] - before_that[i] : before[i];
    const auto off = static_cast<std::uint16_t>(row[i] - expected);
    out[i] = folded((way & like_neighbor) != 0 ? static_cast<std::uint16_t>(off - last) : off);
    last = off;
  }
}

std::uint16_t quantized(double x, double center, double extent) {
  constexpr double most = 65535;
  return static_cast<std::uint16_t>(std::clamp(std::round(((x - center) / extent + 0.5) * most), 0.0, most));
}

}  // namespace

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 6);
  if (status != Z_OK)
    throw Error(ExitStatus::files,
                "zlib cannot compress the page (free some memory, or choose fewer frames)");
  packed.resize(size);
  return packed;
}

void FloatRows::append_to(std::string& bytes, const std::vector<float>& row) {
  before_.resize(row.size());
  std::vector<std::uint32_t> changes(row.size());
  for (std::size_t i = 0; i < row.size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(row[i]);
    changes[i] = bits ^ before_[i];
    before_[i] = bits;
  }
  for (unsigned shift = 0; shift < 32; shift += 8)
    for (const std::uint32_t change : changes) bytes += static_cast<char>(change >> shift & 0xffU);
}

void ByteRows::append_to(std::string& bytes, const std::vector<std::uint8_t>& row) {
  before_.resize(row.size());
  for (std::size_t i = 0; i < row.size(); ++i) bytes += static_cast<char>(row[i] - before_[i]);
  before_ = row;
}

void PositionRows::append_to(std::string& bytes, const std::vector<Vec3>& positions, const Vec3f& center) {
  std::array<Row, 3> rows;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t a = as_index(axis);
    before_[a].resize(positions.size());
    before_that_[a].resize(positions.size());
    for (const Vec3& x : positions)
      rows[a].push_back(
          quantized(x[axis], static_cast<double>(center[axis]), static_cast<double>(extent_[axis])));
  }
  std::array<Row, 3> best, tried;
  unsigned best_way = 0;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (unsigned way = 0; way < ways; ++way) {
    std::uint64_t sum = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      differences(rows[a], before_[a], before_that_[a], way, tried[a]);
      for (const std::uint16_t difference : tried[a]) sum += difference;
    }
    if (sum >= least) continue;
    least = sum;
    best_way = way;
    best.swap(tried);
  }
  bytes += static_cast<char>(best_way);
  for (const Row& row : best) {
    for (const std::uint16_t difference : row) bytes += static_cast<char>(difference & 0xffU);
    for (const std::uint16_t difference : row) bytes += static_cast<char>(difference >> 8U);
  }
  before_that_.swap(before_);
  before_ = std::move(rows);
}

std::uint8_t root_byte(double value, double largest, int most) {
  if (!(value > 0) || !(largest > 0)) return 0;
  return static_cast<std::uint8_t>(std::lround(most * std::sqrt(std::min(value / largest, 1.0))));
}

}  // namespace duet::view
