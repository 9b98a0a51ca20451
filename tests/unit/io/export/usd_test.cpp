// Tests of USD stages, which are read back with a small reader of what the exporter writes: what a stage
// shows at each frame is where the run has it. tools/check-exports opens stages with Pixar's library.
#include "sim/io/export/usd.h"

#include <cmath>
#include <numbers>

#include "tests/support/recorded_run.h"
#include "tests/support/scenes.h"
#include "tests/support/usd_reader.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/scene/camera_path.h"

namespace duet::io::usd_test {
namespace {

using test::Usda;

std::string frame_name(int frame) {
  std::string digits = std::to_string(frame);
  return "frames/" + std::string(4 - digits.size(), '0') + digits + ".usdc";
}

double size_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : surface.positions) box.extend(x);
  return box.diagonal().norm();
}

double max_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double result = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    result = std::max(result, (a[i] - b[i]).norm());
  return result;
}

std::vector<Vec3> doubles(const std::vector<Vec3f>& vectors) {
  std::vector<Vec3> result;
  result.reserve(vectors.size());
  for (const Vec3f& v : vectors) result.emplace_back(v.cast<double>());
  return result;
}

// Checks that the triangles, normal indices and texture indices of a mesh equal those of `surface`.
void expect_same_faces(const Usda& usda, const std::string& mesh, const Surface& surface) {
  const std::vector<double> faces = usda.numbers(mesh, "faceVertexIndices");
  ASSERT_EQ(faces.size(), 3 * surface.triangles.size());
  ASSERT_EQ(usda.numbers(mesh, "faceVertexCounts").size(), surface.triangles.size());
  const std::vector<double> normals =
      usda.has(mesh, "primvars:normals:indices") ? usda.numbers(mesh, "primvars:normals:indices") : faces;
  const std::vector<double> uvs =
      surface.uvs.empty() ? std::vector<double>() : usda.numbers(mesh, "primvars:st:indices");
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Corner& corner = surface.triangles[i / 3][i % 3];
    ASSERT_EQ(faces[i], corner.position);
    ASSERT_EQ(normals[i], corner.normal);
    if (!uvs.empty()) {
      ASSERT_EQ(uvs[i], corner.uv);
    }
  }
}

// Checks a quantity at the points of a deformable body: numbers have five digits, vectors all of them.
void expect_same_values(const PointValue& kind, const ExportedBody& body, const FrameValues& values,
                        const Usda& usda, int frame) {
  const std::string mesh = "/run/bodies/" + body.name + "/" + body.name,
                    name = std::string("primvars:") + kind.name;
  const std::size_t first = body.first_point, count = body.rest.positions.size();
  if (kind.scalars) {
    const std::vector<double> written = usda.numbers(mesh, name, frame);
    ASSERT_EQ(written.size(), count) << name;
    for (std::size_t i = 0; i < count; ++i) {
      const double expected = kind.scalars(values)[first + i];
      EXPECT_NEAR(written[i], expected, 1e-4 * std::abs(expected)) << name;
    }
    return;
  }
  const std::vector<Vec3> written = usda.vectors(mesh, name, frame);
  ASSERT_EQ(written.size(), count) << name;
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_EQ(Vec3f(written[i].cast<float>()), kind.vectors(values)[first + i]) << name;
}

