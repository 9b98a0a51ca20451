#include "sim/deformable/forces/altitude_springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace duet {
namespace {

// Number of the first altitude that is between edges.
constexpr std::size_t first_between_edges = 4;

// Corners in the order in which altitude() takes them: a vertex and its opposite face, counter-clockwise as
// seen from the vertex, or two opposite edges. All altitudes of a tetrahedron of positive volume are
// positive.
constexpr std::array<std::array<std::size_t, 4>, 7> corners = {
    {{0, 1, 3, 2}, {1, 0, 2, 3}, {2, 0, 3, 1}, {3, 0, 1, 2}, {0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}}};

// Returns a normal vector: its length is twice the area of the face, or the area that the two edges span.
vector8 base(std::size_t altitude, const std::array<vector8, 4>& x) {
  const auto& c = corners[altitude];
  return altitude < first_between_edges ? cross(x[c[2]] - x[c[1]], x[c[3]] - x[c[1]])
                                        : cross(x[c[1]] - x[c[0]], x[c[3]] - x[c[2]]);
}

// Returns sum w_i^2 / m_i (1/kg) of an altitude whose ends are in the middle of the face or of the edges.
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
    std::array<Vec3, 4> corner;
    std::array<vector8, 4> x;
    for (std::size_t i = 0; i < 4; ++i) {
      corner[i] = rest[as_index(tet[i])];
      x[i] = {double8{} + corner[i].x(), double8{} + corner[i].y(), double8{} + corner[i].z()};
    }
    RestTet entry{{}, modulus, damping};
    const double volume = tet_volume(corner[0], corner[1], corner[2], corner[3]);
    for (std::size_t a = 0; a < altitudes; ++a) {
      const vector8 here = base(a, x);
      entry.length[a] = 6 * volume / std::sqrt(dot(here, here)[0]);
    }
    tets_.push_back(tet);
    rest_.push_back(entry);
  }
}

void AltitudeSprings::finalize(const std::vector<double>& inverse_mass) {
  batches_.resize((tets_.size() + pack_width - 1) / pack_width);
  for (std::size_t slot = 0; slot < batches_.size() * pack_width; ++slot) {
    Batch& batch = batches_[slot / pack_width];
    const std::size_t lane = slot % pack_width;
    const std::size_t element = ScatterAdd::element_of(slot / pack_width, lane, batches_.size());
    const bool pads = element >= tets_.size();
    const std::size_t t = pads ? tets_.size() - 1 : element;
    std::array<double, 4> inverse;
    for (std::size_t i = 0; i < 4; ++i) {
      batch.particle[i][lane] = tets_[t][i];
      inverse[i] = inverse_mass[as_index(tets_[t][i])];
    }
    batch.modulus[lane] = pads ? 0 : rest_[t].modulus;
    for (std::size_t a = 0; a < altitudes; ++a) {
      const double stiffness = rest_[t].modulus / rest_[t].length[a], mobility = inverse_mass_of(a, inverse);
      batch.rest_length[a][lane] = rest_[t].length[a];
      batch.viscosity[a][lane] =
          pads || mobility <= 0 ? 0 : 2 * rest_[t].damping * std::sqrt(stiffness / mobility);
    }
  }
  chosen_.resize(batches_.size());
  dashpots_.resize(batches_.size());
  sums_.build(batches_, inverse_mass.size());
}

double8 AltitudeSprings::choose(const Batch& batch, const std::array<vector8, 4>& corner, Chosen& chosen) {
  double8 largest{};
  double8 best{};  // number of that altitude
  for (std::size_t a = 0; a < altitudes; ++a) {
    const vector8 here = base(a, corner);
    const double8 squared = dot(here, here);
    const mask8 larger = squared > largest;
    largest = select(larger, squared, largest);
    best = select(larger, double8{} + static_cast<double>(a), best);
  }
  if (!any_of(best < chosen.altitude) && !any_of(chosen.altitude < best)) return largest;
  chosen.altitude = best;
  chosen.between_edges = best >= static_cast<double>(first_between_edges);
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    const auto a = static_cast<std::size_t>(best[lane]);
    chosen.rest_length[lane] = batch.rest_length[a][lane];
    chosen.viscosity[lane] = batch.viscosity[a][lane];
    for (std::size_t i = 0; i < 4; ++i) chosen.slot[i][lane] = batch.slot[corners[a][i]][lane];
  }
  chosen.stiffness = batch.modulus / chosen.rest_length;
  return largest;
}

