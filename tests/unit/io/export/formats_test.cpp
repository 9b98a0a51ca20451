// Tests that every format holds the numbers of the run. Files are read back by the rules of the format, and
// not by the code that wrote them.
#include <charconv>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "tests/support/text.h"
#include "tests/unit/io/export/sample_run.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/split_surface.h"

namespace duet::io::formats_test {
namespace {

using nlohmann::json;
using test::contains;
using test::SampleRun;

// A sample run, and a folder to which one format was written.
class Written {
 public:
  Written(ExportNotes (*format)(const ExportedRun&, const FormatOptions&, const fs::path&),
          const ExportChoice& choice = {}, const FormatOptions& options = {},
          const Vec3& shift = Vec3::Zero(), std::vector<int> without = {})
      : sample(shift), run(lacking(without).exported(choice)) {
    run.set_looks(test::sample_looks());
    create_folder(folder);
    notes = format(run, options, folder);
  }

  json description(const char* file = "export.json") const { return json::parse(read_file(folder / file)); }
  // Returns the surfaces of the bodies at a frame.
  std::vector<Surface> placed(int frame) const {
    std::vector<Surface> surfaces;
    const FrameValues values = run.read(frame);
    for (const ExportedBody& body : run.bodies()) {
      surfaces.push_back(body.rest);
      place(body, values, surfaces.back());
    }
    return surfaces;
  }

 private:
  const SampleRun& lacking(const std::vector<int>& frames) const {
    for (const int frame : frames) fs::remove(sample.run.values(frame));
    return sample;
  }

