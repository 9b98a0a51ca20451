// Tests of GLB files, which are read back with a small reader of glTF: what a viewer shows at each frame is
// where the run has it.
#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/support/recorded_run.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/export/exporters.h"
#include "sim/scene/camera_path.h"

namespace duet::io::glb_test {
namespace {

using nlohmann::json;

std::size_t components(const json& accessor) {
  const std::string type = accessor.at("type");
  return type == "SCALAR" ? 1 : static_cast<std::size_t>(type.back() - '0');
}

// Reader of a GLB file: its JSON root and its binary chunk.
struct Glb {
  json root;
  std::string binary;

  explicit Glb(const fs::path& path) {
    const std::string bytes = read_file(path);
    std::uint32_t length = 0;
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    std::memcpy(&length, bytes.data() + 8, 4);
    EXPECT_EQ(length, bytes.size());
    std::memcpy(&length, bytes.data() + 12, 4);
    root = json::parse(bytes.substr(20, length));
    binary = bytes.substr(20 + length + 8);
    EXPECT_EQ(root.at("buffers").at(0).at("byteLength"), binary.size());
  }

  template <class Value>
  void copy(const json& from, std::size_t extra, Value* to, std::size_t count) const {
    const json& view = root.at("bufferViews").at(from.at("bufferView").get<std::size_t>());
    const std::size_t offset = view.value("byteOffset", 0U) + from.value("byteOffset", 0U) + extra;
    ASSERT_LE(offset + count * sizeof(Value), binary.size());
    std::memcpy(to, binary.data() + offset, count * sizeof(Value));
  }

  std::vector<float> floats(std::size_t index) const {
    const json& accessor = root.at("accessors").at(index);
    const std::size_t width = components(accessor);
    std::vector<float> values(accessor.at("count").get<std::size_t>() * width, 0);
    if (accessor.contains("bufferView")) copy(accessor, 0, values.data(), values.size());
    if (!accessor.contains("sparse")) return values;
    const json& sparse = accessor.at("sparse");
    std::vector<std::uint32_t> places(sparse.at("count").get<std::size_t>());
    std::vector<float> others(places.size() * width);
    copy(sparse.at("indices"), 0, places.data(), places.size());
    copy(sparse.at("values"), 0, others.data(), others.size());
    for (std::size_t i = 0; i < places.size(); ++i)
      std::copy_n(others.begin() + static_cast<std::ptrdiff_t>(i * width), width,
                  values.begin() + static_cast<std::ptrdiff_t>(places[i] * width));
    return values;
  }

  const json& node(const std::string& name) const {
    for (const json& node : root.at("nodes"))
      if (node.at("name") == name) return node;
    ADD_FAILURE() << "no node " << name;
    return root;
  }
  std::size_t node_index(const std::string& name) const {
    return static_cast<std::size_t>(&node(name) - &root.at("nodes").at(0));
  }
  const json& mesh(const std::string& body) const {
    return root.at("meshes").at(node(body).at("mesh").get<std::size_t>());
  }
  const json& primitive(const std::string& body) const { return mesh(body).at("primitives").at(0); }

