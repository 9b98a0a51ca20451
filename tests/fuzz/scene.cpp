// Scene files: any text is a scene or a SceneError. A scene that is accepted can be planned, and its document
// with an override is accepted again.
#include "tests/fuzz/harness.h"

#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  const bool accepted = fuzz::is_accepted([&] {
    static_cast<void>(
        scene::plan_effects(scene::read_text(text, "fuzz.toml", {}, scene::Meshes::leave).scene));
  });
  if (!accepted) return 0;
  const auto changed = scene::read_text(text, "fuzz.toml", {"render.width=641"}, scene::Meshes::leave);
  scene::read_text(changed.source, "again.toml", {}, scene::Meshes::leave);
  return 0;
}
