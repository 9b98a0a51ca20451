#include "sim/io/export/glb_document.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/assert.h"

namespace duet::io {
namespace {

constexpr int type_u16 = 5123, type_u32 = 5125, type_float = 5126;  // glTF's accessor.componentType

constexpr std::array<std::string_view, 4> type_names{"SCALAR", "VEC2", "VEC3", "VEC4"};

std::string_view type_name(int components) { return type_names[static_cast<std::size_t>(components - 1)]; }

// Returns the bounds of the values in each component, as the end of an accessor: ,"min":[...],"max":[...].
std::string bounds_text(const std::vector<float>& values, int components) {
  std::vector<double> least, most;
  const auto width = static_cast<std::size_t>(components);
  for (std::size_t k = 0; k < width; ++k) {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (std::size_t i = k; i < values.size(); i += width) {
      low = std::min(low, values[i]);
      high = std::max(high, values[i]);
    }
    least.push_back(low);
    most.push_back(high);
  }
  return fmt::format(",\"min\":[{}],\"max\":[{}]", fmt::join(least, ","), fmt::join(most, ","));
}

}  // namespace

int GlbDocument::List::add(const std::string& entry) {
  if (count > 0) text += ",\n";
  text += entry;
  return count++;
}

int GlbDocument::reserve_view(std::uint64_t bytes, ViewUse use, int stride) {
  std::string text = fmt::format("{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}", size_, bytes);
  if (stride > 0) text += fmt::format(",\"byteStride\":{}", stride);
  if (use != ViewUse::other) text += fmt::format(",\"target\":{}", static_cast<int>(use));
  size_ += (bytes + 3) / 4 * 4;
  return views_.add(text + "}");
}

int GlbDocument::add_view(const void* data, std::size_t bytes, ViewUse use) {
  DUET_ASSERT(start_.size() == size_);  // reserve_view() comes after the last view with bytes
  const int view = reserve_view(bytes, use, 0);
  start_.append(static_cast<const char*>(data), bytes);
  start_.resize(static_cast<std::size_t>(size_), '\0');
  return view;
}

int GlbDocument::add_floats(const std::vector<float>& values, int components, ViewUse use, Bounds bounds) {
  DUET_ASSERT(components >= 1 && components <= 4);
  DUET_ASSERT(values.size() % static_cast<std::size_t>(components) == 0);
  const int view = add_view(values.data(), values.size() * sizeof(float), use);
  return add_accessor(fmt::format("{{\"bufferView\":{},\"componentType\":{},\"count\":{},\"type\":\"{}\"{}}}",
                                  view, type_float, values.size() / static_cast<std::size_t>(components),
                                  type_name(components),
                                  bounds == Bounds::write ? bounds_text(values, components) : ""));
}

int GlbDocument::add_sparse_floats(const std::vector<float>& values) {
  std::vector<std::uint32_t> places;
  std::vector<float> others;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] != 0) {
      places.push_back(static_cast<std::uint32_t>(i));
      others.push_back(values[i]);
    }
  if (places.empty() || 2 * places.size() >= values.size())
    return add_floats(values, 1, ViewUse::other, Bounds::leave_out);
  const int place_view = add_view(places.data(), places.size() * sizeof(std::uint32_t), ViewUse::other);
  const int value_view = add_view(others.data(), others.size() * sizeof(float), ViewUse::other);
  return add_accessor(fmt::format(
      "{{\"componentType\":{},\"count\":{},\"type\":\"SCALAR\",\"sparse\":{{\"count\":{},"
      "\"indices\":{{\"bufferView\":{},\"componentType\":{}}},\"values\":{{\"bufferView\":{}}}}}}}",
      type_float, values.size(), places.size(), place_view, type_u32, value_view));
}

int GlbDocument::add_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  DUET_ASSERT(std::all_of(indices.begin(), indices.end(), [&](std::uint32_t i) { return i < vertices; }));
  // glTF does not allow the largest number of the type as an index: it would restart primitives.
  const bool is_short = vertices <= 0xffff;
  const std::vector<std::uint16_t> shorts =
      is_short ? std::vector<std::uint16_t>(indices.begin(), indices.end()) : std::vector<std::uint16_t>();
  const int view = is_short ? add_view(shorts.data(), shorts.size() * 2, ViewUse::indices)
                            : add_view(indices.data(), indices.size() * 4, ViewUse::indices);
  return add_accessor(
      fmt::format("{{\"bufferView\":{},\"componentType\":{},\"count\":{},\"type\":\"SCALAR\"}}", view,
                  is_short ? type_u16 : type_u32, indices.size()));
}

std::string GlbDocument::text() const {
  std::string text = json_.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.pop_back();  // removes the closing brace
  const auto add = [&](std::string_view key, const List& list) {
    if (list.count > 0) text += fmt::format(",\n\"{}\":[\n{}\n]", key, list.text);
  };
  add("meshes", meshes_);
  add("accessors", accessors_);
  add("bufferViews", views_);
  if (size_ > 0) text += fmt::format(",\n\"buffers\":[{{\"byteLength\":{}}}]", size_);
  text += "}";
  text.resize((text.size() + 3) / 4 * 4, ' ');
  return text;
}

std::string json_text(const Vec3f& v) {
  // The shortest digits of the double that equals a float read back to the exact value of the float.
  return fmt::format("[{},{},{}]", static_cast<double>(v.x()), static_cast<double>(v.y()),
                     static_cast<double>(v.z()));
}

std::string json_text(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace duet::io
