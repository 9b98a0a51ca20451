// Skins in contact: forces on their vertices are distributed to the tetrahedra around them, without loss of
// momentum.
#include <algorithm>
#include <map>
#include <memory>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/step/world.h"

namespace duet::skin_contact_test {
namespace {

// Returns the surface of a ball: an octahedron that is split `splits` times.
std::shared_ptr<const TriangleMesh> ball_mesh(double radius, int splits) {
  TriangleMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<int, int>, int> middle;
    const auto between = [&](int a, int b) {
      const auto [at, is_new] = middle.emplace(std::minmax(a, b), static_cast<int>(mesh.positions.size()));
      if (is_new)
        mesh.positions.push_back(
            (mesh.positions[static_cast<std::size_t>(a)] + mesh.positions[static_cast<std::size_t>(b)])
                .normalized());
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangles) {
      const int a = between(t[0], t[1]), b = between(t[1], t[2]), c = between(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& v : mesh.positions) v *= radius;
  return std::make_shared<const TriangleMesh>(std::move(mesh));
}

// Adds a ball of 0.4 m inside a box of 1 m that consists of 2 x 2 x 2 cells. With `contact`, only the ball
// can be touched.
scene::DeformableBody& add_ball_in_box(scene::Scene& scene, const Vec3& position, bool contact) {
  scene::DeformableBody& body = test::add_soft_box(scene, "soft", position, Vec3(1, 1, 1), 2, 1e5);
  body.skin.emplace();
  body.skin->mesh_file = "ball.obj";
  body.skin->mesh = ball_mesh(0.4, 3);
  body.skin->contact = contact;
  return body;
}

// Returns the smallest y (m).
double lowest(const std::vector<Vec3>& positions) {
  double y = 1e9;
  for (const Vec3& x : positions) y = std::min(y, x.y());
  return y;
}

// With contact at the skin the skin rests on the ground, otherwise the tetrahedra do, to 1 mm.
TEST(SkinContact, ABodyRestsOnItsSkin) {
  for (const bool contact : {true, false}) {
    scene::Scene scene = test::on_ground();
    add_ball_in_box(scene, Vec3(0, 0.6, 0), contact);
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 36; ++frame) simulation.advance_frame();
    std::vector<BodySurface> surfaces;
    simulation.surfaces(surfaces);
    const double skin = lowest(surfaces.front().surface.positions);
    double tets = 1e9;
    for (const Vec3& x : simulation.world().bodies.particles.x) tets = std::min(tets, x.y());
    if (contact) {
      EXPECT_NEAR(skin, 0, 1e-3);
      // The corners of the box hang beside the ball, below the ground on which it rests.
      EXPECT_LT(tets, -0.05);
    } else {
      EXPECT_NEAR(tets, 0, 1e-3);
      EXPECT_GT(skin, 0.05);
    }
  }
}

// A skin of 0.6 m reaches 0.1 m out of each face of its box and falls on the ground at 2 m/s: it is found
// before it gets there, and not when the box comes near.
TEST(SkinContact, ASkinBeyondItsTetrahedraIsFoundInTime) {
  scene::Scene scene = test::on_ground();
  add_ball_in_box(scene, Vec3(0, 0.8, 0), true).skin->mesh = ball_mesh(0.6, 1);
  Simulation simulation(scene, test::plan(scene));
  double deepest = 0;
  for (int frame = 0; frame < 12; ++frame) {
    simulation.advance_frame();
    deepest = std::max(deepest, simulation.stats().max_penetration);
  }
  test::expect_below(deepest, 1e-6, "depth of the skin in the ground (m)");
}

// Adds a ball of 0.4 m inside a box of 1 m of `cells`^3 cells that holds a bone of radius `bone` (m).
scene::DeformableBody& add_ball_with_bone(scene::Scene& scene, const Vec3& position, int cells, double bone) {
  test::add_ball(scene, "bone", position, bone, 100);
  scene::DeformableBody& body = add_ball_in_box(scene, position, true);
  body.shape.cells = Vec3i::Constant(cells);
  body.attach = {"bone"};
  return body;
}

// A bone of 0.15 m holds the middle of the flesh, two layers of tetrahedra away from the skin. The skin rests
// on the ground as without a bone, and the bone, which nothing else holds up, stays in the middle: gravity
// compresses flesh of 1e5 Pa by some 1000 kg/m^3 g 0.4 m / 1e5 Pa = 4 % of its height of 0.4 m below the
// bone.
TEST(SkinContact, ABodyWithABoneRestsOnItsSkin) {
  scene::Scene scene = test::on_ground();
  add_ball_with_bone(scene, Vec3(0, 0.45, 0), 8, 0.15);
  Simulation simulation(scene, test::plan(scene));
  ASSERT_GE(simulation.world().bodies.bound.size(), 7U);
  for (int frame = 0; frame < 36; ++frame) simulation.advance_frame();
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  EXPECT_NEAR(lowest(surfaces[1].surface.positions), 0, 1e-3);
  EXPECT_FALSE(simulation.stats().drawn_overlap) << "what is drawn touches";
  EXPECT_NEAR(simulation.world().bodies.rigid.state[0].pose.position.y(), 0.4, 0.1);
}

// The vertices above a static bone of 0.3 m are in tetrahedra with corners in it: impulses move their other
// corners alone. A ball that falls on them rests on the skin.
TEST(SkinContact, ASkinOnAStaticBoneCarriesLoads) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  add_ball_with_bone(scene, Vec3(0, 0, 0), 4, 0.3);
  scene.rigid[0].mass.reset();
  scene.rigid[0].is_static = true;
  test::add_ball(scene, "load", Vec3(0, 0.62, 0), 0.2, 20);
  scene.rigid[1].friction = 1;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  ASSERT_TRUE(std::any_of(bodies.points.begin(), bodies.points.end(), [&](const SurfacePoint& point) {
    const auto held = std::count_if(point.particle.begin(), point.particle.end(),
                                    [&](int p) { return is_held(bodies.particles, as_index(p)); });
    return held > 0 && held < 4;
  })) << "a vertex moves partly with the bone";
  for (int frame = 0; frame < 36; ++frame) {
    simulation.advance_frame();
    test::expect_below(simulation.stats().max_penetration, 1e-3, "depth in the load");
  }
  EXPECT_GT(bodies.rigid.state[1].pose.position.y(), 0.57) << "the skin, 0.4 m high, carries the ball";
}

// With a bone of 0.3 m in coarse flesh, vertices move partly with the bone, which contact cannot push by
// them. Springs hold the same flesh.
TEST(SkinContact, AVertexBetweenFleshAndBoneIsReported) {
  scene::Scene scene = test::on_ground();
  scene::DeformableBody& body = add_ball_with_bone(scene, Vec3(0, 0.45, 0), 4, 0.3);
  try {
    const Simulation simulation(scene, test::plan(scene));
    FAIL() << "accepted";
  } catch (const SceneError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("deformable.soft.skin.contact: "), std::string::npos) << text;
    EXPECT_NE(text.find("`bone`"), std::string::npos) << text;
    EXPECT_NE(text.find("attach_springs"), std::string::npos) << text;
  }
  body.attach_springs.emplace();
  EXPECT_NO_THROW(Simulation(scene, test::plan(scene)));
}