// Checks every body at every frame. `tolerance` is relative to the size of a body, and `has_clips` says
// whether the stage has a file for each frame.
void expect_same_motion(const fs::path& folder, const ExportedRun& run, bool has_clips, double tolerance) {
  const Usda root(folder / "run.usda");
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    const Usda clip(has_clips ? folder / frame_name(frame) : folder / "run.usda");
    for (const ExportedBody& body : run.bodies()) {
      SCOPED_TRACE(body.name + " at frame " + std::to_string(frame));
      const std::string prim = "/run/bodies/" + body.name, mesh = prim + "/" + body.name;
      Surface surface = body.rest;
      place(body, values, surface);
      const std::string& metadata = root.metadata(mesh);
      const std::size_t reference = metadata.find("</shapes/");
      ASSERT_EQ(reference != std::string::npos, body.is_rigid());
      const std::string shape =
          body.is_rigid() ? metadata.substr(reference + 1, metadata.find('>', reference) - reference - 1)
                          : mesh;
      const Usda& at_frame = body.is_rigid() ? root : clip;
      const Usda& pose = body.kind == "static" ? root : clip;
      const Vec3 translate = pose.vectors(prim, "xformOp:translate", frame).at(0);
      Quat orient = Quat::Identity();
      if (body.is_rigid()) {
        const std::vector<double> wxyz = pose.numbers(prim, "xformOp:orient", frame);
        orient = Quat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
      }
      std::vector<Vec3> points = at_frame.vectors(shape, "points", frame);
      Eigen::AlignedBox3d box;
      for (Vec3& x : points) {
        box.extend(x);
        x = orient * x + translate;
      }
      EXPECT_LT(max_difference(points, surface.positions), tolerance * size_of(surface));
      const std::vector<Vec3> extent = at_frame.vectors(shape, "extent", frame);
      EXPECT_EQ(extent.at(0), box.min());
      EXPECT_EQ(extent.at(1), box.max());
      std::vector<Vec3> normals = at_frame.vectors(shape, "primvars:normals", frame);
      for (Vec3& n : normals) n = orient * n;
      EXPECT_LT(max_difference(normals, doubles(surface.normals)), 2e-4);
      if (frame == run.frames().front()) expect_same_faces(root, shape, surface);
      if (body.is_rigid()) continue;
      std::vector<Vec3f> speeds;
      velocities(body, values, speeds);
      std::vector<Vec3f> written;
      for (const Vec3& v : at_frame.vectors(mesh, "velocities", frame)) written.emplace_back(v.cast<float>());
      EXPECT_EQ(written, speeds);
      for (const PointValue& kind : point_values) expect_same_values(kind, body, values, at_frame, frame);
    }
  }
}

ExportedRun exported(const RunDirectory& run, const scene::Scene& scene, const ExportChoice& choice = {}) {
  ExportedRun result(run, choice);
  result.set_looks(test::looks_of(scene, result.manifest()));
  return result;
}

// Writes into a folder that exists, as the command does.
ExportNotes write(const ExportedRun& run, const fs::path& folder,
                  std::uint64_t max_inline_bytes = usd_max_inline_bytes, const FormatOptions& options = {}) {
  fs::remove_all(folder);
  create_folder(folder);
  return export_usd(run, options, folder, max_inline_bytes);
}

TEST(Usd, ShowsEveryVertexOfEveryFrame) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 4, scratch / "run"), scene);
  EXPECT_TRUE(write(run, scratch / "usd").empty());
  EXPECT_FALSE(fs::exists(scratch / "usd" / "frames"));
  expect_same_motion(scratch / "usd", run, false, 1e-7);
  const Usda usda(scratch / "usd" / "run.usda");
  EXPECT_EQ(usda.samples("/run/bodies/floor", "xformOp:orient"), 1U);
  EXPECT_EQ(usda.samples("/run/bodies/box1", "xformOp:orient"), 5U);
  EXPECT_EQ(usda.samples("/run/bodies/cloth/cloth", "points"), 5U);
  const std::string& head = usda.metadata("/");
  for (const char* line :
       {"defaultPrim = \"run\"", "upAxis = \"Y\"", "metersPerUnit = 1\n", "startTimeCode = 0\n",
        "endTimeCode = 4\n", "timeCodesPerSecond = 24\n", "framesPerSecond = 24\n"})
    EXPECT_NE(head.find(line), std::string::npos) << line;
}

