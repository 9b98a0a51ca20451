// The two directions of a pair of rigid bodies.
#pragma once

namespace duet {

/// The two directions in which the points of one rigid body are tested against another one.
enum class PairDirection {
  as_found,  ///< Host and guest are those of the pair that the broad phase found.
  reversed   ///< The roles of host and guest are swapped.
};

}  // namespace duet
