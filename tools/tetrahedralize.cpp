// `duet tetrahedralize`: fills a closed surface with tetrahedra and reports their quality.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>

#include "tools/commands.h"
#include "tools/replaceable.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/files/tet_mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/tet_mesh_check.h"
#include "sim/geometry/mesh/tet_quality.h"
#include "sim/geometry/meshing/tetrahedralizer.h"
#include "sim/io/run_directory.h"

namespace duet::tools {
namespace {

constexpr double min_cells = 2, max_cells = 512;  // number of lattice cells along the longest extent

// The report of a filled surface.
struct Filling {
  TetQuality quality;
  std::size_t boundary_triangles = 0;
  int parts = 0;
  double spacing = 0;         // m
  double surface_volume = 0;  // m^3, enclosed by the surface
  double seconds = 0;
  // Relative error of the volume of the tetrahedra.
  double volume_error() const { return quality.volume / surface_volume - 1; }
};

// Reads and repairs a mesh, and notes the repairs. Throws Error (usage) if the mesh bounds no solid.
TriangleMesh read_solid(const std::string& path, Report& report) {
  TriangleMesh mesh = read_mesh(path);
  const MeshReport found = repair(mesh);
  for (const std::string& done : found.repairs) report.note(fmt::format("{}: {}", path, done));
  for (std::size_t i = 1; i < found.flaws.size(); ++i)
    report.note(fmt::format("{} {} ({})", path, found.flaws[i].message, found.flaws[i].remedy));
  if (!found.flaws.empty())
    throw Error(ExitStatus::usage,
                fmt::format("{} {} ({})", path, found.flaws[0].message, found.flaws[0].remedy));
  return mesh;
}

// Returns the edge of the lattice (m) that --spacing or --cells asks for; empty if neither is given. Throws
// Error (usage) if it is out of range.
std::optional<double> wanted_spacing(const TetrahedralizeOptions& options, const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.positions) box.extend(x);
  const double extent = box.sizes().maxCoeff();
  if (options.cells) return extent / *options.cells;
  if (!options.spacing) return {};
  const double cells = extent / *options.spacing;
  if (!(cells >= min_cells && cells <= max_cells))
    throw Error(ExitStatus::usage,
                fmt::format("--spacing {:.6g}: must be in [{:.4g}, {:.4g}] for a mesh {:.4g} across",
                            *options.spacing, extent / max_cells, extent / min_cells, extent));
  return options.spacing;
}

bool is_vtk(const std::string& path) { return std::filesystem::path(path).extension() == ".vtk"; }

// Returns the content of the file, in the format of its extension.
std::string file_text(const std::string& path, const TetMesh& mesh) {
  return is_vtk(path) ? vtk_text(mesh) : medit_text(mesh);
}

void require_known_ending(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending != ".mesh" && ending != ".vtk")
    throw Error(ExitStatus::usage,
                fmt::format("{}: use the ending .mesh (Medit, for scenes) or .vtk (ParaView)", path));
}

// Returns the report as text, with a histogram of the dihedral angles.
std::string text_of(const Filling& result) {
  const TetQuality& q = result.quality;
  std::string text = fmt::format(
      "{} tetrahedra, {} nodes, {} boundary triangles, spacing {:.4g} m\n"
      "dihedral angles {:.1f} to {:.1f} degrees, smallest altitude {:.3g} m, edges {:.3g} to {:.3g} m\n"
      "volume {:.6g} m^3, {:+.3f} % against the surface; {:.2f} s\n"
      "dihedral angles in degrees\n",
      q.tets, q.nodes, result.boundary_triangles, result.spacing, q.min_angle, q.max_angle, q.min_altitude,
      q.shortest_edge, q.longest_edge, q.volume, 100 * result.volume_error(), result.seconds);
  const std::size_t most = *std::max_element(q.angles.begin(), q.angles.end());
  for (std::size_t i = 0; i < q.angles.size(); ++i)
    if (q.angles[i] > 0)
      text += fmt::format("  {:>3} to {:>3} {:>9} {:#<{}}\n", 10 * i, 10 * i + 10, q.angles[i], "",
                          (50 * q.angles[i] + most - 1) / most);
  return text;
}

nlohmann::json json_of(const Filling& result) {
  const TetQuality& q = result.quality;
  return {{"tets", q.tets},
          {"nodes", q.nodes},
          {"boundary_triangles", result.boundary_triangles},
          {"parts", result.parts},
          {"spacing", result.spacing},
          {"least_dihedral_angle", q.min_angle},
          {"largest_dihedral_angle", q.max_angle},
          {"dihedral_angles", q.angles},
          {"smallest_altitude", q.min_altitude},
          {"shortest_edge", q.shortest_edge},
          {"longest_edge", q.longest_edge},
          {"volume", q.volume},
          {"volume_error", result.volume_error()},
          {"seconds", result.seconds}};
}

}  // namespace

Outcome tetrahedralize(const TetrahedralizeOptions& options, Report& report) {
  require_known_ending(options.out);
  require_own_text(options.out, is_vtk(options.out) ? vtk_start : medit_start, "file of tetrahedra");
  const TriangleMesh surface = read_solid(options.in, report);
  const auto start = std::chrono::steady_clock::now();
  const std::optional<double> wanted = wanted_spacing(options, surface);
  const LevelSet inside = fine_level_set(surface, wanted);
  Filling result;
  result.spacing = wanted.value_or(default_spacing(inside));
  const TetMesh mesh =
      duet::tetrahedralize(inside, result.spacing, options.graded ? CellSizes::graded : CellSizes::uniform);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (mesh.tets.empty())
    throw Error(
        ExitStatus::usage,
        fmt::format("no tetrahedron fits inside at a spacing of {:.4g} m; the surface is {:.3g} m at its "
                    "thickest: lower --spacing",
                    result.spacing, inside.min_size()));
  result.quality = tet_quality(mesh);
  result.boundary_triangles = boundary(mesh).size();
  result.parts = connected_parts(mesh);
  result.surface_volume = mass_properties(surface).volume;
  io::write_atomically(options.out, file_text(options.out, mesh));
  if (options.json)
    print(json_text(json_of(result)) + "\n");
  else
    print(text_of(result));
  if (result.parts > 1)
    report.note(fmt::format("the tetrahedra fall into {} parts where the surface is thin: lower --spacing",
                            result.parts));
  return {ExitStatus::done, options.json ? "" : fmt::format("wrote {}", options.out)};
}

}  // namespace duet::tools