TEST(Usd, LongRunsHaveAFileAFrame) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 4, scratch / "run"), scene);
  EXPECT_TRUE(write(run, scratch / "usd", 1000).empty());
  expect_same_motion(scratch / "usd", run, true, 1e-7);
  const Usda root(scratch / "usd" / "run.usda"), manifest(scratch / "usd" / "frames" / "manifest.usda");
  EXPECT_FALSE(root.has("/run/bodies/cloth/cloth", "points")) << "it would hide the clips' values";
  EXPECT_FALSE(root.has("/run/bodies/box1", "xformOp:translate"));
  EXPECT_TRUE(manifest.has_prim("/run/bodies/cloth/cloth"));
  const std::string& clips = root.metadata("/run/bodies");
  EXPECT_NE(clips.find("active = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4)]"), std::string::npos) << clips;
  EXPECT_NE(clips.find("@./frames/0004.usdc@"), std::string::npos);
}

// --compress asks for binary values of each frame, however short the run is.
TEST(Usd, CompressedRunsHaveBinaryValues) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const RunDirectory directory = test::record_run(scene, 2, scratch / "run");
  FormatOptions options;
  options.compress = true;
  for (const int last : {2, 0}) {
    ExportChoice choice;
    choice.last = last;
    const ExportedRun run = exported(directory, scene, choice);
    EXPECT_TRUE(write(run, scratch / "usd", usd_max_inline_bytes, options).empty());
    expect_same_motion(scratch / "usd", run, true, 1e-7);
  }
  ExportChoice still;
  still.bodies = {"floor"};
  const ExportedRun run = exported(directory, scene, still);
  EXPECT_TRUE(write(run, scratch / "usd", usd_max_inline_bytes, options).empty());
  EXPECT_FALSE(fs::exists(scratch / "usd" / "frames")) << "nothing moves";
}

// The file of a frame takes little more than the floats of its values.
TEST(Usd, FramesTakeAsManyBytesAsTheirFloats) {
  const ScratchFolder scratch;
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 12);
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  FormatOptions options;
  options.compress = true;
  write(run, scratch / "usd", usd_max_inline_bytes, options);
  const Usda clip(scratch / "usd" / frame_name(1));
  std::size_t floats = 0;
  const std::string mesh = "/run/bodies/soft/soft";
  for (const char* name : {"points", "velocities", "primvars:normals"})
    floats += clip.numbers(mesh, name, 1).size();
  for (const PointValue& kind : point_values)
    floats += clip.numbers(mesh, std::string("primvars:") + kind.name, 1).size();
  EXPECT_GT(floats, 10'000U);
  EXPECT_LT(static_cast<double>(fs::file_size(scratch / "usd" / frame_name(1))),
            1.1 * static_cast<double>(sizeof(float) * floats));
}

// Floats at 10 km are 1 mm apart. Translations are doubles, so that shapes keep 1e-7 of their size.
TEST(Usd, KeepsItsDigitsTenKilometersAway) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each(Vec3(8000, 100, -6000));
  const ExportedRun run = exported(test::record_run(scene, 2, scratch / "run"), scene);
  EXPECT_TRUE(write(run, scratch / "usd").empty());
  expect_same_motion(scratch / "usd", run, false, 1e-7);
}

// A body of 0.1 m that travels 300 m would lose its shape to floats if only its points moved. The prim
// carries the motion.
TEST(Usd, ABodyThatGoesFarKeepsItsShape) {
  const ScratchFolder scratch;
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(0.1, 0.1, 0.1), 2);
  const auto move = [](FrameValues& values) {
    for (Vec3& x : values.points) x += Vec3(0, -0.3, 100) * values.frame + 0.01 * x.cwiseProduct(x);
  };
  const ExportedRun run = exported(test::record_run(scene, 3, scratch / "run", move), scene);
  for (const std::uint64_t max_inline_bytes : {usd_max_inline_bytes, std::uint64_t{0}}) {
    write(run, scratch / "usd", max_inline_bytes);
    expect_same_motion(scratch / "usd", run, max_inline_bytes == 0, 3e-7);
  }
}