void AltitudeSprings::choose(const std::vector<Vec3>& x) {
  sums_.visit(x, [&](std::size_t b, const double4* rows) {
    fetch_ahead(b + batches_ahead, batches_, chosen_);
    std::array<vector8, 4> corner;
    for (std::size_t i = 0; i < 4; ++i) corner[i] = ScatterAdd::gather(rows, batches_[b].slot[i]);
    choose(batches_[b], corner, chosen_[b]);
  });
}

// The end of the altitude divides the face by the barycentric coordinates (1 - a - b, a, b), or the two edges
// by -a and b.
AltitudeSprings::Altitude AltitudeSprings::altitude(const Chosen& chosen, const double4* rows) {
  std::array<vector8, 4> corner;
  for (std::size_t i = 0; i < 4; ++i) corner[i] = ScatterAdd::gather(rows, chosen.slot[i]);
  const mask8& edges = chosen.between_edges;
  const vector8 e = select(edges, corner[1] - corner[0], corner[2] - corner[1]);
  const vector8 f = corner[3] - select(edges, corner[2], corner[1]);
  const vector8 r = corner[0] - select(edges, corner[2], corner[1]);
  const vector8 N = cross(e, f);
  const double8 squared = dot(N, N);
  const mask8 exists = squared > double8{} + std::numeric_limits<double>::min();
  const double8 inverse = select(exists, 1.0 / select(exists, squared, double8{} + 1.0), double8{});
  const double8 a = inverse * dot(cross(r, f), N), b = inverse * dot(cross(e, r), N);
  Altitude result;
  result.normal = sqrt_of(inverse) * N;
  result.length = dot(r, result.normal);
  result.weight = {select(edges, 1.0 + a, double8{} + 1.0), select(edges, -a, a + b - 1.0),
                   select(edges, b - 1.0, -a), -b};
  return result;
}

vector8 AltitudeSprings::difference(const Chosen& chosen, const double4* rows) {
  vector8 sum = chosen.weight[0] * ScatterAdd::gather(rows, chosen.slot[0]);
  for (std::size_t i = 1; i < 4; ++i) sum = sum + chosen.weight[i] * ScatterAdd::gather(rows, chosen.slot[i]);
  return sum;
}

// The force is distributed to the corners by the weights.
template <class Force>
auto AltitudeSprings::forces_along(Force force_of) const {
  return [this, force_of](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, chosen_);
    const Chosen& chosen = chosen_[b];
    const double8 force = force_of(chosen, rows);
    for (std::size_t i = 0; i < 4; ++i)
      ScatterAdd::spread(chosen.slot[i], (force * chosen.weight[i]) * chosen.normal, double8{}, sums);
  };
}

template <class Force>
void AltitudeSprings::add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals,
                                 Force&& force_of) {
  sums_.fill_from(values, forces_along(force_of));
  sums_.add_to(totals);
}

auto AltitudeSprings::turn_force(double seconds) {
  return [seconds](const Chosen& chosen, const double4* rows) {
    const double8 rate = turn_rate(chosen.normal, chosen.length, difference(chosen, rows), seconds);
    return -chosen.viscosity * select(chosen.length < double8{}, -rate, rate);
  };
}

void AltitudeSprings::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                                         std::vector<double>& geometric_stiffness, const Turn* turn) {
  const auto elastic = [&](std::size_t b, const double4* rows, double4* sums) {
    fetch_ahead(b + batches_ahead, chosen_, dashpots_);
    Chosen& chosen = chosen_[b];
    const Altitude now = altitude(chosen, rows);
    chosen.weight = now.weight;
    chosen.normal = now.normal;
    chosen.length = now.length;
    dashpots_[b].set(chosen.slot, chosen.weight, chosen.viscosity, chosen.normal);
    const double8 along = chosen.stiffness * (chosen.rest_length - now.length);
    const double8 side = abs_of(along) / max_of(abs_of(now.length), chosen.rest_length);
    for (std::size_t i = 0; i < 4; ++i)
      ScatterAdd::spread(chosen.slot[i], (along * chosen.weight[i]) * chosen.normal,
                         abs_of(chosen.weight[i]) * side, sums);
  };
  if (turn)
    sums_.fill_both_from(x, elastic, turn->v, forces_along(turn_force(turn->seconds)));
  else
    sums_.fill_from(x, elastic);
  sums_.add_to(force, geometric_stiffness);
}

void AltitudeSprings::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  add_forces(v, force, [](const Chosen& chosen, const double4* rows) {
    return -chosen.viscosity * dot(chosen.normal, difference(chosen, rows));
  });
}

void AltitudeSprings::add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force) {
  add_forces(v, force, turn_force(seconds));
}

