// Writes a GLB file: a header, a chunk of JSON, and a chunk of binary data that the JSON lays out. The
// frames are read twice, first for the sizes that the JSON needs and then for writing, so that memory holds
// only one frame.
#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/glb_scene.h"

namespace duet::io {
namespace {

// Bound on the size of a file unless the user gives one, bytes. It is a choice; twice as much comes near
// the bound of the format.
constexpr std::uint64_t default_max_bytes = 2'000'000'000;
// Bound of the format: its lengths have 32 bits.
constexpr std::uint64_t format_max_bytes = std::numeric_limits<std::uint32_t>::max();
// "glTF", "JSON" and "BIN\0" as little-endian numbers.
constexpr std::uint32_t magic = 0x46546C67, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;

// Returns the size of the file in bytes: a header of 12 bytes and two chunks with heads of 8 bytes. The
// binary chunk is left out if it is empty.
std::uint64_t file_size(const std::string& json, const GlbDocument& document) {
  return 12 + 8 + json.size() + (document.binary_size() > 0 ? 8 + document.binary_size() : 0);
}

// Throws Error (usage) if the size exceeds the bound.
void require_size(std::uint64_t size, const FormatOptions& options) {
  const std::uint64_t asked = options.max_bytes > 0 ? options.max_bytes : default_max_bytes;
  const std::uint64_t bound = std::min(asked, format_max_bytes);
  if (size <= bound) return;
  throw Error(
      ExitStatus::usage,
      fmt::format("the GLB file would have {:.6g} MB, and {} (export fewer --frames or --bodies, or as "
                  "usd, which has a file a frame)",
                  1e-6 * static_cast<double>(size),
                  bound == format_max_bytes
                      ? std::string("the format ends at 4290 MB")
                      : fmt::format("the bound is {:g} MB", 1e-6 * static_cast<double>(bound))));
}

void write_words(OutputFile& out, const std::vector<std::uint32_t>& words) { out.write_values(words); }

// Reads the frames after the first once more and writes the morph targets that change.
void write_morphs(const ExportedRun& run, const GlbMeasures& measures, OutputFile& out) {
  std::vector<MorphedBody> bodies;
  for (std::size_t k = 0; k < measures.morphed.size(); ++k)
    if (measures.changes[k]) bodies.push_back(measures.morphed[k]);
  if (bodies.empty()) return;
  for (std::size_t frame = 1; frame < run.frames().size(); ++frame) {
    const FrameValues values = run.read(run.frames()[frame]);
    MorphBlock block;
    for (MorphedBody& body : bodies) {
      const MorphFrame morph = body.advance(values);
      append(body, morph, block);
    }
    out.write(block.dense);
    out.write(block.sparse_values);
    out.write(block.sparse_places);
  }
}

// Writes the file. Throws FileError if it does not get the expected size, because the run changed
// meanwhile.
void write(const ExportedRun& run, const GlbMeasures& measures, const GlbDocument& document,
           const std::string& json, const fs::path& file) {
  const std::uint64_t size = file_size(json, document);
  OutputFile out(file);
  write_words(out, {magic, 2, static_cast<std::uint32_t>(size)});
  write_words(out, {static_cast<std::uint32_t>(json.size()), json_chunk});
  out.write(json);
  if (document.binary_size() > 0) {
    write_words(out, {static_cast<std::uint32_t>(document.binary_size()), binary_chunk});
    out.write(document.start());
    write_morphs(run, measures, out);
  }
  if (out.size() != size)
    throw FileError(run.run().root.string(), "its frames changed while they were exported",
                    "export it again");
  out.close();
}

ExportNotes notes_of(const ExportedRun& run, const FormatOptions& options, const GlbMeasures& measures) {
  ExportNotes notes;
  const ExportedLooks& looks = run.looks();
  if (options.compress) notes.emplace_back("glb has no compressed form: --compress changes nothing");
  if (!measures.origin.isZero(0))
    notes.push_back(
        fmt::format("the bodies are far from the origin of the run: coordinates in the file are relative to "
                    "({}, {}, {}), "
                    "which asset.extras.origin holds, so that they keep their digits",
                    measures.origin.x(), measures.origin.y(), measures.origin.z()));
  if (run.up() != 'y' || run.scale() != 1)
    notes.emplace_back(
        "glTF takes y as up and meters as unit: readers will turn or size this file otherwise");
  if (!run.missing().empty())
    notes.push_back(fmt::format("{} frames are missing (the first is {}): bodies move evenly over each gap",
                                run.missing().size(), run.missing().front()));
  const auto is_used = [&](std::size_t look) {
    return std::any_of(run.bodies().begin(), run.bodies().end(),
                       [&](const ExportedBody& body) { return static_cast<std::size_t>(body.look) == look; });
  };
  for (std::size_t i = 0; i < looks.looks.size(); ++i)
    if (is_used(i) && (!looks.looks[i].pattern.empty() || !looks.looks[i].spots.empty())) {
      notes.emplace_back("materials have the first color of a look, without its pattern and spots");
      break;
    }
  if (std::any_of(looks.lights.begin(), looks.lights.end(),
                  [](const scene::Light& light) { return light.kind == scene::LightKind::area; }))
    notes.emplace_back(
        "area lights become point lights of the same power, with hard shadows; intensities are power / (4 "
        "pi) in "
        "watts where readers expect candela");
  if (camera_track(run, measures.poses.times()).has_zoom())
    notes.emplace_back("glTF cannot animate a camera's field of view: it keeps that of the first frame");
  return notes;
}

}  // namespace

ExportNotes export_glb(const ExportedRun& run, const FormatOptions& options, const fs::path& file) {
  const GlbMeasures measures = measure(run);
  const GlbScene scene(run, measures);
  const std::string json = scene.document().text();
  require_size(file_size(json, scene.document()), options);
  write(run, measures, scene.document(), json, file);
  return notes_of(run, options, measures);
}

}  // namespace duet::io
