#include "tools/run_totals.h"

#include <algorithm>

#include <fmt/format.h>

namespace duet::tools {

void RunTotals::add(const FrameStats& stats) {
  ++frames_;
  substeps_ += stats.substeps;
  seconds_ += stats.seconds;
  start_with(stats);
}

void RunTotals::start_with(const FrameStats& stats) {
  penetration_ = std::max(penetration_, stats.max_penetration);
  if (!stats.drawn_overlap || (drawn_ && stats.drawn_overlap->depth <= drawn_->depth)) return;
  drawn_ = stats.drawn_overlap;
  drawn_frame_ = stats.frame;
}

std::string RunTotals::text() const {
  if (frames_ == 0) return {};
  std::string text =
      fmt::format("; {:.1f} substeps and {:.3g} s of simulation a frame, penetration at most {:.2g} m",
                  static_cast<double>(substeps_) / frames_, seconds_ / frames_, penetration_);
  if (!drawn_) return text;
  if (drawn_->depth == 0) return text + "; drawn surfaces lie in no other body";
  return text + fmt::format("; drawn surface of `{}` at most {:.2g} m deep in `{}` (frame {})", drawn_->guest,
                            drawn_->depth, drawn_->host, drawn_frame_);
}

}  // namespace duet::tools