// The block of a corner is c w^2 n n^T, with the viscosity c, its weight w and the direction n of the
// altitude.
void AltitudeSprings::add_damping_blocks(std::vector<SymmetricBlock>& blocks) {
  add_blocks(sums_, blocks, [&](std::size_t b, double4* sums) {
    fetch_ahead(b + batches_ahead, chosen_);
    const Chosen& chosen = chosen_[b];
    for (std::size_t i = 0; i < 4; ++i)
      spread_square(chosen.slot[i], chosen.viscosity * chosen.weight[i] * chosen.weight[i], chosen.normal,
                    sums);
  });
}

void AltitudeSprings::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  add_forces(dx, force, [](const Chosen& chosen, const double4* rows) {
    return -chosen.stiffness * dot(chosen.normal, difference(chosen, rows));
  });
}

void AltitudeSprings::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  for (std::size_t b = 0; b < batches_.size(); ++b)
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      const Chosen& chosen = chosen_[b];
      const auto& order = corners[static_cast<std::size_t>(chosen.altitude[lane])];
      const Vec3 n(chosen.normal.x[lane], chosen.normal.y[lane], chosen.normal.z[lane]);
      const Mat3 along =
          (factors.damping * chosen.viscosity[lane] + factors.elasticity * chosen.stiffness[lane]) * n *
          n.transpose();
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j <= i; ++j)
          append_block(batches_[b].particle[order[i]][lane], batches_[b].particle[order[j]][lane],
                       chosen.weight[i][lane] * chosen.weight[j][lane] * along, blocks);
    }
}

double AltitudeSprings::energy(const std::vector<Vec3>& x) const {
  return parallel_sum(batches_.size(), ScatterAdd::batches_of_block, [&](std::size_t b, double& sum) {
    std::array<vector8, 4> corner;
    for (std::size_t i = 0; i < 4; ++i) corner[i] = gather(x, batches_[b].particle[i]);
    Chosen chosen;
    const double8 largest = sqrt_of(choose(batches_[b], corner, chosen));
    const double8 six_volumes =
        dot(corner[1] - corner[0], cross(corner[2] - corner[0], corner[3] - corner[0]));
    const mask8 exists = largest > double8{};
    const double8 length = select(exists, six_volumes / select(exists, largest, double8{} + 1.0), double8{});
    const double8 stretch = length - chosen.rest_length;
    sum += sum_of_lanes(0.5 * chosen.stiffness * stretch * stretch);
  });
}

// No weight of a shortest altitude exceeds 1: its ends lie where the base is the largest of its kind.
void AltitudeSprings::add_stiffness_of(std::size_t t, std::vector<double>& stiffness) const {
  const double shortest = *std::min_element(rest_[t].length.begin(), rest_[t].length.end());
  for (const int p : tets_[t]) stiffness[as_index(p)] += rest_[t].modulus / shortest;
}

void AltitudeSprings::add_stiffness(std::vector<double>& stiffness) const {
  for (std::size_t t = 0; t < tets_.size(); ++t) add_stiffness_of(t, stiffness);
}

// The weights of each end add up to 1, so the bound is the sum of the two highest rates.
double AltitudeSprings::omega_squared(std::size_t t, const std::vector<double>& squared_rate) const {
  std::array<double, 4> rate;
  for (std::size_t i = 0; i < 4; ++i) rate[i] = squared_rate[as_index(tets_[t][i])];
  std::sort(rate.begin(), rate.end());
  return rate[2] + rate[3];
}

double AltitudeSprings::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (std::size_t t = 0; t < tets_.size(); ++t) highest = std::max(highest, omega_squared(t, squared_rate));
  return highest;
}

// The shortest damping time of a tetrahedron's altitudes counts, because any of them may carry the spring.
double AltitudeSprings::rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                                        std::vector<double>& undamped_stiffness) const {
  double highest = 0;
  for (std::size_t b = 0; b < batches_.size(); ++b)
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      const std::size_t t = ScatterAdd::element_of(b, lane, batches_.size());
      if (t >= tets_.size()) continue;
      double shortest = std::numeric_limits<double>::infinity();  // s, damping time
      for (std::size_t a = 0; a < altitudes; ++a)
        shortest = std::min(shortest, batches_[b].viscosity[a][lane] * rest_[t].length[a] / rest_[t].modulus);
      const double relaxed = relaxed_omega_squared(relaxation * shortest);
      if (relaxed < omega_squared(t, squared_rate))
        highest = std::max(highest, relaxed);
      else
        add_stiffness_of(t, undamped_stiffness);
    }
  return highest;
}

}  // namespace duet
