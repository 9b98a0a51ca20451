// Writes the formats `pc2` and `mdd`: a point cache for each body, with the mesh that it moves. PC2 is the
// point cache of 3ds Max and Blender, MDD that of LightWave. Both hold coordinates in single precision, and
// the same number of points in all frames.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/printable.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/own_mesh.h"

namespace duet::io {
namespace {

enum class CacheKind { pc2, mdd };

// Frames are gathered in memory before each body's file is opened to append them. Files are thus opened
// rarely, and the number of bodies is not bounded by that of open files. Frames are gathered until all
// bodies together have about `gathered_bytes` bytes or `max_gathered_frames` frames. Larger values need
// more memory and open files more rarely.
constexpr std::size_t gathered_bytes = 64 << 20;
constexpr std::size_t max_gathered_frames = 256;

// Appends the bytes of a number in the given order.
template <class Number>
void append(std::string& bytes, Number value, std::endian order) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  if (order != std::endian::native) std::reverse(std::begin(raw), std::end(raw));
  bytes.append(raw, sizeof(Number));
}

// Returns the origin of a body's coordinates in its cache. It is 0, unless a coordinate of the body is
// larger than 128 times the body's extent: single precision would then round coordinates by more than 2^-17
// of the extent (128 times 2^-24), and the origin is near the center of the body.
Vec3 origin_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  if (box.isEmpty()) return Vec3::Zero();
  const double extent = box.sizes().maxCoeff();
  const double farthest = std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  constexpr double max_extents = 128;
  if (farthest <= max_extents * extent) return Vec3::Zero();
  // The center is rounded to multiples of a power of two near the extent, so that the origin is short to
  // write.
  const double unit = extent > 0 ? std::ldexp(1.0, std::ilogb(extent)) : 0;
  const Vec3 center = box.center();
  return unit > 0 ? Vec3((center / unit).array().round() * unit) : center;
}

// Point cache of one body.
struct Cache {
  std::string file, mesh;      // names of the files of the cache and of the mesh
  Surface surface;             // positions at the present frame, without triangles
  std::vector<int> order;      // for each point of the cache the index of its position in `surface`
  Vec3 origin = Vec3::Zero();  // origin of the coordinates in the cache, unit and axes of the export
  bool is_own = false;         // true if the mesh is a copy of the OBJ file that the scene names
  std::string gathered;        // bytes that are not yet written
};

// Appends the points at the present frame to the bytes to be written. PC2 is little-endian, MDD big-endian.
void append_frame(Cache& cache, CacheKind kind) {
  const std::endian order = kind == CacheKind::pc2 ? std::endian::little : std::endian::big;
  for (const int i : cache.order) {
    const Vec3& x = cache.surface.positions[static_cast<std::size_t>(i)];
    for (int k = 0; k < 3; ++k) append(cache.gathered, static_cast<float>(x[k] - cache.origin[k]), order);
  }
}

// Returns the head of a cache file.
std::string head_bytes(const ExportedRun& run, const Cache& cache, CacheKind kind) {
  const int first = run.frames().front(), samples = run.frames().back() - first + 1;
  const auto points = static_cast<std::int32_t>(cache.order.size());
  std::string bytes;
  if (kind == CacheKind::pc2) {
    bytes = std::string("POINTCACHE2\0", 12);
    append(bytes, std::int32_t{1}, std::endian::little);  // version
    append(bytes, points, std::endian::little);
    append(bytes, static_cast<float>(first), std::endian::little);
    append(bytes, 1.0F, std::endian::little);  // frames for each sample
    append(bytes, std::int32_t{samples}, std::endian::little);
    return bytes;
  }
  append(bytes, std::int32_t{samples}, std::endian::big);
  append(bytes, points, std::endian::big);
  for (int i = 0; i < samples; ++i)  // times, s, from the first frame on
    append(bytes, static_cast<float>(i / run.manifest().fps), std::endian::big);
  return bytes;
}

// Writes the mesh at the first frame. Its vertex i is point i of the cache.
void write_mesh(const ExportedRun& run, std::size_t index, const FrameValues& values, const Cache& cache,
                const fs::path& folder) {
  const ExportedBody& body = run.bodies()[index];
  std::vector<BodySurface> mesh = {{printable_line(body.name), body.rest}};
  place(body, values, mesh[0].surface);
  for (Vec3& x : mesh[0].surface.positions) x -= cache.origin;
  ObjStyle style;
  style.comment =
      fmt::format("{}, {} units a meter; {} up, right-handed; relative to [{}, {}, {}]", values.frame,
                  run.scale(), run.up(), cache.origin.x(), cache.origin.y(), cache.origin.z());
  if (const std::vector<std::string> names = material_names(run); !names.empty()) {
    style.library = "materials.mtl";
    style.materials = {names.at(static_cast<std::size_t>(body.look))};
  }
  OutputFile file(folder / cache.mesh);
  file.write(obj_text(mesh, style));
  file.close();
}

