// Expands repetitions, and prefabs by their instances, which a scene file says once and means many times.
// Works on the document, before the reader sees it. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

/// Replaces every table of [[rigid]], [[deformable]] and [[joints]] that has a `repeat` by its copies, and
/// every table of [[instances]] by the bodies and joints of its prefab, with unique names. Replaces texts
/// "$name" by the values of parameters. Removes `prefabs`, `instances` and `parameters`. Reports flaws to
/// `problems`.
void expand(toml::table& document, Problems& problems);

}  // namespace duet::scene
