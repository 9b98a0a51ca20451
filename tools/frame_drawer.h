// Draws frames in a thread of its own while the simulation goes on, from the files that the simulation wrote.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "tools/report.h"

#include "render/sequence.h"

namespace duet::tools {

class FrameDrawer {
 public:
  // Returns when the renderer is ready; throws what kept it from it. The arguments have to outlive the
  // drawer.
  FrameDrawer(const scene::Scene& scene, const io::Manifest& manifest, const io::RunDirectory& run,
              Report& report);
  ~FrameDrawer();  // drops the frames that wait, after the one in hand
  FrameDrawer(const FrameDrawer&) = delete;
  FrameDrawer& operator=(const FrameDrawer&) = delete;

  // Queues a frame whose mesh is written. Throws what made an earlier frame fail.
  void add(int frame);

  // Waits until all frames are drawn, the program is interrupted, or the time `until` has come and a frame is
  // drawn; frames that wait then are dropped, after the one in hand. Returns whether all are drawn. Throws
  // what made a frame fail.
  bool finish(std::chrono::steady_clock::time_point until);

  // Wall time (s) of drawing a frame, on average; 0 before the first one. For after finish().
  double seconds_per_frame() const { return drawn_ > 0 ? seconds_ / drawn_ : 0; }

 private:
  void work(const scene::Scene& scene, const io::Manifest& manifest);
  void draw_frames(render::SequenceRenderer& renderer);
  void close(bool drop_waiting);

  const io::RunDirectory& run_;
  Report& report_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<int> waiting_;
  bool ready_ = false, closed_ = false, ended_ = false;
  int drawn_ = 0;
  double seconds_ = 0;  // wall time of drawing these
  std::exception_ptr failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace duet::tools
