// What sharp edges press into soft bodies: contact bears the load, not push-out.
#include <memory>

#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/geometry/mesh_check.h"
#include "sim/geometry/mesh_file.h"
#include "sim/step/world.h"

namespace duet {
namespace {

// A ring of a mesh lies on a soft box. Beside its rims the level set's value grows by less than the way along
// its gradient; taken for a distance, contact would let the box in by a third of a millimetre in every step,
// and push-out would press it back, for ever and at 4 J a frame. What contact leaves to it is the tolerance.
TEST(EdgesInSoftBodies, AreBorneByContact) {
  const double mass = 2000;
  scene::Scene scene = test::on_ground(0.6);
  scene.fps = 24;
  test::add_soft_box(scene, "box", Vec3(0, 0.5, 0), Vec3(2, 1, 2), 4, 2e5).shape.cells = Vec3i(8, 4, 8);
  scene.materials[0].poisson_ratio = 0.3;
  scene.materials[0].damping = 0.05;
  const auto mesh = std::make_shared<TriangleMesh>(read_mesh(DUET_SOURCE_DIR "/assets/ring.obj"));
  ASSERT_TRUE(repair(*mesh).flaws.empty());
  scene::RigidBody ring;
  ring.name = "ring";
  ring.shape.kind = scene::ShapeKind::mesh;
  ring.shape.mesh = mesh;
  ring.shape.scale = 0.3;
  ring.mass = mass;
  ring.friction = 0.6;
  ring.placement.position = Vec3(0, 1.17, 0);
  scene.rigid.push_back(ring);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  double most = 0;
  for (int frame = 1; frame <= 36; ++frame) {
    simulation.advance_frame();
    if (frame <= 20) continue;  // until it lies still
    const FrameStats stats = simulation.stats();
    ASSERT_GT(stats.contacts, 50);
    for (const LedgerStats& stage : stats.ledger)
      if (stage.name == stage_names[static_cast<std::size_t>(Stage::push_out)])
        most = std::max(most, std::abs(stage.stored) / stats.substeps);
  }
  EXPECT_GT(most, 0) << "nothing was measured";
  test::expect_below(most / (mass * 9.8), 1e-6, "push-out's work in a step over the ring's weight, m");
}

}  // namespace
}  // namespace duet
