// Repetition, prefabs and their instances: what a scene file says once and means many times. Works on the
// document, before the reader sees it. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

// Replaces every table of [[rigid]], [[deformable]] and [[joints]] that has a `repeat` by its copies, and
// every one of [[instances]] by the bodies and joints of its prefab, with names of their own; removes
// `prefabs` and `instances`. Reports what is wrong with them.
void expand(toml::table& document, Problems& problems);

}  // namespace duet::scene
