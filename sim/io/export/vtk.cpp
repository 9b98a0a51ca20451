// Writes the format `vtk`: XML files of VTK poly data with appended raw data, one a frame, and a collection
// with their times (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html). ParaView opens
// run.pvd.
#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <zlib.h>

#include "sim/base/error.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/split_surface.h"

namespace duet::io {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

// Appends a number of 64 bits, as header_type="UInt64" demands for lengths.
void append_count(std::string& bytes, std::uint64_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

// The appended data after the XML: arrays one after another. Each has its length before it, or is
// compressed in blocks with their lengths before them.
class AppendedData {
 public:
  explicit AppendedData(bool compress) : compress_(compress) {}

  // Appends an array and returns the offset at which it begins, bytes.
  template <class Value>
  std::size_t add(const std::vector<Value>& values) {
    const std::size_t offset = bytes_.size();
    const std::string_view raw(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
    if (compress_) {
      add_compressed(raw);
    } else {
      append_count(bytes_, raw.size());
      bytes_ += raw;
    }
    return offset;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  static constexpr std::size_t block_bytes = 1 << 18;  // uncompressed length of a block

  // Appends the number of blocks, the length of a block, that of the last one if it is shorter (else 0),
  // the compressed lengths, and the blocks.
  void add_compressed(std::string_view raw) {
    std::string blocks, lengths;
    for (std::size_t at = 0; at < raw.size(); at += block_bytes) {
      const std::string_view block = raw.substr(at, block_bytes);
      std::string packed(compressBound(block.size()), '\0');
      uLongf size = packed.size();
      if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                    reinterpret_cast<const Bytef*>(block.data()), block.size(), Z_BEST_SPEED) != Z_OK)
        throw Error(ExitStatus::simulation,
                    "out of memory while an array was compressed (leave out --compress)");
      append_count(lengths, size);
      blocks.append(packed, 0, size);
    }
    append_count(bytes_, lengths.size() / sizeof(std::uint64_t));
    append_count(bytes_, block_bytes);
    append_count(bytes_, raw.size() % block_bytes);
    bytes_ += lengths;
    bytes_ += blocks;
  }

  const bool compress_;
  std::string bytes_;
};

// A file of poly data: its XML, whose arrays refer to AppendedData.
class PolyData {
 public:
  PolyData(const SplitSurfaces& all, bool compress) : all_(all), compress_(compress), data_(compress) {}

  // Adds an array of `type` with `components` numbers for each tuple.
  template <class Value>
  void add(const char* type, const char* name, int components, const std::vector<Value>& values) {
    xml_ += fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n",
        type, name, components, data_.add(values));
  }
  // Adds XML.
  void add(const std::string& text) { xml_ += text; }

  void write(const fs::path& path) const {
    OutputFile file(path);
    file.write(fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\"{}>\n<PolyData>\n",
        compress_ ? " compressor=\"vtkZLibDataCompressor\"" : ""));
    file.write(field_);
    file.write(
        fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
                    "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
                    all_.vertices.size(), all_.triangles.size()));
    file.write(xml_);
    file.write("</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
    file.write(data_.bytes());
    file.write("\n</AppendedData>\n</VTKFile>\n");
    file.close();
  }
  // Sets the XML of the field data, which comes first.
  void set_field(std::string field) { field_ = std::move(field); }

 private:
  const SplitSurfaces& all_;
  const bool compress_;
  AppendedData data_;
  std::string field_, xml_;
};

// Returns the names of the bodies as an XML array of strings: the numbers of their characters, with a 0
// after each string.
std::string names_array(const ExportedRun& run) {
  std::string text =
      fmt::format("<Array type=\"String\" Name=\"body_names\" NumberOfTuples=\"{}\" format=\"ascii\">\n",
                  run.bodies().size());
  for (const ExportedBody& body : run.bodies()) {
    for (const char c : body.name) text += fmt::format("{} ", static_cast<unsigned char>(c));
    text += "0\n";
  }
  return text + "</Array>\n";
}

