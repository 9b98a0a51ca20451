// Draws frames in a thread of its own while the simulation goes on, from the files that it has written.
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

// A queue of frames to draw, and the thread that draws them in their order.
class FrameDrawer {
 public:
  // Starts the thread and waits until its renderer is ready. Throws the error of the renderer if it cannot be
  // made. All arguments must outlive the drawer.
  FrameDrawer(const scene::Scene& scene, const io::Manifest& manifest, const io::RunDirectory& run,
              Report& report);
  // Finishes the frame in hand and drops those that wait.
  ~FrameDrawer();
  FrameDrawer(const FrameDrawer&) = delete;
  FrameDrawer& operator=(const FrameDrawer&) = delete;

  // Queues a frame whose mesh has been written. Throws the error of an earlier frame, if one failed.
  void add(int frame);

  // Waits until all queued frames are drawn, the program is interrupted, or the time `until` has come and a
  // frame is drawn; frames that wait then are dropped, after the one in hand. Returns whether all are drawn.
  // Throws the error of a frame, if one failed. Nothing can be added afterwards.
  bool finish(std::chrono::steady_clock::time_point until);

  // Returns the mean wall time (s) of drawing a frame; 0 before the first one. To be called after finish().
  double seconds_per_frame() const { return drawn_ > 0 ? seconds_ / drawn_ : 0; }

 private:
  // Body of the thread: makes the renderer and draws.
  void work(const scene::Scene& scene, const io::Manifest& manifest);
  // Draws queued frames until the queue is closed and empty, or the program is interrupted.
  void draw_frames(render::SequenceRenderer& renderer);
  // Whether frames that wait in a queue that ends are drawn.
  enum class Waiting { are_drawn, are_dropped };
  // Ends the queue.
  void close(Waiting waiting);

  const io::RunDirectory& run_;
  Report& report_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // These members are shared by the threads; `mutex_` protects them.
  std::deque<int> waiting_;
  bool ready_ = false, closed_ = false, ended_ = false;
  int drawn_ = 0;       // frames so far
  double seconds_ = 0;  // wall time of drawing them
  std::exception_ptr failure_;
  std::thread thread_;  // last, because it uses all other members
};

}  // namespace duet::tools
