#include "sim/io/export/glb_morphs.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/assert.h"

namespace duet::io {
namespace {

// Length up to which a difference counts as 0, relative to the size of the body (positions) or to 1
// (normals): half the spacing of floats of that size. A larger value gives smaller files and coarser
// motion.
constexpr double last_bit = 0x1p-24;

// Appends the differences of positions or normals in the form that is_sparse() tells. Changes that are 0 or
// as before have no bytes.
void append(const std::vector<Vec3f>& changes, const MorphChange& change, MorphBlock& block) {
  const auto add = [](std::string& to, const auto& value) {
    to.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  if (change.moved == 0 || change.is_as_before) return;
  if (!is_sparse(change, changes.size())) {
    block.dense.append(reinterpret_cast<const char*>(changes.data()), changes.size() * sizeof(Vec3f));
    return;
  }
  for (std::uint32_t i = 0; i < changes.size(); ++i) {
    if (changes[i].isZero(0)) continue;
    add(block.sparse_places, i);
    add(block.sparse_values, changes[i]);
  }
}

// Sizes of the buffer views of a frame, or the parts of them that are taken already.
struct Layout {
  std::uint64_t dense = 0, sparse = 0;  // bytes of the vectors of dense and sparse changes
};

// Returns the accessor of a change and takes its place in the views, which are those of dense vectors,
// sparse vectors and sparse indices. An index of 4 bytes belongs to each sparse vector of 12 bytes.
std::string accessor_text(const MorphChange& change, std::size_t vertices, Layout& at,
                          const std::array<int, 3>& views) {
  const std::string head =
      fmt::format("{{\"componentType\":5126,\"count\":{},\"type\":\"VEC3\",\"min\":{},\"max\":{}", vertices,
                  json_text(change.low), json_text(change.high));
  if (change.moved == 0) return head + "}";  // an accessor without a view holds zeros
  if (!is_sparse(change, vertices)) {
    const std::uint64_t place = at.dense;
    at.dense += vertices * sizeof(Vec3f);
    return head + fmt::format(",\"bufferView\":{},\"byteOffset\":{}}}", views[0], place);
  }
  const std::uint64_t place = at.sparse;
  at.sparse += change.moved * sizeof(Vec3f);
  return head + fmt::format(
                    ",\"sparse\":{{\"count\":{},\"indices\":{{\"bufferView\":{},\"byteOffset\":{},"
                    "\"componentType\":5125}},\"values\":{{\"bufferView\":{},\"byteOffset\":{}}}}}}}",
                    change.moved, views[2], place / 3, views[1], place);
}

}  // namespace

MorphedBody::MorphedBody(const ExportedBody& body, const Vec3& origin, const FrameValues& values)
    : body_(body), origin_(origin), split_(split_vertices(body.rest)), surface_(body.rest) {
  place(body_, values, surface_);
  translation_ = (local_.follow(surface_.positions) - origin_).cast<float>();
  positions_.negligible = static_cast<float>(last_bit * std::max(local_.size(), 0.0));
  normals_.negligible = static_cast<float>(last_bit);
  for (const Corner& corner : split_.vertices) {
    positions_.mesh.push_back(vertex(corner).cast<float>());
    normals_.mesh.push_back(surface_.normals[static_cast<std::size_t>(corner.normal)]);
  }
  for (Attribute* attribute : {&positions_, &normals_})
    attribute->changes.assign(attribute->mesh.size(), Vec3f::Zero());
}

Vec3 MorphedBody::vertex(const Corner& corner) const {
  return surface_.positions[static_cast<std::size_t>(corner.position)] - origin_ -
         translation_.cast<double>();
}

MorphFrame MorphedBody::advance(const FrameValues& values) {
  place(body_, values, surface_);
  translation_ = (local_.follow(surface_.positions) - origin_).cast<float>();
  positions_.next.clear();
  normals_.next.clear();
  for (std::size_t i = 0; i < split_.vertices.size(); ++i) {
    const Corner& corner = split_.vertices[i];
    positions_.next.push_back((vertex(corner) - positions_.mesh[i].cast<double>()).cast<float>());
    normals_.next.push_back(surface_.normals[static_cast<std::size_t>(corner.normal)] - normals_.mesh[i]);
  }
  return {positions_.advance(), normals_.advance(), translation_};
}

MorphChange MorphedBody::Attribute::advance() {
  MorphChange change;
  change.is_as_before = true;
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (next[i].norm() <= negligible) next[i].setZero();
    if ((next[i] - changes[i]).norm() > negligible) change.is_as_before = false;
  }
  if (!change.is_as_before) changes.swap(next);
  if (!changes.empty()) change.low = change.high = changes.front();
  for (const Vec3f& x : changes) {
    change.moved += x.isZero(0) ? 0 : 1;
    change.low = change.low.cwiseMin(x);
    change.high = change.high.cwiseMax(x);
  }
  return change;
}

bool is_sparse(const MorphChange& change, std::size_t vertices) {
  return change.moved * (sizeof(Vec3f) + sizeof(std::uint32_t)) < vertices * sizeof(Vec3f);
}

std::vector<int> add_morph_accessors(const std::vector<MorphFrame>& frame,
                                     const std::vector<std::size_t>& vertices, const std::vector<int>& before,
                                     GlbDocument& document) {
  DUET_ASSERT(vertices.size() == frame.size() && (before.empty() || before.size() == 2 * frame.size()));
  Layout sizes;
  const auto each = [&](const auto& act) {
    for (std::size_t i = 0; i < frame.size(); ++i) {
      act(frame[i].positions, vertices[i], 2 * i);
      act(frame[i].normals, vertices[i], 2 * i + 1);
    }
  };
  const auto is_kept = [&](const MorphChange& change) { return change.is_as_before && !before.empty(); };
  each([&](const MorphChange& change, std::size_t count, std::size_t) {
    if (change.moved == 0 || is_kept(change)) return;
    (is_sparse(change, count) ? sizes.sparse += change.moved * sizeof(Vec3f)
                              : sizes.dense += count * sizeof(Vec3f));
  });
  const std::array<int, 3> views{
      sizes.dense > 0 ? document.reserve_view(sizes.dense, ViewUse::vertices, sizeof(Vec3f)) : -1,
      sizes.sparse > 0 ? document.reserve_view(sizes.sparse, ViewUse::other, 0) : -1,
      sizes.sparse > 0 ? document.reserve_view(sizes.sparse / 3, ViewUse::other, 0) : -1};
  std::vector<int> accessors(2 * frame.size());
  Layout at;
  each([&](const MorphChange& change, std::size_t count, std::size_t slot) {
    accessors[slot] =
        is_kept(change) ? before[slot] : document.add_accessor(accessor_text(change, count, at, views));
  });
  return accessors;
}

void append(const MorphedBody& body, const MorphFrame& frame, MorphBlock& block) {
  append(body.position_changes(), frame.positions, block);
  append(body.normal_changes(), frame.normals, block);
}

}  // namespace duet::io