TEST(Usd, TakesOtherAxesUnitsAndFrames) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const RunDirectory directory = test::record_run(scene, 5, scratch / "run");
  remove_file(directory.values(3));
  ExportChoice choice;
  choice.first = 2;
  choice.up = 'z';
  choice.scale = 100;
  const ExportedRun run = exported(directory, scene, choice);
  EXPECT_EQ(write(run, scratch / "usd", 0).size(), 1U) << "a missing frame";
  expect_same_motion(scratch / "usd", run, true, 1e-7);
  const std::string head = Usda(scratch / "usd" / "run.usda").metadata("/");
  for (const char* line : {"upAxis = \"Z\"", "metersPerUnit = 0.01\n", "startTimeCode = 2\n",
                           "endTimeCode = 5\n", "missingFrames = [3]"})
    EXPECT_NE(head.find(line), std::string::npos) << line;
}

TEST(Usd, OneFrameAndOneKindOfBodyAreEnough) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  for (const char* names : {"box*", "cloth", "*"}) {
    ExportChoice choice;
    choice.bodies = {names};
    choice.last = 0;
    const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene, choice);
    write(run, scratch / "usd", 0);
    expect_same_motion(scratch / "usd", run, false, 1e-7);
  }
}

// q and -q are the same rotation. A viewer that interpolates between opposite signs would spin the body, so
// consecutive frames must have a positive dot product.
TEST(Usd, QuaternionsTakeTheShorterArc) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const auto flip = [](FrameValues& values) {
    if (values.frame % 2 != 0)
      for (RigidMotion& motion : values.rigid) motion.pose.orientation.coeffs() *= -1;
  };
  const ExportedRun run = exported(test::record_run(scene, 4, scratch / "run", flip), scene);
  write(run, scratch / "usd");
  const Usda usda(scratch / "usd" / "run.usda");
  for (int frame = 1; frame <= 4; ++frame) {
    const std::vector<double> a = usda.numbers("/run/bodies/box1", "xformOp:orient", frame - 1),
                              b = usda.numbers("/run/bodies/box1", "xformOp:orient", frame);
    EXPECT_GT(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], 0);
  }
}

TEST(Usd, AlikeBodiesShareTheirShape) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  write(run, scratch / "usd");
  const Usda usda(scratch / "usd" / "run.usda");
  EXPECT_EQ(usda.metadata("/run/bodies/box1/box1"), usda.metadata("/run/bodies/box2/box2"));
  EXPECT_NE(usda.metadata("/run/bodies/box1/box1"), usda.metadata("/run/bodies/box3/box3"));
  EXPECT_TRUE(usda.has_prim("/shapes/box1"));
  EXPECT_FALSE(usda.has_prim("/shapes/box2"));
}