 public:
  const SampleRun sample;
  ExportedRun run;
  const fs::path folder = sample.scratch / "export";
  ExportNotes notes;
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

Vec3 vec3(const json& x) { return {x.at(0).get<double>(), x.at(1).get<double>(), x.at(2).get<double>()}; }

// Reads the meshes of an OBJ file. Its lines about materials, which read_obj() refuses, are left out.
std::vector<BodySurface> read_meshes(const fs::path& path) {
  std::string text;
  for (const std::string& line : split(read_file(path), '\n'))
    if (!line.starts_with("mtllib ") && !line.starts_with("usemtl ")) text += line + '\n';
  const ScratchFolder scratch;
  write_atomically(scratch / "mesh.obj", text);
  return read_obj(scratch / "mesh.obj");
}

// Takes numbers from bytes in order, of either byte order.
class Bytes {
 public:
  Bytes(std::string bytes, std::size_t at, bool is_big = false)
      : bytes_(std::move(bytes)), at_(at), is_big_(is_big) {}
  template <class Number>
  Number take() {
    std::string raw = bytes_.substr(at_, sizeof(Number));
    EXPECT_EQ(raw.size(), sizeof(Number));
    if (is_big_) std::reverse(raw.begin(), raw.end());
    at_ += sizeof(Number);
    Number value{};
    std::memcpy(&value, raw.data(), raw.size());
    return value;
  }
  template <class Number>
  Eigen::Matrix<Number, 3, 1> take3() {
    const Number x = take<Number>(), y = take<Number>(), z = take<Number>();
    return {x, y, z};
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_;
  bool is_big_;
};

TEST(ExportTransforms, HoldsAllDigitsInBothTables) {
  const Written written(export_transforms, {{}, {}, {}, 'z', 100});
  const json table = written.description("transforms.json");
  EXPECT_EQ(table.at("fps"), SampleRun::fps);
  EXPECT_EQ(table.at("up"), "z");
  EXPECT_EQ(table.at("units_per_meter"), 100);
  EXPECT_EQ(table.at("quaternion"), "w, x, y, z");
  const std::vector<std::string> rows = split(read_file(written.folder / "transforms.csv"), '\n');
  EXPECT_EQ(
      rows[0],
      "frame,time,body,x,y,z,qw,qx,qy,qz,scale,vx,vy,vz,angular_x,angular_y,angular_z,"
      "contact_force_x,contact_force_y,contact_force_z,contact_torque_x,contact_torque_y,contact_torque_z");
  ASSERT_EQ(rows.size(), 1 + 2 * 6U);
  ASSERT_EQ(table.at("frames").size(), 6U);
  for (int frame = 0; frame <= 5; ++frame) {
    const FrameValues values = written.run.read(frame);
    const json& entry = table["frames"][static_cast<std::size_t>(frame)];
    EXPECT_EQ(entry.at("frame"), frame);
    EXPECT_EQ(entry.at("time").get<double>(), values.time);
    ASSERT_EQ(entry.at("bodies").size(), 2U) << "the rigid ones";
    for (std::size_t i = 0; i < 2; ++i) {
      const json& body = entry["bodies"][i];
      const RigidMotion& motion = values.rigid[i];
      const Quat& q = motion.pose.orientation;
      EXPECT_EQ(body.at("name"), written.run.bodies()[i].name);
      EXPECT_EQ(vec3(body.at("position")), motion.pose.position);
      EXPECT_EQ(vec3(body.at("velocity")), motion.velocity);
      EXPECT_EQ(vec3(body.at("angular_velocity")), motion.angular_velocity);
      const Vec3 &force = values.contact.rigid_force[i], &torque = values.contact.rigid_torque[i];
      EXPECT_EQ(vec3(body.at("contact_force")), force);
      EXPECT_EQ(vec3(body.at("contact_torque")), torque);
      EXPECT_EQ(body.at("scale"), 1);
      EXPECT_EQ(body.at("orientation"), (json{q.w(), q.x(), q.y(), q.z()}));
      const std::vector<std::string> row = split(rows[1 + 2 * static_cast<std::size_t>(frame) + i], ',');
      ASSERT_EQ(row.size(), 23U);
      EXPECT_EQ(row[2], written.run.bodies()[i].name);
      const std::vector<double> expected = {static_cast<double>(frame),
                                            values.time,
                                            0,
                                            motion.pose.position.x(),
                                            motion.pose.position.y(),
                                            motion.pose.position.z(),
                                            q.w(),
                                            q.x(),
                                            q.y(),
                                            q.z(),
                                            1,
                                            motion.velocity.x(),
                                            motion.velocity.y(),
                                            motion.velocity.z(),
                                            motion.angular_velocity.x(),
                                            motion.angular_velocity.y(),
                                            motion.angular_velocity.z(),
                                            force.x(),
                                            force.y(),
                                            force.z(),
                                            torque.x(),
                                            torque.y(),
                                            torque.z()};
      for (std::size_t k = 0; k < row.size(); ++k)
        EXPECT_TRUE(k == 2 || std::stod(row[k]) == expected[k]) << row[k];
    }
  }
  ASSERT_EQ(written.notes.size(), 1U);
  EXPECT_TRUE(contains(written.notes[0], "2 deformable bodies are left out")) << written.notes[0];
}

TEST(ExportTransforms, RefusesAChoiceWithoutRigidBodies) {
  try {
    const Written written(export_transforms, {{"jelly*"}, {}, {}});
    ADD_FAILURE() << "no Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    EXPECT_TRUE(contains(error.what(), "none of the bodies is rigid")) << error.what();
  }
}

TEST(ExportObj, HoldsAllDigitsAndTheLooks) {
  const Written written(export_obj, {{}, 1, 4, 'z', 3});
  for (int frame = 1; frame <= 4; ++frame) {
    const std::vector<Surface> placed = written.placed(frame);
    const std::vector<BodySurface> read = read_meshes(written.folder / fmt::format("{:04}.obj", frame));
    ASSERT_EQ(read.size(), placed.size());
    for (std::size_t i = 0; i < placed.size(); ++i) {
      EXPECT_EQ(read[i].name, written.run.bodies()[i].name);
      const Surface &a = read[i].surface, &b = placed[i];
      ASSERT_EQ(a.positions.size(), b.positions.size());
      for (std::size_t k = 0; k < a.positions.size(); ++k) EXPECT_EQ(a.positions[k], b.positions[k]);
      ASSERT_EQ(a.normals.size(), b.normals.size());
      for (std::size_t k = 0; k < a.normals.size(); ++k) EXPECT_EQ(a.normals[k], b.normals[k]);
      ASSERT_EQ(a.triangles.size(), b.triangles.size());
    }
    const std::string text = read_file(written.folder / fmt::format("{:04}.obj", frame));
    EXPECT_TRUE(contains(text, "mtllib materials.mtl\no block\n")) << text.substr(0, 200);
    EXPECT_TRUE(contains(text, "usemtl Red\n"));
    EXPECT_TRUE(contains(text, "usemtl red-2\n")) << "names differ where case does not count";
  }
  EXPECT_FALSE(fs::exists(written.folder / "0000.obj"));
  const std::string materials = read_file(written.folder / "materials.mtl");
  EXPECT_TRUE(contains(
      materials, "newmtl Red\nKd 0.7 0.1 0.05\nKs 0.5 0.5 0.5\nNs 562.5\nd 1\nPr 0.25\nPm 1\nillum 2\n"))
      << materials;
  EXPECT_TRUE(contains(materials, "newmtl red-2\n"));
  EXPECT_TRUE(contains(materials, "d 0.5\n"));
  ASSERT_EQ(written.notes.size(), 1U);
  EXPECT_TRUE(contains(written.notes[0], "patterns")) << written.notes[0];
}

TEST(ExportPly, HoldsTheValuesOfEveryVertex) {
  const Written written(export_ply, {{}, {}, {}, 'z', 2});
  for (int frame = 0; frame <= 5; ++frame) {
    const std::string bytes = read_file(written.folder / fmt::format("{:04}.ply", frame));
    const std::string end = "end_header\n";
    const std::size_t head = bytes.find(end) + end.size();
    const std::string text = bytes.substr(0, head);
    EXPECT_TRUE(text.starts_with("ply\nformat binary_little_endian 1.0\n"));
    // A sharp cube has three vertices at each corner, and a smooth one as many as its texture coordinates
    // need.
    const SplitSurfaces all = split_surfaces(written.run);
    EXPECT_TRUE(contains(text, fmt::format("element vertex {}\nproperty double x\n", all.vertices.size())))
        << text;
    EXPECT_TRUE(contains(
        text, "property int body\nelement face 48\nproperty list uchar int vertex_indices\nend_header\n"))
        << text;
    EXPECT_TRUE(contains(text, "comment body 3 jelly.2\n")) << text;
    Bytes in(bytes, head);
    const std::vector<Surface> placed = written.placed(frame);
    const FrameValues values = written.run.read(frame);
    std::vector<std::vector<Vec3f>> speeds(4);
    for (std::size_t i = 0; i < 4; ++i) velocities(written.run.bodies()[i], values, speeds[i]);
    std::vector<std::pair<int, Vec3>> vertices;
    for (const SplitSurfaces::Vertex& v : all.vertices) {
      const auto body = static_cast<std::size_t>(v.body), position = static_cast<std::size_t>(v.position);
      const Vec3 x = in.take3<double>();
      EXPECT_EQ(x, placed[body].positions[position]);
      EXPECT_EQ(in.take3<float>(), placed[body].normals[static_cast<std::size_t>(v.normal)]);
      const float s = in.take<float>(), t = in.take<float>();
      EXPECT_EQ(Vec2f(s, t), placed[body].uvs[static_cast<std::size_t>(v.uv)]);
      EXPECT_EQ(in.take3<float>(), speeds[body][position]);
      const std::size_t point = (body - 2) * 8 + position;  // of deformable bodies
      for (const std::vector<float>* of_points :
           {&values.strain, &values.stress, &values.energy_density, &values.contact.pressure})
        EXPECT_EQ(in.take<float>(), body < 2 ? 0.0F : (*of_points)[point]);
      EXPECT_EQ(in.take3<float>(), body < 2 ? Vec3f(Vec3f::Zero()) : values.contact.force[point]);
      const int written_body = in.take<std::int32_t>();
      EXPECT_EQ(written_body, v.body);
      vertices.emplace_back(written_body, x);
    }
    // The triangles are those of the bodies, corner by corner.
    for (std::size_t body = 0; body < 4; ++body)
      for (const auto& triangle : placed[body].triangles) {
        EXPECT_EQ(in.take<std::uint8_t>(), 3);
        for (const Corner& corner : triangle) {
          const auto& [of, x] = vertices.at(static_cast<std::size_t>(in.take<std::int32_t>()));
          EXPECT_EQ(of, static_cast<int>(body));
          EXPECT_EQ(x, placed[body].positions[static_cast<std::size_t>(corner.position)]);
        }
      }
    EXPECT_TRUE(in.at_end());
  }
}

// Reads a point cache of either kind. It returns the points of each sample, and sets `times` to the times of
// the samples (MDD, in s) or to the first frame (PC2).
std::vector<std::vector<Vec3f>> read_cache(const fs::path& path, std::vector<float>& times) {
  const std::string bytes = read_file(path);
  const bool is_pc2 = path.extension() == ".pc2";
  Bytes in(bytes, is_pc2 ? 12 : 0, !is_pc2);
  int points = 0, samples = 0;
  times.clear();
  if (is_pc2) {
    EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
    EXPECT_EQ(in.take<std::int32_t>(), 1);
    points = in.take<std::int32_t>();
    times.push_back(in.take<float>());  // first frame
    EXPECT_EQ(in.take<float>(), 1);
    samples = in.take<std::int32_t>();
  } else {
    samples = in.take<std::int32_t>();
    points = in.take<std::int32_t>();
    for (int i = 0; i < samples; ++i) times.push_back(in.take<float>());
  }
  std::vector<std::vector<Vec3f>> cache(static_cast<std::size_t>(samples));
  for (auto& sample : cache)
    for (int i = 0; i < points; ++i) sample.push_back(in.take3<float>());
  EXPECT_TRUE(in.at_end()) << path;
  return cache;
}

// Checks that the cache of every body moves the vertices of its mesh to where the run has them, up to the
// rounding of floats about `origin`, and that the origin is zero only without a `shift`.
void expect_caches(const Written& written, const std::string& format, const Vec3& shift) {
  const json description = written.description();
  EXPECT_EQ(description.at("first_frame"), 1);
  ASSERT_EQ(description.at("bodies").size(), 4U);
  std::vector<float> times;
  for (std::size_t b = 0; b < 4; ++b) {
    const json& body = description["bodies"][b];
    EXPECT_EQ(body.at("cache"), written.run.bodies()[b].name + "." + format);
    const auto cache = read_cache(written.folder / body.at("cache").get<std::string>(), times);
    const auto mesh = read_meshes(written.folder / body.at("mesh").get<std::string>());
    const Vec3 origin = vec3(body.at("origin"));
    EXPECT_EQ(origin.norm() == 0, shift.norm() == 0);
    ASSERT_EQ(mesh.size(), 1U);
    ASSERT_EQ(cache.size(), 4U) << "frames 1 to 4";
    for (std::size_t i = 0; i < 8; ++i)
      EXPECT_EQ(cache[0][i], mesh[0].surface.positions[i].cast<float>())
          << "vertex by vertex those of the mesh";
    for (int frame = 1; frame <= 4; ++frame) {
      const std::vector<Surface> placed = written.placed(frame);
      const auto& sample = cache[static_cast<std::size_t>(frame) - 1];
      ASSERT_EQ(sample.size(), 8U);
      for (std::size_t i = 0; i < 8; ++i)
        EXPECT_LT((sample[i].cast<double>() + origin - placed[b].positions[i]).norm(), 2e-6) << frame;
    }
  }
  if (format == "pc2") {
    EXPECT_EQ(times, std::vector<float>{1});
  } else {
    ASSERT_EQ(times.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(times[i], static_cast<float>(i / SampleRun::fps));
  }
}

TEST(ExportCaches, MoveTheVerticesOfTheirMeshes) {
  for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(1e6, -3e6, 2e5)}) {
    expect_caches(Written(export_pc2, {{}, 1, 4, 'z', 1}, {}, shift), "pc2", shift);
    expect_caches(Written(export_mdd, {{}, 1, 4, 'y', 1}, {}, shift), "mdd", shift);
  }
}

TEST(ExportCaches, AMissingFrameShowsTheOneBefore) {
  const Written written(export_pc2, {}, {}, Vec3::Zero(), {2, 3});
  std::vector<float> times;
  const auto cache = read_cache(written.folder / "jelly.pc2", times);
  ASSERT_EQ(cache.size(), 6U);
  EXPECT_EQ(cache[2], cache[1]);
  EXPECT_EQ(cache[3], cache[1]);
  EXPECT_NE(cache[4], cache[1]);
  EXPECT_LT((cache[4][3].cast<double>() - written.placed(4)[2].positions[3]).norm(), 1e-6);
  ASSERT_EQ(written.notes.size(), 2U);
  EXPECT_TRUE(contains(written.notes[1], "missing shows the one before")) << written.notes[1];
}

// Reads the arrays of a .vtp file by their names, from raw or compressed appended data.
class PolyFile {
 public:
  explicit PolyFile(const fs::path& path) : bytes_(read_file(path)) {
    const std::string mark = "<AppendedData encoding=\"raw\">\n_";
    data_ = bytes_.find(mark) + mark.size();
    xml_ = bytes_.substr(0, data_);
    EXPECT_TRUE(bytes_.ends_with("\n</AppendedData>\n</VTKFile>\n"));
  }
  const std::string& xml() const { return xml_; }
  template <class Value>
  std::vector<Value> array(const std::string& name) const {
    const std::size_t at = xml_.find(fmt::format("Name=\"{}\"", name)), offset = xml_.find("offset=\"", at);
    EXPECT_NE(at, std::string::npos) << name;
    const std::string raw = contains(xml_, "vtkZLibDataCompressor") ? unpacked(number(xml_, offset + 8))
                                                                    : plain(number(xml_, offset + 8));
    std::vector<Value> values(raw.size() / sizeof(Value));
    std::memcpy(static_cast<void*>(values.data()), raw.data(), raw.size());
    return values;
  }

