#include "sim/deformable/incompressibility.h"

#include <algorithm>
#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

// Numbers of tetrahedra and of one-rings in a chunk of a parallel loop.
constexpr std::size_t tet_grain = 1024;
constexpr std::size_t ring_grain = 256;

// Returns the signed volume of a tetrahedron at the positions `x` (m), m^3.
double volume_of(const Tet& tet, const std::vector<Vec3>& x) {
  return tet_volume(x[as_index(tet[0])], x[as_index(tet[1])], x[as_index(tet[2])], x[as_index(tet[3])]);
}

}  // namespace

void NodalVolumes::add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest) {
  DUET_ASSERT(particle_.empty());  // finalize() comes after the last body
  Body body{tets_.size(), tets_.size() + tets.size(), 0};
  rest_volume_.resize(rest.size(), 0);  // by particle until finalize()
  for (const Tet& tet : tets) {
    const double volume = volume_of(tet, rest);
    DUET_ASSERT(volume > 0);
    body.rest_volume += volume;
    for (int p : tet) rest_volume_[as_index(p)] += volume / 4;
  }
  tets_.insert(tets_.end(), tets.begin(), tets.end());
  bodies_.push_back(body);
}

void NodalVolumes::finalize(const std::vector<double>& inverse_mass, const std::vector<Vec3>& rest) {
  DUET_ASSERT(particle_.empty() && inverse_mass.size() == rest.size());
  std::vector<std::vector<int>> tets_of(inverse_mass.size());
  for (std::size_t t = 0; t < tets_.size(); ++t)
    for (int p : tets_[t]) tets_of[as_index(p)].push_back(static_cast<int>(t));
  std::vector<int> ring_of(inverse_mass.size(), -1);
  for (std::size_t p = 0; p < tets_of.size(); ++p) {
    if (tets_of[p].empty()) continue;
    ring_of[p] = static_cast<int>(particle_.size());
    particle_.push_back(static_cast<int>(p));
    rest_volume_[particle_.size() - 1] = rest_volume_[p];
    inverse_mass_.push_back(inverse_mass[p]);
  }
  rest_volume_.resize(size());

  std::vector<int> row;  // particles of the one-ring, ascending
  for (int center : particle_) {
    row_start_.push_back(static_cast<int>(entries_.size()));
    incidence_start_.push_back(static_cast<int>(incidences_.size()));
    row.clear();
    for (int t : tets_of[as_index(center)])
      row.insert(row.end(), tets_[as_index(t)].begin(), tets_[as_index(t)].end());
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    for (int p : row) entries_.push_back({Vec3::Zero(), Vec3::Zero(), ring_of[as_index(p)], p});
    for (int t : tets_of[as_index(center)]) {
      Incidence incidence{t, 0, {}};
      for (int c = 0; c < 4; ++c) {
        const int p = tets_[as_index(t)][as_index(c)];
        if (p == center) incidence.corner = c;
        incidence.entry[as_index(c)] =
            static_cast<int>(std::lower_bound(row.begin(), row.end(), p) - row.begin());
      }
      incidences_.push_back(incidence);
    }
  }
  row_start_.push_back(static_cast<int>(entries_.size()));
  incidence_start_.push_back(static_cast<int>(incidences_.size()));
  volume_.resize(size());
  diagonal_.resize(size());
  tet_gradient_.resize(tets_.size());
  tet_volume_.resize(tets_.size());
  tet_rate_.resize(tets_.size());
  linearize(rest);
  rest_diagonal_ = diagonal_;
}

