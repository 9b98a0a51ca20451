// Writes the format `ply`: a binary Stanford PLY file a frame (G. Turk, The PLY Polygon File Format, 1994),
// with all bodies in one mesh.
#include <bit>
#include <iterator>

#include <fmt/format.h>

#include "sim/base/printable.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/split_surface.h"

namespace duet::io {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are written as they lie in memory");

// Collects the records of a PLY file, which have no gaps between their values.
class Records {
 public:
  explicit Records(std::size_t bytes) { bytes_.reserve(bytes); }
  template <class Value>
  void add(const Value& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(Value));
  }
  template <class Vector>
  void add_vector(const Vector& x) {
    bytes_.append(reinterpret_cast<const char*>(x.data()),
                  static_cast<std::size_t>(x.size()) * sizeof(typename Vector::Scalar));
  }
  const std::string& bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  std::string bytes_;
};

std::string head_text(const ExportedRun& run, const SplitSurfaces& all, const FrameValues& values) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  text += fmt::format("comment Duet frame {}, time {} s; {} units a meter; {} up, right-handed\n",
                      values.frame, values.time, run.scale(), run.up());
  for (std::size_t i = 0; i < run.bodies().size(); ++i)
    text += fmt::format("comment body {} {}\n", i, printable_line(run.bodies()[i].name));
  text += fmt::format("element vertex {}\n", all.vertices.size());
  for (const char* name : {"x", "y", "z"}) text += fmt::format("property double {}\n", name);
  for (const char* name : {"nx", "ny", "nz", "s", "t", "vx", "vy", "vz"})
    text += fmt::format("property float {}\n", name);
  for (const PointValue& kind : point_values) {
    if (!kind.is_in(values)) continue;
    if (kind.scalars)
      text += fmt::format("property float {}\n", kind.name);
    else
      text += fmt::format("property float {0}_x\nproperty float {0}_y\nproperty float {0}_z\n", kind.name);
  }
  text +=
      fmt::format("property int body\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
                  all.triangles.size());
  return text;
}

}  // namespace

ExportNotes export_ply(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  constexpr std::size_t vertex_bytes =
      3 * sizeof(double) + (8 + 3 * std::size(point_values)) * sizeof(float) + sizeof(std::int32_t);
  constexpr std::size_t face_bytes = 1 + 3 * sizeof(std::int32_t);
  const SplitSurfaces all = split_surfaces(run);
  PlacedBodies bodies(run);
  Records faces(face_bytes * all.triangles.size()), vertices(vertex_bytes * all.vertices.size());
  for (std::size_t i = 0; i < all.triangles.size(); ++i) {
    faces.add(std::uint8_t{3});
    faces.add(all.triangles[i]);
  }
  write_json(description(run, "ply"), folder / "export.json");
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    bodies.place(values);
    vertices.clear();
    for (const SplitSurfaces::Vertex& v : all.vertices) {
      vertices.add_vector(bodies.position(v));
      vertices.add_vector(bodies.normal(v));
      vertices.add_vector(bodies.uv(v));
      vertices.add_vector(bodies.velocity(v));
      for (const PointValue& kind : point_values) {
        if (!kind.is_in(values)) continue;
        if (kind.scalars)
          vertices.add(bodies.of_point(v, kind.scalars(values)));
        else
          vertices.add_vector(bodies.of_point(v, kind.vectors(values)));
      }
      vertices.add(static_cast<std::int32_t>(v.body));
    }
    OutputFile file(folder / fmt::format("{:04}.ply", frame));
    file.write(head_text(run, all, values));
    file.write(vertices.bytes());
    file.write(faces.bytes());
    file.close();
  }
  return {};
}

}  // namespace duet::io