// Impulses on the skin act on the particles with the same sum and moment, so no stage has a defect, to
// rounding, without a bone and with one.
TEST(SkinContact, KeepsMomentumWithWhatTouchesIt) {
  for (const bool with_bone : {false, true}) {
    scene::Scene scene = test::free_space();
    test::add_ball(scene, "ball", Vec3(0.95, 0.1, 0), 0.5, 300).placement.velocity = Vec3(-1, 0, 0);
    scene::DeformableBody& soft = with_bone ? add_ball_with_bone(scene, Vec3(0, 0, 0), 8, 0.15)
                                            : add_ball_in_box(scene, Vec3(0, 0, 0), true);
    soft.placement.velocity = Vec3(2, 0.5, 0);
    soft.placement.angular_velocity = Vec3(0, 1, 2);
    if (with_bone) {
      scene.rigid[1].placement.velocity = soft.placement.velocity;
      scene.rigid[1].placement.angular_velocity = soft.placement.angular_velocity;
    }
    Simulation simulation(scene, test::plan(scene));
    simulation.keep_ledger();
    const Vec3 before = simulation.world().bodies.rigid.state[0].velocity;
    double defect = 0;
    for (int frame = 0; frame < 12; ++frame) {
      simulation.advance_frame();
      for (const LedgerStats& stage : simulation.stats().ledger) {
        if (stage.name == "step" || stage.name == name(Stage::advance_position)) continue;
        defect = std::max({defect, stage.momentum_defect / 2000, stage.angular_momentum_defect / 2000});
      }
    }
    EXPECT_GT((simulation.world().bodies.rigid.state[0].velocity - before).norm(), 0.5) << "they met";
    test::expect_below(defect, 1e-10, with_bone ? "defect_of_a_stage_with_bone" : "defect_of_a_stage");
  }
}

// A skin of 250 kg adds its mass to the particles that carry it, with the same center of mass.
TEST(SkinContact, ItsMassIsTheBodys) {
  scene::Scene scene = test::free_space();
  add_ball_in_box(scene, Vec3(1, 2, 3), false).skin->mass = 250;
  Simulation simulation(scene, test::plan(scene));
  const Particles& particles = simulation.world().bodies.particles;
  double mass = 0;
  Vec3 center = Vec3::Zero();
  for (std::size_t p = 0; p < particles.size(); ++p) {
    mass += particles.mass[p];
    center += particles.mass[p] * particles.x[p];
  }
  EXPECT_NEAR(mass, 1250, 1e-9);
  EXPECT_LT((center / mass - Vec3(1, 2, 3)).norm(), 1e-6);  // the positions of the skin have single precision
}

}  // namespace
}  // namespace duet::skin_contact_test
