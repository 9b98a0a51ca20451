// Set of particles that a pass over elements is restricted to.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "sim/base/assert.h"

namespace duet {

/// Set of particles, kept in chunks of successive indices: a chunk is either in the set or not.
class ParticleMask {
 public:
  /// Number of particles in a chunk; also the grain of the parallel loops over particles that use masks.
  static constexpr std::size_t chunk = 512;

  /// Makes the mask one of `particles` particles that holds all of them.
  void assign_all(std::size_t particles) { chunks_.assign((particles + chunk - 1) / chunk, true); }
  /// Makes the mask one of `particles` particles that holds none of them.
  void assign_none(std::size_t particles) { chunks_.assign((particles + chunk - 1) / chunk, false); }
  /// Makes the mask one of no particles: has() must not be called before the next assign_all() or
  /// assign_none().
  void clear() { chunks_.clear(); }
  /// Adds the chunks of the particles [begin, end).
  void add(std::size_t begin, std::size_t end) {
    for (std::size_t c = begin / chunk; c * chunk < end; ++c) chunks_[c] = true;
  }
  /// Returns whether the particle's chunk is in the set.
  bool has(std::size_t particle) const { return chunks_[particle / chunk]; }
  /// Returns whether chunk number `c` is in the set.
  bool has_chunk(std::size_t c) const { return chunks_[c]; }
  /// Returns the number of chunks, in the set or not.
  std::size_t chunks() const { return chunks_.size(); }
  /// Removes the chunks that are in `others` from this set, then adds the chunks that remain here to
  /// `others`.
  void take_new(ParticleMask& others) {
    others.chunks_.resize(chunks_.size(), false);
    for (std::size_t c = 0; c < chunks_.size(); ++c) {
      const bool known = others.chunks_[c];
      others.chunks_[c] = known || chunks_[c];
      chunks_[c] = chunks_[c] && !known;
    }
  }
  /// Returns whether a chunk of the particles [first, last], both included, is in the set.
  bool meets(std::size_t first, std::size_t last) const {
    DUET_ASSERT(first <= last);
    for (std::size_t c = first / chunk; c <= last / chunk; ++c)
      if (chunks_[c]) return true;
    return false;
  }

 private:
  std::vector<char> chunks_;
};

}  // namespace duet
