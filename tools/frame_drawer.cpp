#include "tools/frame_drawer.h"

#include "tools/interrupt.h"

namespace duet::tools {

FrameDrawer::FrameDrawer(const scene::Scene& scene, const io::Manifest& manifest, const io::RunDirectory& run,
                         Report& report)
    : run_(run), report_(report), thread_([this, &scene, &manifest] { work(scene, manifest); }) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ready_ || failure_; });
  if (!failure_) return;
  lock.unlock();
  thread_.join();
  std::rethrow_exception(failure_);
}

FrameDrawer::~FrameDrawer() {
  close(Waiting::are_dropped);
  if (thread_.joinable()) thread_.join();
}

void FrameDrawer::add(int frame) {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  waiting_.push_back(frame);
  changed_.notify_all();
}

bool FrameDrawer::finish(std::chrono::steady_clock::time_point until) {
  close(Waiting::are_drawn);
  bool in_time = false;
  {
    std::unique_lock lock(mutex_);
    const auto ended = [this] { return ended_; };
    if (until == std::chrono::steady_clock::time_point::max())
      changed_.wait(lock, ended);
    else if (!changed_.wait_until(lock, until, ended))
      changed_.wait(lock, [this] { return ended_ || drawn_ > 0; });
    in_time = ended_ || waiting_.empty();
  }
  if (!in_time) close(Waiting::are_dropped);
  thread_.join();
  if (failure_) std::rethrow_exception(failure_);
  return in_time;
}

void FrameDrawer::close(Waiting waiting) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  if (waiting == Waiting::are_dropped) waiting_.clear();
  changed_.notify_all();
}

// The thread makes the renderer itself, because a renderer belongs to the thread that made it.
void FrameDrawer::work(const scene::Scene& scene, const io::Manifest& manifest) {
  try {
    render::SequenceRenderer renderer(scene, manifest);
    {
      const std::lock_guard lock(mutex_);
      ready_ = true;
      changed_.notify_all();
    }
    draw_frames(renderer);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

void FrameDrawer::draw_frames(render::SequenceRenderer& renderer) {
  while (!interrupted()) {
    int frame = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      frame = waiting_.front();
      waiting_.pop_front();
    }
    const auto begin = std::chrono::steady_clock::now();
    renderer.render_frame(run_, frame);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    report_.drawn(frame, seconds);
    const std::lock_guard lock(mutex_);
    seconds_ += seconds;
    ++drawn_;
    changed_.notify_all();
  }
}

}  // namespace duet::tools