// Appends the gathered bytes to the files of all bodies.
void flush(std::vector<Cache>& caches, const fs::path& folder) {
  for (Cache& cache : caches) {
    OutputFile file(folder / cache.file, OutputFile::Open::to_append);
    file.write(cache.gathered);
    file.close();
    cache.gathered.clear();
  }
}

nlohmann::ordered_json cache_description(const ExportedRun& run, const std::vector<Cache>& caches,
                                         const char* format) {
  nlohmann::ordered_json object = description(run, format);
  object["samples"] = run.frames().back() - run.frames().front() + 1;
  for (std::size_t i = 0; i < caches.size(); ++i) {
    const Cache& cache = caches[i];
    nlohmann::ordered_json& body = object["bodies"][i];
    body["mesh"] = cache.mesh;
    body["cache"] = cache.file;
    body["points"] = cache.order.size();
    body["is_own_mesh"] = cache.is_own;
    body["origin"] = {cache.origin.x(), cache.origin.y(), cache.origin.z()};
  }
  return object;
}

ExportNotes export_caches(const ExportedRun& run, CacheKind kind, const fs::path& folder) {
  const char* format = kind == CacheKind::pc2 ? "pc2" : "mdd";
  const std::vector<std::string> names = safe_body_names(run);
  FrameValues values = run.read(run.frames().front());
  std::vector<std::optional<OwnMesh>> own = own_meshes(run);
  const ExportNotes own_notes = notes_on_own_meshes(run, own);
  std::vector<Cache> caches(names.size());
  std::size_t frame_bytes = 0;
  for (std::size_t i = 0; i < caches.size(); ++i) {
    Cache& cache = caches[i];
    cache.file = fmt::format("{}.{}", names[i], format);
    cache.mesh = names[i] + ".obj";
    cache.surface.positions = run.bodies()[i].rest.positions;
    place(run.bodies()[i], values, cache.surface);
    cache.origin = origin_of(cache.surface);
    if (own[i]) {
      cache.is_own = true;
      cache.order = std::move(own[i]->positions);
      OutputFile copy(folder / cache.mesh);
      copy.write(read_file(own[i]->file));
      copy.close();
    } else {
      cache.order.resize(cache.surface.positions.size());
      std::iota(cache.order.begin(), cache.order.end(), 0);
      write_mesh(run, i, values, cache, folder);
    }
    cache.gathered = head_bytes(run, cache, kind);
    frame_bytes += cache.order.size() * 3 * sizeof(float);
  }
  if (!run.looks().looks.empty()) write_materials(run, folder / "materials.mtl");
  write_json(cache_description(run, caches, format), folder / "export.json");
  const std::size_t most =
      std::clamp<std::size_t>(gathered_bytes / std::max<std::size_t>(frame_bytes, 1), 1, max_gathered_frames);
  std::size_t gathered = 0;
  int written = run.frames().front() - 1;
  for (const int frame : run.frames()) {
    if (frame != run.frames().front()) values = run.read(frame);
    // Samples lie one frame apart, so a missing frame repeats the frame before it.
    for (; written < frame; ++written) {
      for (std::size_t i = 0; i < caches.size(); ++i) {
        if (written + 1 == frame) place(run.bodies()[i], values, caches[i].surface);
        append_frame(caches[i], kind);
      }
      if (++gathered % most == 0) flush(caches, folder);
    }
  }
  flush(caches, folder);
  ExportNotes notes = notes_on_looks(run);
  notes.insert(notes.end(), own_notes.begin(), own_notes.end());
  if (written - run.frames().front() + 1 != static_cast<int>(run.frames().size()))
    notes.emplace_back("a frame that is missing shows the one before it, since samples lie a frame apart");
  return notes;
}

}  // namespace

ExportNotes export_pc2(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  return export_caches(run, CacheKind::pc2, folder);
}

ExportNotes export_mdd(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  return export_caches(run, CacheKind::mdd, folder);
}

}  // namespace duet::io
