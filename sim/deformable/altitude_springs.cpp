#include "sim/deformable/altitude_springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

constexpr std::size_t batch_grain = 32;
constexpr std::size_t first_between_edges = 4;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

// The corners in the order in which altitude() takes them: a vertex and its opposite face, which it sees
// counter-clockwise, or two opposite edges. All altitudes of a tet of positive volume are positive.
constexpr std::array<std::array<std::size_t, 4>, 7> corners = {
    {{0, 1, 3, 2}, {1, 0, 2, 3}, {2, 0, 3, 1}, {3, 0, 1, 2}, {0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}}};

// Twice the area of the face, or the cross product of the edges: six volumes over it are the altitude.
Vec3 base(std::size_t altitude, const std::array<Vec3, 4>& x) {
  const auto& c = corners[altitude];
  return altitude < first_between_edges ? (x[c[2]] - x[c[1]]).cross(x[c[3]] - x[c[1]])
                                        : (x[c[1]] - x[c[0]]).cross(x[c[3]] - x[c[2]]);
}

// sum w_i^2 / m_i for the foot in the middle of the face or of the edges.
double inverse_mass_of(std::size_t altitude, const std::array<double, 4>& inverse_mass) {
  const auto& c = corners[altitude];
  const double first = inverse_mass[c[0]];
  const double others = inverse_mass[c[1]] + inverse_mass[c[2]] + inverse_mass[c[3]];
  return altitude < first_between_edges ? first + others / 9 : (first + others) / 4;
}

}  // namespace

void AltitudeSprings::add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest, double modulus,
                          double damping) {
  for (const Tet& tet : tets) {
    std::array<Vec3, 4> x;
    for (std::size_t i = 0; i < 4; ++i) x[i] = rest[as_index(tet[i])];
    RestTet entry{{}, modulus, damping};
    for (std::size_t a = 0; a < altitudes; ++a)
      entry.length[a] = 6 * tet_volume(x[0], x[1], x[2], x[3]) / base(a, x).norm();
    tets_.push_back(tet);
    rest_.push_back(entry);
  }
}

void AltitudeSprings::finalize(const std::vector<double>& inverse_mass) {
  batches_.resize((tets_.size() + pack_width - 1) / pack_width);
  std::vector<int> particles(batches_.size() * pack_width * 4, -1);
  for (std::size_t slot = 0; slot < batches_.size() * pack_width; ++slot) {
    const bool pads = slot >= tets_.size();
    const std::size_t t = std::min(slot, tets_.size() - 1);
    Batch& batch = batches_[slot / pack_width];
    const std::size_t lane = slot % pack_width;
    std::array<double, 4> inverse;
    for (std::size_t i = 0; i < 4; ++i) {
      batch.particle[i][lane] = tets_[t][i];
      inverse[i] = inverse_mass[as_index(tets_[t][i])];
      if (!pads) particles[slot * 4 + i] = tets_[t][i];
    }
    for (std::size_t a = 0; a < altitudes; ++a) {
      const double stiffness = rest_[t].modulus / rest_[t].length[a], mobility = inverse_mass_of(a, inverse);
      batch.rest_length[a][lane] = rest_[t].length[a];
      batch.stiffness[a][lane] = pads ? 0 : stiffness;
      batch.viscosity[a][lane] =
          pads || mobility <= 0 ? 0 : 2 * rest_[t].damping * std::sqrt(stiffness / mobility);
    }
  }
  forces_.assign(particles.size(), Vec3::Zero());
  sums_.build(particles, inverse_mass.size());
}

void AltitudeSprings::choose(Batch& batch, const std::vector<Vec3>& x) {
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    std::array<Vec3, 4> corner;
    for (std::size_t i = 0; i < 4; ++i) corner[i] = x[as_index(batch.particle[i][lane])];
    std::size_t best = 0;
    double largest = 0;
    for (std::size_t a = 0; a < altitudes; ++a)
      if (const double squared = base(a, corner).squaredNorm(); squared > largest) {
        largest = squared;
        best = a;
      }
    for (std::size_t i = 0; i < 4; ++i) {
      batch.order[i][lane] = static_cast<int>(corners[best][i]);
      batch.corner[i][lane] = batch.particle[corners[best][i]][lane];
    }
    batch.between_edges[lane] = best < first_between_edges ? 0 : -1;
    batch.chosen_length[lane] = batch.rest_length[best][lane];
    batch.chosen_stiffness[lane] = batch.stiffness[best][lane];
    batch.chosen_viscosity[lane] = batch.viscosity[best][lane];
  }
}

void AltitudeSprings::choose(const std::vector<Vec3>& x) {
  parallel_for(batches_.size(), batch_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) choose(batches_[b], x);
  });
}

