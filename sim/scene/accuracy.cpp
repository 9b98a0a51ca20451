#include "sim/scene/accuracy.h"

namespace duet::scene {
namespace {

// The table is written by tools/studies.
constexpr PresetStudy studies[] = {
#include "sim/scene/accuracy_studies.inc"
};

}  // namespace

std::span<const PresetStudy> preset_studies() { return studies; }

}  // namespace duet::scene
