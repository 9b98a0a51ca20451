// How far the elements of deformable surfaces travel: two that were some distance apart have not met as long
// as they have not travelled so far together.
#pragma once

#include <utility>
#include <vector>

#include "sim/deformable/collision_surface.h"

namespace duet {

// Travels are added up in frames that do not turn, so that what moves as a whole does not travel: in that of
// the mean of the body, for pairs of elements of one body, and in one that all share, for pairs of two.
//
// The shared frame moves on along each axis as the bodies that hold half of the particles do (their weighted
// median): it is at rest where most of the bodies are, and falls along where most of them fall. The mean
// would have everything at rest travel because of a few that fall.
//
// Elements are numbered: points first, then edges, then triangles.
class SurfaceTravel {
 public:
  struct Way {             // m, since begin()
    double before = 0;     // to the start of the motion that is looked at
    double including = 0;  // the farthest that it leads
  };

  // All ways are 0 at `start`.
  void begin(const CollisionSurface& surface, const std::vector<Vec3>& start);
  // To be called whenever the particles move on straight lines from `start` to `end`; the next motion need
  // not start where this one ended.
  void add(const CollisionSurface& surface, const std::vector<Vec3>& start, const std::vector<Vec3>& end);

  // Of an element within its body, and in the shared frame: at most so far.
  const Way& within_body(std::size_t element) const { return within_body_[element]; }
  const Way& shared(std::size_t element) const { return shared_[element]; }
  // No element's way (within this body) has grown or grows by more than this one.
  const Way& longest_within(std::size_t body) const { return longest_within_[body]; }
  const Way& longest() const { return longest_; }

  // m, how far the shared frame has moved at the start and the end of the motion.
  const Vec3& frame_start() const { return frame_start_; }
  const Vec3& frame_end() const { return frame_end_; }
  // m, how far the particle (of the body) has travelled in the shared frame since the last motion: at most.
  double pace(std::size_t particle, std::size_t body) const {
    return stretch_[particle] + body_stretch_[body];
  }

 private:
  void move_frame(const CollisionSurface& surface, const std::vector<Vec3>& start,
                  const std::vector<Vec3>& end);
  Vec3 median_change(const std::vector<Vec3>& from, const std::vector<Vec3>& to);
  void add_particles(const CollisionSurface& surface, const std::vector<Vec3>& start,
                     const std::vector<Vec3>& end);
  template <std::size_t N>
  void add_elements(const std::vector<std::array<int, N>>& corners, const std::vector<int>& body_of,
                    std::size_t first);

  std::vector<double> count_;                       // of the bodies' particles
  std::vector<Vec3> mean_, mean_start_, mean_end_;  // m, of the bodies: at the last start, now
  std::vector<std::pair<double, double>> changes_;  // m, of the bodies' means along an axis, and counts
  Vec3 frame_start_ = Vec3::Zero(), frame_end_ = Vec3::Zero();
  std::vector<Vec3> last_;                 // m, the particles from their bodies' means, at the last start
  std::vector<double> stretch_, further_;  // m, of the particles: since the last start, and to the end
  std::vector<double> body_stretch_, body_further_;  // m, of the bodies' means in the shared frame
  std::vector<Way> body_way_, longest_within_;
  std::vector<Way> within_body_, shared_;  // of all elements
  Way longest_;
};

}  // namespace duet