  bool animates(const std::string& node, const std::string& path) const {
    return !output(node, path).empty();
  }
  // Returns the values of an animated property at all keys. They are empty if the property is not animated.
  std::vector<float> output(const std::string& node, const std::string& path) const {
    if (!root.contains("animations")) return {};
    const json& animation = root.at("animations").at(0);
    for (const json& channel : animation.at("channels"))
      if (channel.at("target").at("node") == node_index(node) && channel.at("target").at("path") == path)
        return floats(animation.at("samplers").at(channel.at("sampler").get<std::size_t>()).at("output"));
    return {};
  }
  // Returns the property of a node at a key, animated or not.
  std::vector<double> at(const std::string& name, const std::string& path, std::size_t key) const {
    const std::vector<float> values = output(name, path);
    if (values.empty()) return node(name).at(path);
    const std::size_t width = path == "rotation" ? 4 : 3;
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(key * width);
    return {from, from + static_cast<std::ptrdiff_t>(width)};
  }
};

// Vertices of one body as a viewer shows them.
struct Shown {
  std::vector<Vec3> positions, normals;  // in world space, in the axes of the run
  std::vector<int> run_vertices;
};

Vec3 vector(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

std::vector<Vec3> vectors(const std::vector<float>& values) {
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < values.size(); i += 3)
    result.emplace_back(values[i], values[i + 1], values[i + 2]);
  return result;
}

// Returns the mesh of a body at a key by the glTF specification: morph targets first, then the rotation, then
// the translation.
Shown show(const Glb& glb, const std::string& body, std::size_t key) {
  const json& primitive = glb.primitive(body);
  Shown shown;
  shown.positions = vectors(glb.floats(primitive.at("attributes").at("POSITION")));
  shown.normals = vectors(glb.floats(primitive.at("attributes").at("NORMAL")));
  for (std::size_t i = 0; i < shown.positions.size(); ++i) shown.run_vertices.push_back(static_cast<int>(i));
  if (primitive.at("attributes").contains("_RUN_VERTEX")) {
    const std::vector<float> places = glb.floats(primitive.at("attributes").at("_RUN_VERTEX"));
    shown.run_vertices.assign(places.begin(), places.end());
  }
  const std::vector<float> weights = glb.output(body, "weights");
  const std::size_t targets = primitive.contains("targets") ? primitive.at("targets").size() : 0;
  for (std::size_t t = 0; t < targets; ++t) {
    const double weight = weights.at(key * targets + t);
    if (weight == 0) continue;
    const std::vector<Vec3> moves = vectors(glb.floats(primitive.at("targets").at(t).at("POSITION")));
    const std::vector<Vec3> turns = vectors(glb.floats(primitive.at("targets").at(t).at("NORMAL")));
    for (std::size_t i = 0; i < moves.size(); ++i) {
      shown.positions[i] += weight * moves[i];
      shown.normals[i] += weight * turns[i];
    }
  }
  const Vec3 translation = vector(glb.at(body, "translation", key)) +
                           vector(glb.root.at("asset").at("extras").at("origin").get<std::vector<double>>());
  Quat rotation = Quat::Identity();
  if (glb.node(body).contains("rotation")) {
    const std::vector<double> q = glb.at(body, "rotation", key);
    rotation = Quat(q[3], q[0], q[1], q[2]);
  }
  for (Vec3& x : shown.positions) x = rotation * x + translation;
  for (Vec3& n : shown.normals) n = rotation * n;
  return shown;
}

double size_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  return box.diagonal().norm();
}

// Checks every vertex, normal and triangle corner at every frame. `tolerance` is relative to the size of the
// body.
void expect_same_motion(const Glb& glb, const ExportedRun& run, double tolerance) {
  for (std::size_t key = 0; key < run.frames().size(); ++key) {
    const FrameValues values = run.read(run.frames()[key]);
    for (const ExportedBody& body : run.bodies()) {
      SCOPED_TRACE(body.name + " at frame " + std::to_string(run.frames()[key]));
      Surface surface = body.rest;
      place(body, values, surface);
      const Shown shown = show(glb, body.name, key);
      double error = 0;
      for (std::size_t i = 0; i < shown.positions.size(); ++i) {
        const auto vertex = static_cast<std::size_t>(shown.run_vertices[i]);
        error = std::max(error, (shown.positions[i] - surface.positions.at(vertex)).norm());
      }
      EXPECT_LT(error, tolerance * size_of(surface));
      const json& accessor =
          glb.root.at("accessors").at(glb.primitive(body.name).at("indices").get<std::size_t>());
      ASSERT_EQ(accessor.at("count"), 3 * surface.triangles.size());
      std::vector<std::uint16_t> indices(3 * surface.triangles.size());
      glb.copy(accessor, 0, indices.data(), indices.size());
      for (std::size_t i = 0; i < indices.size(); ++i) {
        const Corner& corner = surface.triangles[i / 3][i % 3];
        ASSERT_EQ(shown.run_vertices[indices[i]], corner.position);
        const Vec3 normal = surface.normals[static_cast<std::size_t>(corner.normal)].cast<double>();
        ASSERT_LT((shown.normals[indices[i]] - normal).norm(), 1e-5);
      }
    }
  }
}

ExportedRun exported(const RunDirectory& run, const scene::Scene& scene, const ExportChoice& choice = {}) {
  ExportedRun result(run, choice);
  result.set_looks(test::looks_of(scene, result.manifest()));
  return result;
}

// The tolerance of 1e-6 of a body's size is the rounding of floats.
TEST(Glb, ShowsEveryVertexOfEveryFrame) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 4, scratch / "run"), scene);
  EXPECT_TRUE(export_glb(run, {}, scratch / "a.glb").empty());
  const Glb glb(scratch / "a.glb");
  expect_same_motion(glb, run, 1e-6);
  EXPECT_FALSE(glb.animates("floor", "translation") || glb.animates("floor", "rotation"));
  EXPECT_TRUE(glb.animates("box1", "translation") && glb.animates("box1", "rotation"));
  EXPECT_TRUE(glb.animates("ball", "rotation"));
  EXPECT_FALSE(glb.animates("ball", "translation"));
  EXPECT_TRUE(glb.animates("cloth", "weights"));
  EXPECT_EQ(glb.root.at("asset").at("extras").at("fps"), 24);
  EXPECT_EQ(glb.mesh("cloth").at("extras").at("targetNames"),
            json({"frame 1", "frame 2", "frame 3", "frame 4"}));
}

