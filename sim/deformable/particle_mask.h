// Which particles a pass over elements is for.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace duet {

// Chunks of particles are in or out as wholes.
class ParticleMask {
 public:
  static constexpr std::size_t chunk = 512;

  void assign(std::size_t particles, bool in) { chunks_.assign((particles + chunk - 1) / chunk, in); }
  void clear() { chunks_.clear(); }  // of no particles
  // Takes in the chunks of the particles [begin, end).
  void add(std::size_t begin, std::size_t end) {
    for (std::size_t c = begin / chunk; c * chunk < end; ++c) chunks_[c] = true;
  }
  bool has(std::size_t particle) const { return chunks_[particle / chunk]; }
  bool has_chunk(std::size_t c) const { return chunks_[c]; }
  std::size_t chunks() const { return chunks_.size(); }
  // Takes out the chunks that `others` has, and gives these the ones that are left here.
  void take_new(ParticleMask& others) {
    others.chunks_.resize(chunks_.size(), false);
    for (std::size_t c = 0; c < chunks_.size(); ++c) {
      const bool known = others.chunks_[c];
      others.chunks_[c] = known || chunks_[c];
      chunks_[c] = chunks_[c] && !known;
    }
  }
  // Whether a chunk of the particles [first, last] is in.
  bool meets(std::size_t first, std::size_t last) const {
    for (std::size_t c = first / chunk; c <= last / chunk; ++c)
      if (chunks_[c]) return true;
    return false;
  }

 private:
  std::vector<char> chunks_;
};

}  // namespace duet