// The foot divides the face by the barycentric coordinates (1 - a - b, a, b), or the edges by -a and b.
AltitudeSprings::Altitude AltitudeSprings::altitude(const Batch& batch, const std::vector<Vec3>& x) {
  std::array<PackVector, 4> corner;
  for (std::size_t i = 0; i < 4; ++i) corner[i] = gather(x, batch.corner[i]);
  const PackMask& edges = batch.between_edges;
  const PackVector e = select(edges, corner[1] - corner[0], corner[2] - corner[1]);
  const PackVector f = corner[3] - select(edges, corner[2], corner[1]);
  const PackVector r = corner[0] - select(edges, corner[2], corner[1]);
  const PackVector N = cross(e, f);
  const Pack squared = dot(N, N);
  const PackMask exists = squared > Pack{} + std::numeric_limits<double>::min();
  const Pack inverse = select(exists, 1.0 / select(exists, squared, Pack{} + 1.0), Pack{});
  const Pack a = inverse * dot(cross(r, f), N), b = inverse * dot(cross(e, r), N);
  Altitude result;
  result.normal = sqrt_of(inverse) * N;
  result.length = dot(r, result.normal);
  result.weight = {select(edges, 1.0 + a, Pack{} + 1.0), select(edges, -a, a + b - 1.0),
                   select(edges, b - 1.0, -a), -b};
  return result;
}

PackVector AltitudeSprings::difference(const Batch& batch, const std::vector<Vec3>& values) {
  PackVector sum = batch.weight[0] * gather(values, batch.corner[0]);
  for (std::size_t i = 1; i < 4; ++i) sum = sum + batch.weight[i] * gather(values, batch.corner[i]);
  return sum;
}

// `share_of(batch)` is a function of the corners: what goes to them.
template <class Share>
void AltitudeSprings::fill_forces(Share&& share_of) {
  parallel_for(batches_.size(), batch_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      Batch& batch = batches_[b];
      const auto share_at = share_of(batch);
      Vec3* out = forces_.data() + b * pack_width * 4;
      for (std::size_t i = 0; i < 4; ++i) {
        const PackVector share = share_at(i);
        for (std::size_t lane = 0; lane < pack_width; ++lane)
          out[4 * lane + as_index(batch.order[i][lane])] = {share.x[lane], share.y[lane], share.z[lane]};
      }
    }
  });
}

// `force_of(batch)` is the force along the normal, to be spread by the weights.
template <class Force>
void AltitudeSprings::add_forces(std::vector<Vec3>& sums, Force&& force_of) {
  if (tets_.empty()) return;
  fill_forces([&](Batch& batch) {
    const Pack force = force_of(batch);
    return [&batch, force](std::size_t i) { return (force * batch.weight[i]) * batch.normal; };
  });
  sums_.add(forces_, sums);
}

void AltitudeSprings::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
  add_forces(force, [&](Batch& batch) {
    const Altitude now = altitude(batch, x);
    batch.weight = now.weight;
    batch.normal = now.normal;
    return batch.chosen_stiffness * (batch.chosen_length - now.length);
  });
}

void AltitudeSprings::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  add_forces(force, [&](const Batch& batch) {
    return -batch.chosen_viscosity * dot(batch.normal, difference(batch, v));
  });
}

// c w^2 n n^T for the viscosity c and the corner's weight w.
void AltitudeSprings::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  if (tets_.empty()) return;
  const auto fill = [&](auto&& products) {
    fill_forces([&](Batch& batch) {
      const PackVector part = batch.chosen_viscosity * products(batch.normal);
      return [&batch, part](std::size_t i) { return (batch.weight[i] * batch.weight[i]) * part; };
    });
  };
  fill([](const PackVector& n) { return PackVector{n.x * n.x, n.y * n.y, n.z * n.z}; });
  sums_.for_each(forces_, [&](std::size_t p, const Vec3& sum) { blocks[p].diagonal += sum; });
  fill([](const PackVector& n) { return PackVector{n.y * n.z, n.x * n.z, n.x * n.y}; });
  sums_.for_each(forces_, [&](std::size_t p, const Vec3& sum) { blocks[p].other += sum; });
}

void AltitudeSprings::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  add_forces(force, [&](const Batch& batch) {
    return -batch.chosen_stiffness * dot(batch.normal, difference(batch, dx));
  });
}

double AltitudeSprings::energy(const std::vector<Vec3>& x) const {
  return parallel_reduce(
      batches_.size(), batch_grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t b = begin; b < end; ++b) {
          Batch batch = batches_[b];
          choose(batch, x);
          const Pack stretch = altitude(batch, x).length - batch.chosen_length;
          sum += sum_of_lanes(0.5 * batch.chosen_stiffness * stretch * stretch);
        }
        return sum;
      },
      [](double a, double b) { return a + b; });
}

// No weight of a shortest altitude exceeds 1: its foot lies where the base is the largest of its kind.
void AltitudeSprings::add_stiffness(std::vector<double>& stiffness) const {
  for (std::size_t t = 0; t < tets_.size(); ++t)
    for (const int p : tets_[t])
      stiffness[as_index(p)] +=
          rest_[t].modulus / *std::min_element(rest_[t].length.begin(), rest_[t].length.end());
}

double AltitudeSprings::max_squared_frequency(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (const Tet& tet : tets_) {
    std::array<double, 4> rate;
    for (std::size_t i = 0; i < 4; ++i) rate[i] = squared_rate[as_index(tet[i])];
    std::sort(rate.begin(), rate.end());
    highest = std::max(highest, rate[2] + rate[3]);
  }
  return highest;
}

}  // namespace duet
