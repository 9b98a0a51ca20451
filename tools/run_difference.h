// Explains why a run cannot be continued with a scene, by what differs between the two.
#pragma once

#include <string>

#include "tools/commands.h"

#include "sim/io/run_directory.h"

namespace duet::tools {

/// Returns a phrase about how a scene differs from the one that a run was made of: "`frames` is 9 and was 4".
/// `choice` and `read` are the scene as chosen and as read. The text is empty if no difference is found, or
/// if the run has no whole copy of its scene.
std::string difference_from_run(const io::RunDirectory& run, const SceneChoice& choice,
                                const scene::ReadResult& read);

}  // namespace duet::tools
