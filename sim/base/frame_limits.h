// Limits on the number of frames and the frame rate that a scene, a run or the command line may ask for.
#pragma once

namespace duet {

/// The largest frame number: 11.6 hours at 24 frames per second.
inline constexpr int max_frames = 1'000'000;
/// The lowest frame rate, 1/s: frames of 1000 s.
inline constexpr double min_fps = 1e-3;
/// The highest frame rate, 1/s: frames of 0.1 ms.
inline constexpr double max_fps = 1e4;

}  // namespace duet
