// Prefabs of another size. Works on the document, before the reader sees it. Internal to the reader: includes
// toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

// Multiplies all lengths of a body or joint, whatever table of it they are in, by `scale`, and its mass by
// the third power, so that densities stay.
void scale_lengths(toml::table& element, double scale);

}  // namespace duet::scene
