#include "sim/geometry/meshing/tetrahedralizer.h"

#include <algorithm>
#include <set>

#include "tests/support/closed_surface.h"
#include "tests/support/full.h"
#include "tests/support/meshes.h"
#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/parallel.h"
#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/tet_mesh_check.h"
#include "sim/geometry/mesh/tet_quality.h"
#include "sim/geometry/meshing/lattice_stencils.h"

namespace duet::tetrahedralizer_test {
namespace {

// Visits one tetrahedron of the lattice with all combinations of sides of its corners, and with moved nodes
// and cuts at the ends of their ranges. It measures the dihedral angles of the pieces inside.
class ExtremeTet {
 public:
  explicit ExtremeTet(int offset) {
    lattice_.spacing = 1;
    lattice_.nodes = {{4 + offset, 4, 4}, {6 + offset, 4, 4}, {5 + offset, 5, 5}, {5 + offset, 5, 3}};
    lattice_.tets = {{0, 1, 2, 3}};
    for (int axis = 0; axis < 3; ++axis)
      for (const int sign : {-2, 2}) edges_.push_back(sign * Vec3i::Unit(axis));
    for (int c = 0; c < 8; ++c) edges_.emplace_back(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
  }

  void visit_all() {
    for (int code = 0; code < 81; ++code) {
      cut_ = {lattice_, {}, {}, {}};
      for (int i = 0, rest = code; i < 4; ++i, rest /= 3) {
        cut_.positions.push_back(lattice_.position(i));
        cut_.sides.push_back(static_cast<Side>(rest % 3 - 1));
      }
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
          if (side(i) == Side::inside && side(j) == Side::outside) cut_.cuts.push_back({i, j, 0.5});
      move_from(0);
    }
  }

  double least = 180, largest = 0;  // degrees

 private:
  Side side(int i) const { return cut_.sides[static_cast<std::size_t>(i)]; }

  // Moves node `i` and all later ones. A node on the surface has stayed or has moved along any of its edges
  // as far as a cut may draw it. Two nodes cannot have moved along their common edge: the first move removes
  // the cut.
  void move_from(int i) {
    if (i == 4) return cut_from(0);
    const std::size_t node = static_cast<std::size_t>(i);
    move_from_here(i, Vec3i::Zero());
    if (side(i) != Side::surface) return;
    for (const Vec3i& edge : edges_) {
      const int far_end = static_cast<int>(
          std::find(lattice_.nodes.begin(), lattice_.nodes.end(), lattice_.nodes[node] + edge) -
          lattice_.nodes.begin());
      if (far_end < i && side(far_end) == Side::surface && moves_[static_cast<std::size_t>(far_end)] == -edge)
        continue;
      move_from_here(i, edge);
    }
  }

  void move_from_here(int i, const Vec3i& edge) {
    const std::size_t node = static_cast<std::size_t>(i);
    moves_[node] = edge;
    const double part = min_cut_place(edge.cwiseAbs().sum() == 2);
    cut_.positions[node] = lattice_.position(i) + part / 2 * edge.cast<double>();
    move_from(i + 1);
    cut_.positions[node] = lattice_.position(i);
  }

  void cut_from(std::size_t c) {
    if (c == cut_.cuts.size()) return measure();
    Cut& cut = cut_.cuts[c];
    const double margin = min_cut_place(lattice_.is_long(cut.inside, cut.outside));
    for (const double place : {margin, 0.5, 1 - margin}) {
      cut.place = place;
      cut_from(c + 1);
    }
  }

  void measure() {
    const TetMesh mesh = tets_inside(cut_);
    for (const Tet& tet : mesh.tets)
      for (const double angle : dihedral_angles(mesh, tet)) {
        least = std::min(least, angle);
        largest = std::max(largest, angle);
      }
  }

  BccLattice lattice_;
  CutLattice cut_;
  std::vector<Vec3i> edges_;
  std::vector<Vec3i> moves_ = std::vector<Vec3i>(4, Vec3i::Zero());
};

// The extreme cuts lie at the ends of their ranges (denser sampling finds none worse), so that they bound
// all. The bounds in the header hold, and are no weaker than they need be: angles come within 0.1 degrees of
// them.
TEST(Tetrahedralizer, NoCutOfATetBreaksTheStatedAngles) {
  for (const int offset : {0, -2}) {  // The two offsets are the two parities of the lattice.
    ExtremeTet tet(offset);
    tet.visit_all();
    EXPECT_GT(tet.least, min_dihedral_angle);
    EXPECT_LT(tet.least, min_dihedral_angle + 0.1);  // The stated bound is attained to 0.1 degrees.
    EXPECT_LT(tet.largest, max_dihedral_angle);
    EXPECT_GT(tet.largest, max_dihedral_angle - 0.1);
  }
}

// Returns the greatest distance of a boundary node from the surface of `shape`, in m.
double farthest_boundary_node(const TetMesh& mesh, const LevelSet& shape) {
  double farthest = 0;
  for (const Triangle& t : boundary(mesh))
    for (const int i : t)
      farthest = std::max(farthest, std::abs(shape.distance(mesh.nodes[static_cast<std::size_t>(i)])));
  return farthest;
}

void expect_good(const TetMesh& mesh) {
  const TetQuality quality = tet_quality(mesh);
  EXPECT_GT(quality.min_angle, min_dihedral_angle);
  EXPECT_LT(quality.max_angle, max_dihedral_angle);
  EXPECT_TRUE(test::is_closed_manifold(boundary(mesh)));
  for (const Tet& tet : mesh.tets) ASSERT_GT(volume(mesh, tet), 0);
}

struct NamedShape {
  const char* name;
  LevelSet shape;
};
std::vector<NamedShape> shapes() {
  return {{"sphere", LevelSet::sphere(0.5)},
          {"box", LevelSet::box(Vec3(1, 0.8, 0.6))},
          {"capsule", LevelSet::capsule(0.3, 0.5)},
          {"cylinder", LevelSet::cylinder(0.4, 0.7)},
          {"torus", LevelSet::torus(0.4, 0.15)}};
}

TEST(Tetrahedralizer, FillsEveryShapeToItsSurface) {
  for (const auto& [name, shape] : shapes())
    for (const bool graded : {false, true}) {
      SCOPED_TRACE(fmt::format("{}{}", name, graded ? ", graded" : ""));
      const double spacing = 0.067;  // m: no simple fraction of the sizes
      const TetMesh mesh = tetrahedralize(shape, spacing, graded ? CellSizes::graded : CellSizes::uniform);
      expect_good(mesh);
      EXPECT_EQ(connected_parts(mesh), 1);
      EXPECT_LT(farthest_boundary_node(mesh, shape), 1e-12);  // m: regula falsi stops at 1e-13 of an edge.
      // Cut tetrahedra alone have altitudes down to 0.12 of the spacing. Smoothing raises them, and with them
      // the stable time step.
      EXPECT_GT(tet_quality(mesh).min_altitude, 0.3 * spacing);
      // Chords lie inside the surface by at most about (a cell)^2 / (8 radius), and cut-off edges by a third
      // of a cell.
      EXPECT_LT(volume(mesh), volume(shape));
      EXPECT_GT(volume(mesh), 0.96 * volume(shape));
    }
}

// Curved surfaces are cut along chords, whose error falls with the square of their length: halving the
// spacing quarters the error of the volume.
TEST(Tetrahedralizer, VolumeConvergesAtSecondOrder) {
  for (const LevelSet& shape : {LevelSet::sphere(0.5), LevelSet::torus(0.4, 0.15)}) {
    const auto error = [&](double spacing) {
      return 1 - volume(tetrahedralize(shape, spacing)) / volume(shape);
    };
    const double coarse = error(0.08), middle = error(0.04);
    // The lattice meets the surface at other places for every spacing, which moves single ratios around 4.
    EXPECT_NEAR(coarse / middle, 4, 0.6);
    if (test::runs_in_full()) {
      EXPECT_NEAR(middle / error(0.02), 4, 0.6);
    }
  }
}

std::set<std::array<double, 3>> boundary_points(const TetMesh& mesh) {
  std::set<std::array<double, 3>> points;
  for (const Triangle& t : boundary(mesh))
    for (const int i : t) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(i)];
      points.insert({x.x(), x.y(), x.z()});
    }
  return points;
}

TEST(Tetrahedralizer, GradingKeepsTheSurfaceAndSavesTetsInside) {
  const LevelSet ball = LevelSet::sphere(1);
  const TetMesh uniform = tetrahedralize(ball, 0.08), graded = tetrahedralize(ball, 0.08, CellSizes::graded);
  expect_good(graded);
  // Both meshes have the same boundary nodes, up to how smoothing moves them along the surface.
  EXPECT_EQ(boundary_points(graded).size(), boundary_points(uniform).size());
  EXPECT_LT(static_cast<double>(graded.tets.size()),
            0.7 * static_cast<double>(uniform.tets.size()));             // less in finer meshes
  EXPECT_NEAR(volume(graded), volume(uniform), 1e-5 * volume(uniform));  // There are no gaps and no overlaps.
  EXPECT_GT(tet_quality(graded).longest_edge, 0.31);  // The inner cells have edges of four spacings.
}

// Walls and gaps of about a cell have no room for the surface on both sides of a node. The mesh need not have
// the shape there, but must stay a manifold with positive volumes.
TEST(Tetrahedralizer, StaysManifoldWhereItCannotResolve) {
  TriangleMesh knot = read_mesh(test::source_folder() + "/assets/knot.obj");
  ASSERT_TRUE(repair(knot).flaws.empty());
  const LevelSet knotted = fine_level_set(knot, {});
  const double thickness = knotted.min_size();
  for (const double part : {0.4, 0.7, 0.9, 1.1}) expect_good(tetrahedralize(knotted, part * thickness));
  for (const double height : {0.06, 0.09, 0.13})
    expect_good(tetrahedralize(LevelSet::box(Vec3(1, height, 0.8)), 0.1));
  for (const double tube : {0.06, 0.08, 0.11}) {
    const LevelSet ring = LevelSet::torus(0.12, tube);  // The hole of the ring closes as the tube grows.
    const TetMesh mesh = tetrahedralize(ring, 0.1);
    expect_good(mesh);
    EXPECT_LT(farthest_boundary_node(mesh, ring), 0.035);  // m: about 0.4 of a short edge
  }
}

TEST(Tetrahedralizer, MakesNothingOfWhatIsThinnerThanItsCells) {
  EXPECT_TRUE(tetrahedralize(LevelSet::torus(1, 0.01), 0.7).tets.empty());
}

TEST(Tetrahedralizer, FillsAMeshOfTwentyThousandTriangles) {
  const TriangleMesh torus = test::torus_mesh(1, 0.4, 125, 80);
  ASSERT_EQ(torus.triangles.size(), 20000U);
  const LevelSet inside = fine_level_set(torus, 0.1);
  const TetMesh mesh = tetrahedralize(inside, 0.1);
  expect_good(mesh);
  EXPECT_EQ(connected_parts(mesh), 1);
  // The grid of distances has cells of h = 0.05 m, half the spacing, and is off by h^2 / (8 tube radii) at a
  // chord. The bound, h^2 / (2 tube radii), leaves a factor of four.
  EXPECT_LT(farthest_boundary_node(mesh, LevelSet::torus(1, 0.4)), 0.05 * 0.05 / 0.4 / 2);
  EXPECT_NEAR(volume(mesh) / mass_properties(torus).volume, 1, 0.02);
}

TEST(Tetrahedralizer, IsTheSameForAnyNumberOfThreads) {
  const auto with_threads = [](int count) {
    set_thread_count(count);
    return tetrahedralize(LevelSet::torus(0.4, 0.15), 0.045, CellSizes::graded);
  };
  const TetMesh one = with_threads(1), three = with_threads(3);
  set_thread_count(0);
  EXPECT_EQ(one.nodes, three.nodes);
  EXPECT_EQ(one.tets, three.tets);
}

}  // namespace
}  // namespace duet::tetrahedralizer_test
