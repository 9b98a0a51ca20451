#include "sim/base/rotation.h"

namespace duet {

Quat shortest_turn(const Vec3& from, const Vec3& to) { return Quat::FromTwoVectors(from, to); }

}  // namespace duet