TEST(Usd, CarriesLooksCameraAndLights) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  scene.looks.emplace_back().name = "blue glass";
  scene.looks.back().color = Vec3(0.2, 0.4, 0.9);
  scene.looks.back().metallic = 0.25;
  scene.looks.back().roughness = 0.1;
  scene.looks.back().opacity = 0.5;
  scene.rigid[1].look = "blue glass";
  scene.camera.position = Vec3(1, 2, 8);
  scene.camera.vertical_fov = 40;
  scene.camera.keyframes.resize(2);
  scene.camera.keyframes[1].time = 0.1;
  scene.camera.keyframes[1].position = Vec3(4, 2, 6);
  scene.camera.keyframes[1].vertical_fov = 20;
  scene.lights.emplace_back().power = 400;
  scene.lights.push_back(scene.lights.back());
  scene.lights.back().kind = scene::LightKind::point;
  const ExportedRun run = exported(test::record_run(scene, 3, scratch / "run"), scene);
  EXPECT_TRUE(write(run, scratch / "usd").empty());
  const Usda usda(scratch / "usd" / "run.usda");
  EXPECT_EQ(usda.text("/run/bodies/box1/box1", "material:binding", 0), "</run/materials/blue_glass>");
  EXPECT_NE(usda.metadata("/run/materials/blue_glass").find("displayName = \"blue glass\""),
            std::string::npos);
  const std::string surface = "/run/materials/blue_glass/surface";
  EXPECT_EQ(usda.text(surface, "info:id", 0), "\"UsdPreviewSurface\"");
  EXPECT_EQ(usda.vectors(surface, "inputs:diffuseColor").at(0), Vec3(0.2, 0.4, 0.9));
  EXPECT_EQ(usda.numbers(surface, "inputs:metallic").at(0), 0.25);
  EXPECT_EQ(usda.numbers(surface, "inputs:opacity").at(0), 0.5);
  const scene::CameraPath path(scene.camera);
  for (int frame = 0; frame < 4; ++frame) {
    const scene::Camera camera = path.at(frame / 24.0);
    const double focal = usda.numbers("/run/camera", "focalLength", frame).at(0);
    const double height = usda.numbers("/run/camera", "verticalAperture").at(0);
    EXPECT_NEAR(2 * std::atan(height / (2 * focal)), camera.vertical_fov * std::numbers::pi / 180, 1e-12);
    EXPECT_NEAR(usda.numbers("/run/camera", "horizontalAperture").at(0) / height, 1280.0 / 720, 1e-12);
    EXPECT_LT((usda.vectors("/run/camera", "xformOp:translate", frame).at(0) - camera.position).norm(),
              1e-12);
    const std::vector<double> q = usda.numbers("/run/camera", "xformOp:orient", frame);
    const Vec3 forward = Quat(q[0], q[1], q[2], q[3]) * -Vec3::UnitZ();
    EXPECT_LT((forward - (camera.target - camera.position).normalized()).norm(), 1e-12);
  }
  const std::vector<std::string> lights{"/run/lights/_", "/run/lights/__2"};
  // Far away, a sphere light of radius r and radiance L gives the irradiance pi r^2 L / d^2, which must equal
  // that of the scene's light, power / (4 pi d^2).
  for (const std::string& light : lights) {
    const double radius = usda.numbers(light, "inputs:radius").at(0);
    const double radiance =
        usda.numbers(light, "inputs:intensity").at(0) / (4 * std::numbers::pi * radius * radius);
    const double distance = 7;
    EXPECT_NEAR(std::numbers::pi * radius * radius * radiance / (distance * distance),
                400 / (4 * std::numbers::pi * distance * distance), 1e-12);
  }
}

TEST(Usd, NamesBecomeIdentifiersOfTheirOwn) {
  const ScratchFolder scratch;
  scene::Scene scene = test::one_of_each();
  const std::vector<std::string> names{"a b", "a/b", "a\"b", "Würfel 木", "2nd\nline\\"};
  for (std::size_t i = 0; i < names.size(); ++i) scene.rigid[i].name = names[i];
  scene.deformable[0].name = "a_b";
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  write(run, scratch / "usd", 0);
  const Usda usda(scratch / "usd" / "run.usda");
  for (const char* name : {"a_b", "a_b_2", "a_b_3", "W__rfel____", "_2nd_line_", "a_b_4"})
    EXPECT_TRUE(usda.has_prim(std::string("/run/bodies/") + name)) << name;
  EXPECT_NE(usda.metadata("/run/bodies/a_b_3").find(R"(displayName = "a\"b")"), std::string::npos);
  EXPECT_NE(usda.metadata("/run/bodies/_2nd_line_").find(R"(displayName = "2nd\x0aline\\")"),
            std::string::npos);
  EXPECT_NE(usda.metadata("/run/bodies/W__rfel____").find("displayName = \"Würfel 木\""), std::string::npos);
  const Usda clip(scratch / "usd" / frame_name(1));
  EXPECT_TRUE(clip.has_prim("/run/bodies/a_b_4/a_b_4"));
}

TEST(Usd, RefusesStagesAboveTheBound) {
  const ScratchFolder scratch;
  const scene::Scene scene = test::one_of_each();
  const ExportedRun run = exported(test::record_run(scene, 1, scratch / "run"), scene);
  FormatOptions options;
  options.max_bytes = 10000;
  create_folder(scratch / "usd");
  try {
    export_usd(run, options, scratch / "usd");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
  }
}

}  // namespace
}  // namespace duet::io::usd_test