// Floats at 10 km are 1 mm apart. The exporter moves the scene to an origin of its own and says so, and
// shapes keep 3e-6 of their size.
TEST(Glb, KeepsItsDigitsTenKilometersAway) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each(Vec3(8000, 100, -6000));
  const ExportedRun run = exported(test::record_run(scene, 2, scratch / "run"), scene);
  const ExportNotes notes = export_glb(run, {}, scratch / "a.glb");
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("(8000, "), std::string::npos) << notes[0];
  expect_same_motion(Glb(scratch / "a.glb"), run, 3e-6);
}

TEST(Glb, TakesOtherAxesUnitsAndFrames) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const RunDirectory directory = test::record_run(scene, 5, scratch / "run");
  remove_file(directory.values(3));
  ExportChoice choice;
  choice.first = 2;
  choice.up = 'z';
  choice.scale = 100;
  const ExportedRun run = exported(directory, scene, choice);
  EXPECT_EQ(export_glb(run, {}, scratch / "a.glb").size(), 2U) << "axes, a missing frame";
  const Glb glb(scratch / "a.glb");
  expect_same_motion(glb, run, 1e-6);
  EXPECT_EQ(glb.root.at("asset").at("extras").at("missing_frames"), json({3}));
  const json& sampler = glb.root.at("animations").at(0).at("samplers").at(0);
  const std::vector<float> times = glb.floats(sampler.at("input"));
  ASSERT_EQ(times.size(), 3U);
  EXPECT_FLOAT_EQ(times[0], 2.0F / 24);
  EXPECT_FLOAT_EQ(times[1], 4.0F / 24);
}

TEST(Glb, SizesOfPatternsAreInTheUnitOfTheExport) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  scene.looks.emplace_back().name = "squares";
  scene.looks.back().pattern = "checker";
  scene.looks.back().pattern_size = 0.5;
  scene.rigid.back().look = "squares";
  ExportChoice choice;
  choice.scale = 100;
  export_glb(exported(test::record_run(scene, 1, scratch / "run"), scene, choice), {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  double size = 0;
  for (const json& material : glb.root.at("materials"))
    if (material.at("name") == "squares") size = material.at("extras").at("pattern_size");
  EXPECT_DOUBLE_EQ(size, 50);
}

TEST(Glb, OneFrameAndOneKindOfBodyAreEnough) {
  const ScratchFolder scratch;
  for (const char* names : {"box*", "cloth", "*"}) {
    const scene::Scene scene = test::one_of_each();
    ExportChoice choice;
    choice.bodies = {names};
    choice.last = 0;
    const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene, choice);
    export_glb(run, {}, scratch / "a.glb");
    const Glb glb(scratch / "a.glb");
    expect_same_motion(glb, run, 1e-6);
    EXPECT_FALSE(glb.root.contains("animations"));
  }
}

