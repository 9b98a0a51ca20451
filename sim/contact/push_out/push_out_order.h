// In which order step IV.2 takes its central bodies.
#pragma once

namespace duet {

enum class PushOutOrder {
  together,      // all at once
  levels,        // those of one level of the contact graph after the other
  frozen_levels  // the same, and what rests on something is held once its level is done
};

}  // namespace duet
