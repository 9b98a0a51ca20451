// Scales the copies of prefabs. Works on the document, before the reader sees it. Internal to the reader:
// includes toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

/// Multiplies all lengths of a body or joint by `scale`, in whichever inner table they are, and its mass by
/// scale^3, so that the density stays. Lengths that are not given keep their defaults, except the scale of a
/// mesh.
void scale_lengths(toml::table& element, double scale);

}  // namespace duet::scene