// q and -q are the same rotation. A viewer that interpolates between opposite signs would spin the body, so
// consecutive keys must have a positive dot product.
TEST(Glb, QuaternionsTakeTheShorterArc) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const auto flip = [](FrameValues& values) {
    if (values.frame % 2 != 0)
      for (RigidMotion& motion : values.rigid) motion.pose.orientation.coeffs() *= -1;
  };
  const ExportedRun run = exported(test::record_run(scene, 4, scratch / "run", flip), scene);
  export_glb(run, {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  const std::vector<float> q = glb.output("box1", "rotation");
  ASSERT_EQ(q.size(), 20U);
  for (std::size_t i = 4; i < q.size(); i += 4)
    EXPECT_GT(q[i] * q[i - 4] + q[i + 1] * q[i - 3] + q[i + 2] * q[i - 2] + q[i + 3] * q[i - 1], 0);
  EXPECT_FALSE(glb.animates("floor", "rotation"));
}

TEST(Glb, AlikeBodiesShareTheirMesh) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  scene.rigid.push_back(scene.rigid[2]);
  scene.rigid.back().name = "red";
  scene.rigid.back().look = "red";
  scene.rigid.back().placement.position.y() += 1;
  scene.looks.emplace_back().name = "red";
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  export_glb(run, {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  EXPECT_EQ(glb.node("box1").at("mesh"), glb.node("box2").at("mesh"));
  EXPECT_NE(glb.node("box1").at("mesh"), glb.node("box3").at("mesh"));
  EXPECT_NE(glb.node("box1").at("mesh"), glb.node("red").at("mesh")) << "its material differs";
  EXPECT_EQ(glb.primitive("box1").at("attributes"), glb.primitive("red").at("attributes"));
}

TEST(Glb, MorphTargetsThatMoveFewVerticesAreSparse) {
  const ScratchFolder scratch;
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 8);
  std::vector<Vec3> rest;
  const auto move = [&](FrameValues& values) {
    if (rest.empty()) rest = values.points;
    values.points = rest;
    values.points[7].y() += 0.01 * std::min(values.frame, 3);
  };
  const ExportedRun run = exported(test::record_run(scene, 6, scratch / "run", move), scene);
  export_glb(run, {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  expect_same_motion(glb, run, 1e-6);
  const json& targets = glb.primitive("soft").at("targets");
  ASSERT_EQ(targets.size(), 6U);
  EXPECT_EQ(targets[2], targets[5]) << "frames alike share their target";
  EXPECT_NE(targets[0], targets[1]);
  const json& accessor = glb.root.at("accessors").at(targets[0].at("POSITION").get<std::size_t>());
  EXPECT_FALSE(accessor.contains("bufferView"));
  EXPECT_LE(accessor.at("sparse").at("count"), 3);
}

// A body of 0.1 m that travels 300 m would lose its shape to floats if only its vertices moved. The node
// carries the motion.
TEST(Glb, ABodyThatGoesFarKeepsItsShape) {
  const ScratchFolder scratch;
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(0.1, 0.1, 0.1), 2);
  const auto move = [](FrameValues& values) {
    for (Vec3& x : values.points) x += Vec3(0, -0.3, 100) * values.frame + 0.01 * x.cwiseProduct(x);
  };
  const ExportedRun run = exported(test::record_run(scene, 3, scratch / "run", move), scene);
  export_glb(run, {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  EXPECT_TRUE(glb.animates("soft", "translation"));
  expect_same_motion(glb, run, 1e-6);
}

TEST(Glb, BodiesAtRestHaveNoAnimation) {
  const ScratchFolder scratch;
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 2);
  test::add_box(scene, "box", Vec3(3, 0, 0), Vec3(1, 1, 1), 1);
  const ExportedRun run = exported(test::record_run(scene, 3, scratch / "run"), scene);
  export_glb(run, {}, scratch / "a.glb");
  const Glb glb(scratch / "a.glb");
  EXPECT_FALSE(glb.root.contains("animations"));
  EXPECT_FALSE(glb.primitive("soft").contains("targets"));
}

TEST(Glb, CarriesLooksCameraAndLights) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  scene.looks.emplace_back().name = "glass";
  scene.looks.back().color = Vec3(0.2, 0.4, 0.9);
  scene.looks.back().metallic = 0.25;
  scene.looks.back().roughness = 0.1;
  scene.looks.back().opacity = 0.5;
  scene.looks.emplace_back().name = "spotted";
  scene.looks.back().pattern = "checker";
  scene.rigid[1].look = "glass";
  scene.rigid[3].look = "spotted";
  scene.camera.position = Vec3(1, 2, 8);
  scene.camera.vertical_fov = 40;
  scene.camera.keyframes.resize(2);
  scene.camera.keyframes[1].time = 0.1;
  scene.camera.keyframes[1].position = Vec3(4, 2, 6);
  scene.lights.emplace_back().name = "key";
  scene.lights.back().power = 400;
  const ExportedRun run = exported(test::record_run(scene, 3, scratch / "run"), scene);
  EXPECT_EQ(export_glb(run, {}, scratch / "a.glb").size(), 2U) << "pattern, area light";
  const Glb glb(scratch / "a.glb");
  const json& material = glb.root.at("materials").at(glb.primitive("box1").at("material").get<std::size_t>());
  EXPECT_EQ(material.at("name"), "glass");
  EXPECT_EQ(material.at("alphaMode"), "BLEND");
  const json& pbr = material.at("pbrMetallicRoughness");
  EXPECT_EQ(pbr.at("baseColorFactor"), json({0.2, 0.4, 0.9, 0.5}));
  EXPECT_EQ(pbr.at("metallicFactor"), 0.25);
  EXPECT_EQ(pbr.at("roughnessFactor"), 0.1);
  const json& perspective = glb.root.at("cameras").at(0).at("perspective");
  EXPECT_DOUBLE_EQ(perspective.at("yfov"), 40 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(perspective.at("aspectRatio"), 1280.0 / 720);
  const scene::CameraPath path(scene.camera);
  for (std::size_t key = 0; key < 4; ++key) {
    const scene::Camera camera = path.at(static_cast<double>(key) / 24);
    EXPECT_LT((vector(glb.at("camera", "translation", key)) - camera.position).norm(), 1e-5);
    const std::vector<double> q = glb.at("camera", "rotation", key);
    const Vec3 forward = Quat(q[3], q[0], q[1], q[2]) * -Vec3::UnitZ();
    EXPECT_LT((forward - (camera.target - camera.position).normalized()).norm(), 1e-6);
  }
  const json& light = glb.root.at("extensions").at("KHR_lights_punctual").at("lights").at(0);
  EXPECT_EQ(light.at("type"), "point");
  EXPECT_DOUBLE_EQ(light.at("intensity"), 100 / std::numbers::pi);
}

TEST(Glb, RefusesFilesAboveTheBound) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  FormatOptions options;
  options.max_bytes = 10000;
  try {
    export_glb(run, options, scratch / "a.glb");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    EXPECT_NE(std::string(error.what()).find("usd"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(scratch / "a.glb"));
}

TEST(Glb, NamesMayHoldAnything) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  const std::vector<std::string> names{"a \"quoted\" name", "a/b\\c", "Würfel 木", "tab\tand\nline"};
  for (std::size_t i = 0; i < names.size(); ++i) scene.rigid[i].name = names[i];
  scene.deformable[0].name = "soft \"body\"";
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  export_glb(run, {}, scratch / "a.glb");
  expect_same_motion(Glb(scratch / "a.glb"), run, 1e-6);
}

}  // namespace
}  // namespace duet::io::glb_test