void NodalVolumes::linearize(const std::vector<Vec3>& x) {
  parallel_for(tets_.size(), tet_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3& origin = x[as_index(tets_[t][0])];
      const Vec3 a = x[as_index(tets_[t][1])] - origin, b = x[as_index(tets_[t][2])] - origin,
                 c = x[as_index(tets_[t][3])] - origin;
      std::array<Vec3, 4>& g = tet_gradient_[t];
      g[1] = b.cross(c) / 24;
      g[2] = c.cross(a) / 24;
      g[3] = a.cross(b) / 24;
      g[0] = -(g[1] + g[2] + g[3]);
      tet_volume_[t] = a.dot(g[1]);
    }
  });
  parallel_for(size(), ring_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Entry* row = entries_.data() + row_start_[i];
      Entry* row_end = entries_.data() + row_start_[i + 1];
      for (Entry* entry = row; entry != row_end; ++entry) {
        entry->divergence.setZero();
        entry->gradient.setZero();
      }
      volume_[i] = 0;
      for (int k = incidence_start_[i]; k < incidence_start_[i + 1]; ++k) {
        const Incidence& incidence = incidences_[as_index(k)];
        const std::array<Vec3, 4>& g = tet_gradient_[as_index(incidence.tet)];
        volume_[i] += tet_volume_[as_index(incidence.tet)];
        for (std::size_t c = 0; c < 4; ++c) {
          row[incidence.entry[c]].divergence += g[c];
          row[incidence.entry[c]].gradient += g[as_index(incidence.corner)];
        }
      }
      diagonal_[i] = 0;
      for (Entry* entry = row; entry != row_end; ++entry)
        diagonal_[i] += inverse_mass_[as_index(entry->ring)] * entry->divergence.squaredNorm();
    }
  });
}

void NodalVolumes::divergence_at(const std::vector<Vec3>& x, const std::vector<Vec3>& v,
                                 std::vector<double>& rate) {
  DUET_ASSERT(x.size() == v.size());
  parallel_for(tets_.size(), tet_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto edges = [&](const std::vector<Vec3>& values) {
        const Vec3& origin = values[as_index(tets_[t][0])];
        return std::array<Vec3, 3>{values[as_index(tets_[t][1])] - origin,
                                   values[as_index(tets_[t][2])] - origin,
                                   values[as_index(tets_[t][3])] - origin};
      };
      const auto [a, b, c] = edges(x);
      const auto [da, db, dc] = edges(v);
      tet_rate_[t] = (da.dot(b.cross(c)) + db.dot(c.cross(a)) + dc.dot(a.cross(b))) / 24;
    }
  });
  rate.resize(size());
  parallel_for(size(), ring_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      rate[i] = 0;
      for (int k = incidence_start_[i]; k < incidence_start_[i + 1]; ++k)
        rate[i] += tet_rate_[as_index(incidences_[as_index(k)].tet)];
    }
  });
}

void NodalVolumes::divergence(const std::vector<Vec3>& v, std::vector<double>& rate) const {
  rate.resize(size());
  parallel_for(size(), ring_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (int k = row_start_[i]; k < row_start_[i + 1]; ++k)
        sum += entries_[as_index(k)].divergence.dot(v[as_index(entries_[as_index(k)].particle)]);
      rate[i] = sum;
    }
  });
}

Vec3 NodalVolumes::impulse_on(std::size_t ring, const std::vector<double>& q) const {
  Vec3 sum = Vec3::Zero();
  for (int k = row_start_[ring]; k < row_start_[ring + 1]; ++k)
    sum += q[as_index(entries_[as_index(k)].ring)] * entries_[as_index(k)].gradient;
  return sum;
}

void NodalVolumes::pressure_velocity(const std::vector<double>& q, std::vector<Vec3>& v) const {
  DUET_ASSERT(q.size() == size());
  parallel_for(size(), ring_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) v[as_index(particle_[i])] = inverse_mass_[i] * impulse_on(i, q);
  });
}

void NodalVolumes::impulses_on_held(const std::vector<double>& q, std::vector<Vec3>& impulse) const {
  DUET_ASSERT(q.size() == size());
  parallel_for(size(), ring_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (inverse_mass_[i] == 0) impulse[as_index(particle_[i])] = impulse_on(i, q);
  });
}

double NodalVolumes::volume_error(const std::vector<Vec3>& x) const {
  double largest = 0;
  for (const Body& body : bodies_) {
    double volume = 0;
    for (std::size_t t = body.first_tet; t < body.end_tet; ++t) volume += volume_of(tets_[t], x);
    largest = std::max(largest, std::abs(volume / body.rest_volume - 1));
  }
  return largest;
}

}  // namespace duet
