// A block of finite elements for tests of their forces and measures.
#pragma once

#include <random>

#include "sim/deformable/forces/finite_elements.h"

namespace duet::test {

/// A block of 1 x 1.5 x 2 m with `cells` cells along each edge, E = 1e5 Pa, a Poisson's ratio of 0.45 and
/// damping of 0.01 s. The particles have the masses of 1000 kg/m^3.
struct ElasticBlock {
  FiniteElements elements;
  std::vector<Vec3> x;
  std::vector<double> mass;

  explicit ElasticBlock(int cells = 3, MaterialModel model = MaterialModel::neo_hookean,
                        double mass_damping = 0) {
    const TetMesh mesh = box_lattice(Vec3(1, 1.5, 2), Vec3i(cells, cells, cells));
    x = mesh.nodes;
    mass.assign(x.size(), 0);
    for (const Tet& t : mesh.tets)
      for (int i : t)
        mass[static_cast<std::size_t>(i)] +=
            250 * tet_volume(x[static_cast<std::size_t>(t[0])], x[static_cast<std::size_t>(t[1])],
                             x[static_cast<std::size_t>(t[2])], x[static_cast<std::size_t>(t[3])]);
    elements.add(mesh.tets, x, {lame_parameters(1e5, 0.45, 0.01), model, mass_damping});
    elements.finalize(mass, mass, {});
  }
  // Returns a vector for each particle with components in [-size, size].
  std::vector<Vec3> random_field(unsigned seed, double size) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-size, size);
    std::vector<Vec3> field(x.size());
    for (Vec3& v : field)
      for (int k = 0; k < 3; ++k) v[k] = uniform(random);
    return field;
  }
  // Returns the positions at rest, displaced by `by`.
  std::vector<Vec3> moved(const std::vector<Vec3>& by) const {
    std::vector<Vec3> result = x;
    for (std::size_t i = 0; i < x.size(); ++i) result[i] += by[i];
    return result;
  }
};

}  // namespace duet::test