 private:
  static std::size_t number(const std::string& text, std::size_t at) {
    std::size_t value = 0;
    std::from_chars(text.data() + at, text.data() + text.size(), value);
    return value;
  }
  std::size_t count(std::size_t& at) const {
    std::uint64_t value = 0;
    std::memcpy(&value, bytes_.data() + at, sizeof(value));
    at += sizeof(value);
    return value;
  }
  std::string plain(std::size_t offset) const {
    std::size_t at = data_ + offset;
    const std::size_t size = count(at);
    return bytes_.substr(at, size);
  }
  std::string unpacked(std::size_t offset) const {
    std::size_t at = data_ + offset;
    const std::size_t blocks = count(at), block = count(at), last = count(at);
    std::vector<std::size_t> sizes(blocks);
    for (std::size_t& size : sizes) size = count(at);
    std::string raw;
    for (std::size_t i = 0; i < blocks; ++i) {
      uLongf length = i + 1 == blocks && last > 0 ? last : block;
      std::string piece(length, '\0');
      EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(piece.data()), &length,
                           reinterpret_cast<const Bytef*>(bytes_.data() + at), sizes[i]),
                Z_OK);
      EXPECT_EQ(length, piece.size());
      raw += piece;
      at += sizes[i];
    }
    return raw;
  }

