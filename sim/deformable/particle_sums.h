// Sums over the elements around each particle: what makes forces that are evaluated in parallel, an element
// at a time, the same for any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/base/types.h"

namespace duet {

class ParticleSums {
 public:
  // `particles[k]` is the particle of slot k, or -1 for a slot that counts for none.
  void build(const std::vector<int>& particles, std::size_t particle_count) {
    start_.assign(particle_count + 1, 0);
    for (const int p : particles)
      if (p >= 0) ++start_[static_cast<std::size_t>(p) + 1];
    for (std::size_t p = 0; p < particle_count; ++p) start_[p + 1] += start_[p];
    slot_.resize(start_.back());
    std::vector<std::uint32_t> next = start_;
    for (std::size_t k = 0; k < particles.size(); ++k)
      if (particles[k] >= 0)
        slot_[next[static_cast<std::size_t>(particles[k])]++] = static_cast<std::uint32_t>(k);
  }

  // Adds the values of all slots, Vec3 or Quad, to those of their particles.
  template <class Value>
  void add(const std::vector<Value>& values, std::vector<Vec3>& sums) const {
    for_each(values, [&](std::size_t p, const Value& sum) { sums[p] += Vec3(sum[0], sum[1], sum[2]); });
  }

  // Calls work(particle, sum of its slots' values) for the particles that have slots, in parallel.
  template <class Value, class Work>
  void for_each(const std::vector<Value>& values, Work&& work) const {
    constexpr std::size_t grain = 512;
    parallel_for(start_.size() - 1, grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        if (start_[p] == start_[p + 1]) continue;
        Value sum = values[slot_[start_[p]]];
        for (std::uint32_t k = start_[p] + 1; k < start_[p + 1]; ++k) sum += values[slot_[k]];
        work(p, sum);
      }
    });
  }

 private:
  std::vector<std::uint32_t> start_, slot_;  // slots by particle
};

}  // namespace duet
