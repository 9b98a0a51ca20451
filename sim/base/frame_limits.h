// How many frames a scene, a run and the command line may ask for, and how long a frame may be.
#pragma once

namespace duet {

inline constexpr int most_frames = 1'000'000;  ///< the largest number of a frame: ten hours at 24 frames/s
inline constexpr double least_fps = 1e-3;      ///< 1/s, frames of a thousand seconds
inline constexpr double most_fps = 1e4;        ///< 1/s

}  // namespace duet