  std::string bytes_, xml_;
  std::size_t data_ = 0;
};

TEST(ExportVtk, HoldsTheFieldsOfEveryVertex) {
  for (const bool compress : {false, true}) {
    FormatOptions options;
    options.compress = compress;
    const Written written(export_vtk, {{}, 2, 5, 'z', 2}, options);
    const SplitSurfaces all = split_surfaces(written.run);
    const std::vector<Surface> first = written.placed(2);
    const std::string collection = read_file(written.folder / "run.pvd");
    for (int frame = 2; frame <= 5; ++frame) {
      const FrameValues values = written.run.read(frame);
      EXPECT_TRUE(contains(collection,
                           fmt::format("timestep=\"{}\" part=\"0\" file=\"{:04}.vtp\"", values.time, frame)))
          << collection;
      const PolyFile file(written.folder / fmt::format("{:04}.vtp", frame));
      EXPECT_EQ(contains(file.xml(), "compressor"), compress);
      EXPECT_TRUE(contains(file.xml(), "106 101 108 108 121 0\n")) << "jelly";
      const auto points = file.array<Vec3>("points");
      const auto displacement = file.array<Vec3f>("displacement"), velocity = file.array<Vec3f>("velocity"),
                 normal = file.array<Vec3f>("normal");
      const auto strain = file.array<float>("strain"), stress = file.array<float>("stress"),
                 energy = file.array<float>("energy_density"),
                 pressure = file.array<float>("contact_pressure");
      const auto force = file.array<Vec3f>("contact_force");
      const std::vector<Surface> placed = written.placed(frame);
      ASSERT_EQ(points.size(), all.vertices.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        const SplitSurfaces::Vertex& v = all.vertices[i];
        const auto body = static_cast<std::size_t>(v.body), position = static_cast<std::size_t>(v.position);
        EXPECT_EQ(points[i], placed[body].positions[position]);
        EXPECT_EQ(displacement[i], (points[i] - first[body].positions[position]).cast<float>());
        EXPECT_EQ(normal[i], placed[body].normals[static_cast<std::size_t>(v.normal)]);
        EXPECT_EQ(strain[i], body < 2 ? 0.0F : values.strain[(body - 2) * 8 + position]);
        EXPECT_EQ(stress[i], body < 2 ? 0.0F : values.stress[(body - 2) * 8 + position]);
        EXPECT_EQ(energy[i], body < 2 ? 0.0F : values.energy_density[(body - 2) * 8 + position]);
        EXPECT_EQ(pressure[i], body < 2 ? 0.0F : values.contact.pressure[(body - 2) * 8 + position]);
        EXPECT_EQ(force[i],
                  body < 2 ? Vec3f(Vec3f::Zero()) : values.contact.force[(body - 2) * 8 + position]);
        std::vector<Vec3f> speeds;
        velocities(written.run.bodies()[body], values, speeds);
        EXPECT_EQ(velocity[i], speeds[position]);
      }
      const auto connectivity = file.array<std::int64_t>("connectivity"),
                 offsets = file.array<std::int64_t>("offsets");
      const auto body = file.array<std::int32_t>("body");
      ASSERT_EQ(offsets.size(), 48U);
      ASSERT_EQ(body.size(), 48U);
      ASSERT_EQ(connectivity.size(), 3 * 48U);
      for (std::size_t t = 0; t < 48; ++t) {
        EXPECT_EQ(offsets[t], static_cast<std::int64_t>(3 * (t + 1)));
        EXPECT_EQ(body[t], static_cast<std::int32_t>(t / 12));
        const auto& triangle = placed[t / 12].triangles[t % 12];
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_EQ(points.at(static_cast<std::size_t>(connectivity[3 * t + k])),
                    placed[t / 12].positions[static_cast<std::size_t>(triangle[k].position)]);
      }
    }
  }
}

// Every vertex of the run occurs once for each pair of normal and texture coordinates that a triangle gives
// it, and no more often.
TEST(SplitSurfaces, HaveOneNormalAVertex) {
  const SampleRun sample;
  const ExportedRun run = sample.exported();
  const SplitSurfaces all = split_surfaces(run);
  std::set<std::array<int, 4>> seen;
  for (const SplitSurfaces::Vertex& v : all.vertices)
    EXPECT_TRUE(seen.insert({v.body, v.position, v.uv, v.normal}).second);
  EXPECT_EQ(
      std::count_if(all.vertices.begin(), all.vertices.end(), [](const auto& v) { return v.body == 0; }), 24);
  EXPECT_TRUE(std::is_sorted(all.vertices.begin(), all.vertices.end(), [](const auto& a, const auto& b) {
    return std::pair(a.body, a.position) < std::pair(b.body, b.position);
  }));
  EXPECT_TRUE(all.has_deformable);
  EXPECT_FALSE(split_surfaces(sample.exported({{"block"}, {}, {}})).has_deformable);
}

TEST(ExportNames, AreSafeAndDifferWhereCaseDoesNotCount) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(
      safe_names({"ball", "Ball", "ball-2", "a/b", "a\\b", "../x", "", ".", "nul.txt", "COM7", "-r", "x."}),
      (Names{"ball", "Ball-2", "ball-2-2", "a_b", "a_b-2", "_.._x", "_", "__", "_nul.txt", "_COM7", "_-r",
             "x_"}));
  EXPECT_LE(safe_names({std::string(5000, 'x')})[0].size(), 100U);
}

