// Writes the format `vdb`: level sets as OpenVDB files, and a USD stage that shows and moves them. A rigid
// body has one grid in the axes of its pose, which the stage moves; a deformable body has a grid a frame, if
// the user asks for it by the width of its voxels.
#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/tracks.h"
#include "sim/io/export/usd_shading.h"
#include "sim/io/export/vdb_grids.h"
#include "sim/io/vdb_file.h"

namespace duet::io {
namespace {

// Most voxels of the level set of one deformable body at a frame. They and what their conversion needs take
// some 2 GB of memory.
constexpr double max_band_voxels = 1e8;
// Widest body in voxels: floats hold points to 1/80 of a voxel there.
constexpr double max_voxels_across = 1e5;

void write_grid(const openvdb::FloatGrid::ConstPtr& grid, const fs::path& path) {
  OutputFile file(path);
  file.write(vdb_bytes({grid}));
  file.close();
}

// Returns the text of the bounding box of a grid's active voxels.
std::string extent_text(const openvdb::FloatGrid& grid) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const openvdb::BBoxd world = grid.transform().indexToWorld(box);
  const auto point = [](const openvdb::Vec3d& x) { return Vec3f(Vec3(x.x(), x.y(), x.z()).cast<float>()); };
  return usd_array(std::vector<Vec3f>{point(world.min()), point(world.max())});
}

// Returns a Volume with its one field. `extent` and `file` are lines of its attributes. It has the name of
// the body's prim, because Blender makes one object of both and gives it the name of the volume.
std::string volume_text(const std::string& name, const std::string& extent, const std::string& file) {
  constexpr const char* form = R"(
            def Volume "{0}"
            {{
{2}                rel field:{1} = <{1}>

                def OpenVDBAsset "{1}"
                {{
                    token fieldName = "{1}"
{3}                }}
            }}
)";
  return fmt::format(form, name, vdb_grid_name, extent, file);
}

// A deformable body whose surface has an inside, frame by frame.
struct SoftVolume {
  std::size_t body = 0;      // index in ExportedRun::bodies()
  Surface surface;           // at the present frame
  UsdSamples files, extent;  // of the frames so far
  bool has_holes = false;    // true if the level set had no voxel inside at some frame
};

// Export of the level sets of a run.
class VdbExport {
 public:
  VdbExport(const ExportedRun& run, const FormatOptions& options, const fs::path& folder)
      : run_(run),
        folder_(folder),
        voxel_(run.scale() * options.voxel),
        files_(safe_body_names(run)),
        poses_(run) {}

  ExportNotes write() {
    choose_soft_bodies();
    write_shapes();
    for (const int frame : run_.frames()) {
      const FrameValues values = run_.read(frame);
      poses_.add(values);
      for (SoftVolume& soft : soft_) write_frame(soft, frame, values);
    }
    write_stage();
    if (!shapes_.shapes.empty()) export_transforms(run_, {}, folder_);
    write_json(described(), folder_ / "export.json");
    return notes();
  }

 private:
  void choose_soft_bodies();
  void write_shapes();
  void write_frame(SoftVolume& soft, int frame, const FrameValues& values);
  void write_stage() const;
  nlohmann::ordered_json described() const;
  ExportNotes notes() const;

  std::string shape_file(std::size_t body) const {
    const ShapeGrid& shape = shapes_.shapes[static_cast<std::size_t>(shapes_.of_body[body])];
    return fmt::format("shapes/{}.vdb", files_[shape.body]);
  }

  const ExportedRun& run_;
  const fs::path folder_;
  const double voxel_;  // width of the voxels of deformable bodies, unit of the export; 0: none
  const std::vector<std::string> files_;  // names of the bodies that are safe as names of files
  ShapeGrids shapes_;
  std::vector<SoftVolume> soft_;
  std::vector<std::string> left_out_, open_;  // deformable bodies that were not asked for, or have no inside
  PoseTracks poses_;
};

void VdbExport::choose_soft_bodies() {
  bool has_rigid = false;
  for (std::size_t i = 0; i < run_.bodies().size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    if (body.is_rigid()) {
      has_rigid = true;
    } else if (voxel_ == 0) {
      left_out_.push_back(body.name);
    } else if (!has_inside(body.rest)) {
      open_.push_back(body.name);
    } else {
      soft_.push_back({i, body.rest, {}, {}, false});
    }
  }
  if (has_rigid || !soft_.empty()) return;
  if (voxel_ == 0)
    throw Error(
        ExitStatus::usage,
        "--to vdb: none of the bodies is rigid, and level sets of deformable bodies need the width of "
        "their voxels (such as --voxel 0.02, in m)");
  throw Error(
      ExitStatus::usage,
      fmt::format("--to vdb: the surface of {} has open edges, and so no inside and no level set (usd, "
                  "vtk, ply and obj hold open surfaces)",
                  open_.front()));
}

void VdbExport::write_shapes() {
  shapes_ = read_shape_grids(run_);
  if (!shapes_.shapes.empty()) create_folder(folder_ / "shapes");
  for (const ShapeGrid& shape : shapes_.shapes) write_grid(shape.grid, folder_ / shape_file(shape.body));
  if (!soft_.empty()) create_folder(folder_ / "frames");
}

