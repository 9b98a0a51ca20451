// How deep bodies overlap, as every frame's statistics say.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

// The deepest overlap of any point with any body now, m, >= 0.
double max_penetration(const Bodies& bodies, const CandidateFilter& filter);

}  // namespace duet