TEST(ExportDescription, HasTheViewInTheAxesOfTheExport) {
  const SampleRun sample;
  ExportedRun run = sample.exported({{}, {}, {}, 'z', 10});
  run.set_looks(test::sample_looks());
  const json object = description(run, "obj");
  EXPECT_LT((vec3(object.at("camera").at("position")) - Vec3(0, -100, 20)).norm(), 1e-12);
  EXPECT_LT((vec3(object.at("camera").at("up")) - Vec3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((vec3(object.at("lights").at(0).at("position")) - Vec3(10, -30, 20)).norm(), 1e-12);
  EXPECT_FALSE(object.at("camera").contains("motion"));
  EXPECT_EQ(object.at("bodies").at(2).at("look"), "Red");
  EXPECT_EQ(object.at("missing_frames"), json::array());
}

TEST(ExportDescription, HasACameraThatMovesAtEveryFrame) {
  const SampleRun sample;
  ExportedRun run = sample.exported({{}, 1, 4});
  ExportedLooks looks = test::sample_looks();
  looks.camera.keyframes = {{0, Vec3(0, 0, 10), std::nullopt, 20},
                            {4 / SampleRun::fps, Vec3(4, 0, 10), std::nullopt, std::nullopt}};
  run.set_looks(looks);
  const json motion = description(run, "obj").at("camera").at("motion");
  ASSERT_EQ(motion.size(), 4U);
  EXPECT_EQ(motion[0].at("frame"), 1);
  EXPECT_LT((vec3(motion[3].at("position")) - Vec3(4, 0, 10)).norm(), 1e-12);
  EXPECT_NEAR(motion[3].at("vertical_fov"), 30, 1e-12);
}

}  // namespace
}  // namespace duet::io::formats_test