// Returns the field data of a frame: its time, its number and the names of the bodies.
std::string field_data(const FrameValues& values, const std::string& names) {
  return fmt::format(
      "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{}"
      "</DataArray>\n<DataArray type=\"Int64\" Name=\"frame\" NumberOfTuples=\"1\" format=\"ascii\">{}"
      "</DataArray>\n{}</FieldData>\n",
      values.time, values.frame, names);
}

// Writes the files of the frames. It holds what does not change from frame to frame.
class Frames {
 public:
  Frames(const ExportedRun& run, bool compress)
      : compress_(compress), all_(split_surfaces(run)), bodies_(run), names_(names_array(run)) {
    for (const auto& triangle : all_.triangles) {
      offsets_.push_back(static_cast<std::int64_t>(3 * (offsets_.size() + 1)));
      connectivity_.insert(connectivity_.end(), triangle.begin(), triangle.end());
    }
    for (const SplitSurfaces::Vertex& v : all_.vertices) uvs_.push_back(bodies_.uv(v));
  }

  void write(const FrameValues& values, const fs::path& path) {
    bodies_.place(values);
    if (first_.empty())
      for (const SplitSurfaces::Vertex& v : all_.vertices) first_.push_back(bodies_.position(v));
    PolyData file(all_, compress_);
    file.set_field(field_data(values, names_));
    file.add("<Points>\n");
    const std::vector<Vec3> points = gathered<Vec3>([&](auto& v) { return bodies_.position(v); });
    file.add("Float64", "points", 3, points);
    file.add("</Points>\n<Polys>\n");
    file.add("Int64", "connectivity", 1, connectivity_);
    file.add("Int64", "offsets", 1, offsets_);
    file.add("</Polys>\n<PointData Vectors=\"velocity\" Normals=\"normal\" TCoords=\"uv\">\n");
    file.add("Float32", "velocity", 3, gathered<Vec3f>([&](auto& v) { return bodies_.velocity(v); }));
    std::vector<Vec3f> displacement(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) displacement[i] = (points[i] - first_[i]).cast<float>();
    file.add("Float32", "displacement", 3, displacement);
    file.add("Float32", "normal", 3, gathered<Vec3f>([&](auto& v) { return bodies_.normal(v); }));
    file.add("Float32", "uv", 2, uvs_);
    if (all_.has_deformable)
      for (const PointValue& kind : point_values) {
        if (!kind.is_in(values)) continue;
        if (kind.scalars)
          file.add("Float32", kind.name, 1,
                   gathered<float>([&](auto& v) { return bodies_.of_point(v, kind.scalars(values)); }));
        else
          file.add("Float32", kind.name, 3,
                   gathered<Vec3f>([&](auto& v) { return bodies_.of_point(v, kind.vectors(values)); }));
      }
    file.add("</PointData>\n<CellData Scalars=\"body\">\n");
    file.add("Int32", "body", 1, all_.triangle_body);
    file.add("</CellData>\n");
    file.write(path);
  }

 private:
  // Returns value_of(vertex) for each vertex.
  template <class Value, class Function>
  std::vector<Value> gathered(const Function& value_of) const {
    std::vector<Value> values(all_.vertices.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = value_of(all_.vertices[i]);
    return values;
  }

  const bool compress_;
  const SplitSurfaces all_;
  PlacedBodies bodies_;
  const std::string names_;
  std::vector<std::int64_t> connectivity_, offsets_;
  std::vector<Vec2f> uvs_;
  std::vector<Vec3> first_;  // positions at the first frame written, for displacements
};

}  // namespace

ExportNotes export_vtk(const ExportedRun& run, const FormatOptions& options, const fs::path& folder) {
  Frames frames(run, options.compress);
  write_json(description(run, "vtk"), folder / "export.json");
  std::string collection =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
      "<Collection>\n";
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    const std::string name = fmt::format("{:04}.vtp", frame);
    frames.write(values, folder / name);
    collection += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", values.time, name);
  }
  OutputFile file(folder / "run.pvd");
  file.write(collection + "</Collection>\n</VTKFile>\n");
  file.close();
  return {};
}

}  // namespace duet::io
