// Tests of repetition, prefabs and instances through the scene reader.
#include <numbers>

#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/build/motion.h"
#include "sim/scene/reader/random_placement.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::prefabs_test {
namespace {

Scene read_scene(const std::string& text) { return read_text(text, "test.toml", {}, Meshes::leave).scene; }

std::string problems_of(const std::string& text) {
  try {
    read_scene(text);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

constexpr const char* legs = R"(
[prefabs.leg.parameters]
gain = 100
[[prefabs.leg.rigid]]
name = "thigh"
shape = { box = [0.2, 1, 0.2] }
position = [0, 1.5, 0]
mass = 3
[[prefabs.leg.rigid]]
name = "shin"
shape = { box = [0.2, 1, 0.2] }
position = [0, 0.5, 0]
mass = 2
[[prefabs.leg.joints]]
name = "knee"
type = "hinge"
parent = "thigh"
child = "shin"
position = [0, 1, 0]
axis = [1, 0, 0]
control = { gain = "$gain" }
)";

// Lengths of an instance are multiplied by its scale, and masses by the cube of it.
TEST(Prefabs, InstancesOfAnotherSizeKeepTheirDensity) {
  const Scene scene = read_scene(std::string(legs) + R"(
[[instances]]
name = "giant"
prefab = "leg"
position = [1, 0, 0]
scale = 2
)");
  ASSERT_EQ(scene.rigid.size(), 2u);
  EXPECT_EQ(scene.rigid[0].placement.position, Vec3(1, 3, 0));
  EXPECT_EQ(scene.rigid[0].shape.size, Vec3(0.4, 2, 0.4));
  EXPECT_EQ(scene.rigid[0].mass, 24);
  EXPECT_EQ(scene.joints[0].world.position, Vec3(1, 2, 0));
}

TEST(Prefabs, ParametersOfTheSceneCountEverywhere) {
  const Scene scene = read_scene(std::string("[parameters]\nhow_many = 3\ntop = 4\ngain = 5\n") + legs + R"(
[[rigid]]
name = "lid"
shape = { sphere = 0.5 }
position = [0, "$top", 0]
mass = 1
[[instances]]
name = "row"
prefab = "leg"
grid = ["$how_many", 1, 1]
step = [1, 0, 0]
)");
  ASSERT_EQ(scene.rigid.size(), 7u);
  EXPECT_EQ(scene.rigid[0].placement.position.y(), 4);
  EXPECT_EQ(scene.joints[0].control.gain, 100);  // The prefab's own parameter precedes the scene's.
  const std::string unknown = problems_of(
      "[parameters]\na = 1\n[[rigid]]\nname = \"x\"\nshape = { sphere = "
      "\"$b\" }\nmass = 1\n");
  EXPECT_NE(unknown.find("there is no parameter `b`"), std::string::npos) << unknown;
}

TEST(Prefabs, InstancesAreMovedAndNamed) {
  const Scene scene = read_scene(std::string(legs) + R"(
[[instances]]
name = "left"
prefab = "leg"
position = [0, 0, 2]
rotation = { axis = [0, 1, 0], degrees = 90 }
set = { gain = 7 }
[[instances]]
name = "row"
prefab = "leg"
position = [5, 0, 0]
grid = [2, 1, 2]
step = [1, 0, 3]
)");
  ASSERT_EQ(scene.rigid.size(), 10u);
  ASSERT_EQ(scene.joints.size(), 5u);
  EXPECT_EQ(scene.rigid[0].name, "left-thigh");
  EXPECT_EQ(scene.joints[0].parent, "left-thigh");
  EXPECT_EQ(scene.joints[0].control.gain, 7);
  EXPECT_EQ(scene.joints[1].control.gain, 100);
  EXPECT_TRUE(scene.rigid[1].placement.position.isApprox(Vec3(0, 0.5, 2)));
  EXPECT_TRUE((scene.joints[0].world.axis - Vec3(0, 0, -1)).norm() < 1e-12);
  EXPECT_EQ(scene.rigid.back().name, "row4-shin");
  EXPECT_TRUE(scene.rigid.back().placement.position.isApprox(Vec3(6, 0.5, 3)));
}

TEST(Prefabs, TablesRepeat) {
  const Scene scene = read_scene(R"(
[[rigid]]
name = "link{}"
shape = { box = [1, 0.1, 0.1] }
position = [0.5, 0, 0]
mass = 1
repeat = { count = 4, step = [1, 0, 0], advance = { mass = 2 } }
[[joints]]
name = "joint{}"
type = "point"
parent = "link{}"
child = "link{+}"
position = [1, 0, 0]
repeat = { count = 3, step = [1, 0, 0] }
)");
  ASSERT_EQ(scene.rigid.size(), 4u);
  EXPECT_EQ(scene.rigid[3].name, "link4");
  EXPECT_EQ(scene.rigid[3].placement.position.x(), 3.5);
  EXPECT_EQ(*scene.rigid[3].mass, 7);
  EXPECT_EQ(scene.joints[2].child, "link4");
  EXPECT_EQ(scene.joints[2].world.position->x(), 3);
}

TEST(Prefabs, ScatteredBoxesKeepClear) {
  Random random(5);
  std::vector<PlacedBox> placed;
  const Vec3 half(0.5, 0.1, 0.1), lower(-1, -1, -1), upper(1, 1, 1);
  for (int i = 0; i < 30; ++i) {
    const auto pose = random_pose(half, lower, upper, BoxAxes::random, placed, random);
    ASSERT_TRUE(pose);
    const PlacedBox box{*pose, half};
    for (const PlacedBox& other : placed) EXPECT_FALSE(overlap(box, other));
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at =
          pose->to_world(Vec3(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                              corner & 4 ? half.z() : -half.z()));
      EXPECT_TRUE((at.array() >= lower.array() - 1e-12).all() && (at.array() <= upper.array() + 1e-12).all());
    }
    placed.push_back(box);
  }
}

// Two instances at different places, with the same region in the world, keep their boxes clear of each other
// there.
TEST(Prefabs, ScatteredInstancesKeepClearOfEachOther) {
  const Scene scene = read_scene(R"(
[[prefabs.p.rigid]]
name = "b"
shape = { box = [1, 1, 1] }
mass = 1
[[instances]]
name = "i"
prefab = "p"
scatter = { count = 8, size = [1, 1, 1], lower = [0, 0, 0], upper = [4, 6, 4] }
[[instances]]
name = "j"
prefab = "p"
position = [4, 0, 0]
rotation = { axis = [0, 1, 0], degrees = 270 }
scatter = { count = 8, size = [1, 1, 1], lower = [0, 0, 0], upper = [4, 6, 4] }
)");
  ASSERT_EQ(scene.rigid.size(), 16U);
  const auto box_of = [](const RigidBody& body) {
    return PlacedBox{{body.placement.position, body.placement.orientation}, Vec3::Constant(0.4999)};
  };
  for (std::size_t a = 0; a < 16; ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_FALSE(overlap(box_of(scene.rigid[a]), box_of(scene.rigid[b]))) << a << " and " << b;
}

TEST(Prefabs, ScatterIsTheSameForTheSameSeed) {
  const auto scattered = [](int seed) {
    return read_scene(std::string(legs) + R"(
[[instances]]
name = "l"
prefab = "leg"
scatter = { count = 5, size = [1, 2, 1], lower = [-5, 0, -5], upper = [5, 9, 5] }
vary = { gain = [1, 2] }
seed = )" + std::to_string(seed));
  };
  const Scene a = scattered(3), b = scattered(3), c = scattered(4);
  EXPECT_EQ(a.rigid[4].placement.position, b.rigid[4].placement.position);
  EXPECT_NE(a.rigid[4].placement.position, c.rigid[4].placement.position);
  EXPECT_NE(a.joints[0].control.gain, a.joints[1].control.gain);
}

// A swinging gate, a wheel and a piston are turned by 90 degrees about y, scaled and moved as a whole, and
// their prescribed motions with them.
TEST(Prefabs, MotionsMoveWithTheirInstance) {
  const Scene scene = read_scene(R"(
[[prefabs.machine.rigid]]
name = "gate"
shape = { box = [1, 1, 1] }
rotation = { axis = [0, 1, 0], degrees = 30 }
motion.keyframes = [
  { time = 0, position = [1, 0, 0], rotation = { axis = [1, 0, 0], degrees = 0 } },
  { time = 2, position = [3, 0, 0], velocity = [1, 0, 0], rotation = { axis = [1, 0, 0], degrees = 90 } },
]
[[prefabs.machine.rigid]]
name = "wheel"
shape = { sphere = 1 }
position = [0, 1, 2]
motion.spin = { axis = [0, 0, 1], rate = 1 }
[[prefabs.machine.rigid]]
name = "piston"
shape = { sphere = 1 }
motion.sinusoid = { amplitude = [1, 0, 0], rotation = { axis = [1, 0, 0], degrees = 5 }, frequency = 1 }
[[instances]]
name = "one"
prefab = "machine"
position = [0, 10, 0]
rotation = { axis = [0, 1, 0], degrees = 90 }
scale = 2
)");
  const auto near = [](const Vec3& a, const Vec3& b) { return (a - b).norm() < 1e-12; };
  ASSERT_EQ(scene.rigid.size(), 3u);
  const std::vector<Keyframe>& keys = scene.rigid[0].motion.keyframes;
  EXPECT_TRUE(near(*keys[1].position, Vec3(0, 10, -6)));  // x has become -z, and all lengths are doubled.
  EXPECT_TRUE(near(*keys[1].velocity, Vec3(0, 0, -2)));
  EXPECT_TRUE(near(scene.rigid[1].motion.spin[0].axis, Vec3(1, 0, 0)));
  EXPECT_TRUE(near(scene.rigid[1].placement.position, Vec3(4, 12, 0)));
  EXPECT_TRUE(near(scene.rigid[2].motion.sinusoid[0].amplitude, Vec3(0, 0, -2)));
  EXPECT_TRUE(near(scene.rigid[2].motion.sinusoid[0].rotation.axis, Vec3(0, 0, -1)));
  // The rotation of the gate in the world is its rotation in the prefab, turned with the instance.
  const Quat turn(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  const Quat own(Eigen::AngleAxisd(std::numbers::pi / 6, Vec3::UnitY())),
      swing(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
  const Pose pose = motion_at(kinematic_motion(scene.rigid[0], Pose()), 2).pose;
  EXPECT_LT(pose.orientation.angularDistance(turn * swing * own), 1e-12);
}

// A mistake in a copy is reported at the line where it was written, and once for all copies.
TEST(Prefabs, MistakesInCopiesAreFoundInTheFile) {
  EXPECT_NE(problems_of(R"([[prefabs.leg.rigid]]
name = "thigh"
shape = { sphere = 1 }
mass = "$weight"
[[prefabs.leg.rigid]]
name = "toe{}"
shape = { sphere = 0.1 }
position = [0, 0, 2]
mass = 1
friction = -3
repeat = { count = 5, step = [0.3, 0, 0] }
[prefabs.leg.parameters]
weight = -2
[[instances]]
name = "leg"
prefab = "leg"
grid = [3, 1, 1]
step = [4, 0, 0]
)")
                .find("test.toml:4:8: rigid.leg1-thigh.mass: must be > 0 kg, is -2 (as in 2 other copies)"),
            std::string::npos);
  const std::string text = problems_of(R"([[rigid]]
name = "toe{}"
shape = { sphere = 0.1 }
mass = 1
friction = -3
velocity = [0, 0]
repeat = { count = 5, step = [0.3, 0, 0] }
)");
  EXPECT_NE(text.find("test.toml:5:12: rigid.toe1.friction: must be >= 0, is -3 (as in 4 other copies)"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("test.toml:6:12: rigid.toe1.velocity"), std::string::npos) << text;
  // A body without a name is known by its place in the list.
  const std::string unnamed = problems_of(
      "[[rigid]]\nshape = { sphere = 0.1 }\nmass = 1\nfriction = -3\nrepeat = { count = 2, step = [1, 0, 0] "
      "}\n");
  EXPECT_NE(unnamed.find("test.toml:4:12: rigid[0].friction"), std::string::npos) << unnamed;
  const Scene scene = read_scene(std::string(legs) + "[[instances]]\nname = \"a\"\nprefab = \"leg\"\n");
  EXPECT_EQ(scene.rigid[1].at.line, 9);  // line of the shin
}

TEST(Prefabs, MistakesAreNamed) {
  EXPECT_NE(problems_of(std::string(legs) + "[[instances]]\nname = \"a\"\nprefab = \"legs\"\n")
                .find("unknown prefab `legs`"),
            std::string::npos);
  EXPECT_NE(
      problems_of(std::string(legs) + "[[instances]]\nname = \"a\"\nprefab = \"leg\"\nset = { gian = 1 }\n")
          .find("no such parameter"),
      std::string::npos);
  EXPECT_NE(
      problems_of(
          std::string(legs) +
          "[[instances]]\nname = \"a\"\nprefab = \"leg\"\nscatter = { count = 99, size = [1, 1, 1], lower = "
          "[0, 0, 0], upper = [2, 2, 2] }\n")
          .find("no room left"),
      std::string::npos);
}

TEST(Joints, MistakesAreNamed) {
  const std::string bodies = R"(
[[rigid]]
name = "a"
shape = { sphere = 1 }
mass = 1
[[rigid]]
name = "b"
shape = { sphere = 1 }
position = [3, 0, 0]
mass = 1
)";
  const auto with = [&](const std::string& joint) {
    return problems_of(bodies + "[[joints]]\nname = \"j\"\n" + joint);
  };
  EXPECT_EQ(with("type = \"point\"\nparent = \"a\"\nchild = \"b\"\nposition = [1, 0, 0]\n"), "");
  EXPECT_NE(with("type = \"point\"\nparent = \"a\"\nchild = \"c\"\nposition = [1, 0, 0]\n")
                .find("no rigid body is called `c`"),
            std::string::npos);
  const std::string to_ground =
      "type = \"point\"\nparent = \"ground\"\nchild = \"b\"\nposition = [1, 0, 0]\n";
  EXPECT_NE(with(to_ground).find("is the ground, and the scene has none"), std::string::npos);
  EXPECT_EQ(with(to_ground + "[ground]\n"), "");
  EXPECT_NE(with("type = \"point\"\nparent = \"a\"\nchild = \"b\"\nparent_frame = { position = [1, 0, 0] "
                 "}\nchild_frame = { "
                 "position = [-1, 0, 0] }\n")
                .find("1 m apart at the start"),
            std::string::npos);
  EXPECT_NE(
      with("type = \"weld\"\nparent = \"a\"\nchild = \"b\"\nposition = [1, 0, 0]\nangle = { least = 0 }\n")
          .find("has no effect on a weld joint"),
      std::string::npos);
  EXPECT_NE(with("type = \"hinge\"\nparent = \"a\"\nchild = \"b\"\n").find("has no place"),
            std::string::npos);
}

}  // namespace
}  // namespace duet::scene::prefabs_test
