#include "sim/geometry/meshing/lattice_stencils.h"

#include <algorithm>
#include <utility>

#include "sim/geometry/mesh/tet_quality.h"

namespace duet {
namespace {

// Fills the lattice tet by tet. The nodes of the result are those of the lattice, then the cuts.
class Stuffing {
 public:
  explicit Stuffing(const CutLattice& cut) : cut_(cut) {
    mesh_.nodes = cut.positions;
    for (const Cut& c : cut.cuts) {
      const Vec3 &a = cut.positions[as_index(c.inside)], &b = cut.positions[as_index(c.outside)];
      mesh_.nodes.push_back(a + c.place * (b - a));
    }
    for (const Tet& tet : cut.lattice.tets) add_inside(tet);
  }
  TetMesh take() { return std::move(mesh_); }

 private:
  // Adds the part of a tet that lies inside.
  void add_inside(const Tet& tet) {
    std::array<int, 4> in{}, on{}, out{};
    std::size_t ins = 0, ons = 0, outs = 0;
    for (const int node : tet) {
      const Side side = cut_.sides[as_index(node)];
      if (side == Side::inside) in[ins++] = node;
      if (side == Side::surface) on[ons++] = node;
      if (side == Side::outside) out[outs++] = node;
    }
    if (ins > 0 && outs == 0) return add(tet);
    if (ins == 1) {
      for (std::size_t k = 0; k < outs; ++k) on[ons++] = cut(in[0], out[k]);
      return add({in[0], on[0], on[1], on[2]});
    }
    if (ins == 2 && outs == 1) add_pyramid(in[0], in[1], out[0], on[0]);
    if (ins == 2 && outs == 2) add_wedge(in[0], in[1], out[0], out[1]);
    if (ins == 3) add_truncated({in[0], in[1], in[2]}, out[0]);
  }

  // Returns how the quadrilateral is cut that remains of a face with nodes `a` and `b` inside and `out`
  // outside. True means the diagonal from `a` to the cut next to `b`, false the one from `b`. Both tets at
  // the face must choose alike. A diagonal ends in the cut of a long edge; if both cut edges are short, the
  // edge ab is long, and its ends differ in parity.
  bool diagonal_from_first(int a, int b, int out) const {
    const BccLattice& lattice = cut_.lattice;
    if (lattice.is_long(a, out)) return false;
    if (lattice.is_long(b, out)) return true;
    return parity(a) > parity(b);
  }
  // Returns 0 or 1; the ends of a long edge differ in it.
  int parity(int node) const { return cut_.lattice.nodes[as_index(node)].sum() / 2 % 2; }

  // Adds the part of a tet with two nodes inside, one outside and one on the surface.
  void add_pyramid(int a, int b, int out, int apex) {
    if (!diagonal_from_first(a, b, out)) std::swap(a, b);
    add({a, b, cut(b, out), apex});
    add({a, cut(b, out), cut(a, out), apex});
  }

  // Adds the part of a tet with `a` and `b` inside and `c` and `d` outside: a prism between the triangles (a,
  // its cuts) and (b, its cuts).
  void add_wedge(int a, int b, int c, int d) {
    const bool from_a_at_c = diagonal_from_first(a, b, c), from_a_at_d = diagonal_from_first(a, b, d);
    if (from_a_at_c == from_a_at_d) {
      if (!from_a_at_c) std::swap(a, b);
      // The side on the surface belongs to this tet alone, so its diagonal is free: the one with the larger
      // least angle is chosen.
      const std::array<int, 3> at_a{a, cut(a, c), cut(a, d)}, at_b{b, cut(b, c), cut(b, d)};
      const std::array<int, 3> swapped_at_a{a, at_a[2], at_a[1]}, swapped_at_b{b, at_b[2], at_b[1]};
      if (min_angle_of_prism(at_a, at_b) >= min_angle_of_prism(swapped_at_a, swapped_at_b))
        add_prism(at_a, at_b);
      else
        add_prism(swapped_at_a, swapped_at_b);
    } else {
      if (!from_a_at_c) std::swap(c, d);
      add_prism({cut(a, d), a, cut(a, c)}, {cut(b, d), b, cut(b, c)});
    }
  }

  // Adds the part of a tet with three nodes inside and one outside.
  void add_truncated(std::array<int, 3> in, int out) {
    // The node whose edge to `out` is long is the end of the diagonals of both of its faces.
    const auto is_long = [&](int node) { return cut_.lattice.is_long(node, out); };
    std::iter_swap(std::find_if(in.begin(), in.end(), is_long), in.end() - 1);
    if (!diagonal_from_first(in[0], in[1], out)) std::swap(in[0], in[1]);
    add_prism(in, {cut(in[0], out), cut(in[1], out), cut(in[2], out)});
  }

  // Cuts the prism between two triangles whose corners correspond along the diagonals a0-b1, a0-b2 and a1-b2
  // of its sides. Diagonals that run around the prism would cut it into no tets at all.
  static std::array<Tet, 3> tets_of_prism(const std::array<int, 3>& a, const std::array<int, 3>& b) {
    return {{{a[0], b[0], b[1], b[2]}, {a[0], a[1], b[1], b[2]}, {a[0], a[1], a[2], b[2]}}};
  }
  void add_prism(const std::array<int, 3>& a, const std::array<int, 3>& b) {
    for (const Tet& tet : tets_of_prism(a, b)) add(tet);
  }
  // Returns the smallest dihedral angle of these tets, degrees.
  double min_angle_of_prism(const std::array<int, 3>& a, const std::array<int, 3>& b) const {
    double least = 180;
    for (const Tet& tet : tets_of_prism(a, b))
      for (const double angle : dihedral_angles(mesh_, tet)) least = std::min(least, angle);
    return least;
  }

  // Appends a tet, turned if its volume is negative.
  void add(Tet tet) {
    if (volume(mesh_, tet) < 0) std::swap(tet[2], tet[3]);
    mesh_.tets.push_back(tet);
  }

  // Returns the node at the cut of an edge.
  int cut(int inside, int outside) const {
    return static_cast<int>(cut_.positions.size() + cut_.cut_of(inside, outside));
  }

  const CutLattice& cut_;
  TetMesh mesh_;
};

}  // namespace

TetMesh tets_inside(const CutLattice& cut) {
  TetMesh mesh = Stuffing(cut).take();
  keep_used_nodes(mesh);
  return mesh;
}

}  // namespace duet