void VdbExport::write_frame(SoftVolume& soft, int frame, const FrameValues& values) {
  const ExportedBody& body = run_.bodies()[soft.body];
  place(body, values, soft.surface);
  Eigen::AlignedBox3d box;
  for (const Vec3& x : soft.surface.positions) box.extend(x);
  const double voxels = band_voxels(soft.surface, voxel_), across = box.sizes().maxCoeff() / voxel_;
  if (voxels > max_band_voxels || across > max_voxels_across) {
    const double factor = std::max(std::sqrt(voxels / max_band_voxels), across / max_voxels_across);
    throw Error(
        ExitStatus::usage,
        fmt::format("--voxel: the level set of {} at frame {} would have some {:.2g} voxels and be {:.2g} "
                    "voxels wide; at most {:g} and {:g} are possible (--voxel {:.1g} or wider)",
                    body.name, frame, voxels, across, max_band_voxels, max_voxels_across,
                    1.5 * factor * voxel_ / run_.scale()));
  }
  const openvdb::FloatGrid::Ptr grid = surface_grid(soft.surface, voxel_);
  const std::string file = fmt::format("frames/{}.{:04}.vdb", files_[soft.body], frame);
  write_grid(grid, folder_ / file);
  soft.files.add(frame, "@./" + file + "@");
  soft.extent.add(frame, extent_text(*grid));
  const auto first = grid->cbeginValueOn();
  bool has_inner = false;
  for (auto value = first; value && !has_inner; ++value) has_inner = *value < 0;
  soft.has_holes = soft.has_holes || !has_inner;
}

void VdbExport::write_stage() const {
  const std::string in_body(12, ' '), in_volume(16, ' '), in_field(20, ' ');
  UsdNames names;
  OutputFile out(folder_ / "run.usda");
  out.write(usd_stage_head(run_) + "def Xform \"run\"\n{\n    def Xform \"bodies\"\n    {\n");
  std::size_t next = 0;
  for (std::size_t i = 0; i < run_.bodies().size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    const int shape = shapes_.of_body[i];
    const bool is_soft = next < soft_.size() && soft_[next].body == i;
    if (shape < 0 && !is_soft) continue;
    const std::string name = names.take(body.name);
    std::string display = usd_display_name(body.name, name);
    if (!display.empty()) display = in_body + display + "\n";
    out.write(
        fmt::format("        def Xform \"{}\" (\n{}{}customData = {{\n{}    string kind = \"{}\"\n{}}}\n"
                    "        )\n        {{\n",
                    name, display, in_body, in_body, body.kind, in_body));
    if (is_soft) {
      const SoftVolume& soft = soft_[next++];
      out.write(volume_text(name, soft.extent.text(in_volume, "float3[] extent"),
                            soft.files.text(in_field, "asset filePath")));
    } else {
      const std::string extent = extent_text(*shapes_.shapes[static_cast<std::size_t>(shape)].grid);
      out.write(usd_transform(in_body, run_.frames(), poses_.of(i)) +
                volume_text(name, fmt::format("{}float3[] extent = {}\n", in_volume, extent),
                            fmt::format("{}asset filePath = @./{}@\n", in_field, shape_file(i))));
    }
    out.write("        }\n\n");
  }
  out.write("    }\n}\n");
  out.close();
}

nlohmann::ordered_json VdbExport::described() const {
  nlohmann::ordered_json object = description(run_, "vdb");
  object["grid"] = vdb_grid_name;
  std::size_t next = 0;
  for (std::size_t i = 0; i < run_.bodies().size(); ++i) {
    nlohmann::ordered_json& body = object["bodies"][i];
    if (const int shape = shapes_.of_body[i]; shape >= 0) {
      body["level_set"] = shape_file(i);
      body["voxel"] = shapes_.shapes[static_cast<std::size_t>(shape)].grid->voxelSize()[0];
    } else if (next < soft_.size() && soft_[next].body == i) {
      body["level_sets"] = fmt::format("frames/{}.####.vdb", files_[i]);
      body["voxel"] = voxel_;
      ++next;
    }
  }
  return object;
}

ExportNotes VdbExport::notes() const {
  ExportNotes notes;
  if (!left_out_.empty())
    notes.push_back(
        fmt::format("{} and {} other deformable bodies are left out; --voxel, the width of their "
                    "voxels in m, asks for level sets of them, too",
                    left_out_.front(), left_out_.size() - 1));
  if (!open_.empty())
    notes.push_back(
        fmt::format("{} and {} other deformable bodies have surfaces with open edges, and so no "
                    "inside and no level set",
                    open_.front(), open_.size() - 1));
  for (const SoftVolume& soft : soft_)
    if (soft.has_holes)
      notes.push_back(
          fmt::format("{} is thinner than its voxels, and its level set has no inside (a smaller "
                      "--voxel helps)",
                      run_.bodies()[soft.body].name));
  return notes;
}

}  // namespace

ExportNotes export_vdb(const ExportedRun& run, const FormatOptions& options, const fs::path& folder) {
  return VdbExport(run, options, folder).write();
}

}  // namespace duet::io
