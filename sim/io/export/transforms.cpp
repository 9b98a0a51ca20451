// Writes the format `transforms`: the poses and velocities of the rigid bodies at each frame, and the forces
// of contact on them, as JSON and as CSV, with all digits of the doubles.
#include <array>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/text_builder.h"

namespace duet::io {
namespace {

// Bytes of JSON that are gathered before both tables are written. A larger value needs more memory and
// saves few calls of the system.
constexpr std::size_t piece_bytes = 1 << 20;

// Returns a JSON string with its quotes. Bytes that are not UTF-8 become U+FFFD.
std::string json_string(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Returns a field of CSV, quoted if need be (RFC 4180).
std::string csv_string(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::array<double, 4> wxyz(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// Appends `before` and a JSON array.
template <class Numbers>
void add_array(TextBuilder& text, std::string_view before, const Numbers& values) {
  text.add(before);
  char separator = '[';
  for (const double value : values) {
    text.add({&separator, 1});
    text.number(value);
    separator = ',';
  }
  text.add("]");
}

// Writes the two files row by row.
class Tables {
 public:
  explicit Tables(const fs::path& folder)
      : json_(folder / "transforms.json"), csv_(folder / "transforms.csv") {}

  void begin(const ExportedRun& run) {
    nlohmann::ordered_json head = description(run, "transforms");
    head["quaternion"] = "w, x, y, z";
    std::string text = head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    text.pop_back();  // removes the closing brace: the frames follow
    json_text_.add(text);
    json_text_.add(",\n\"frames\":[");
    csv_text_.add(
        "frame,time,body,x,y,z,qw,qx,qy,qz,scale,vx,vy,vz,angular_x,angular_y,angular_z,contact_force_x,"
        "contact_force_y,contact_force_z,contact_torque_x,contact_torque_y,contact_torque_z\n");
  }
  void begin_frame(const FrameValues& values) {
    json_text_.add(frames_++ == 0 ? "\n{\"frame\":" : ",\n{\"frame\":");
    json_text_.number(values.frame);
    json_text_.add(",\"time\":");
    json_text_.number(values.time);
    json_text_.add(",\"bodies\":[");
    rows_ = 0;
  }
  // Adds the rigid body with this row. Fields of contact are left out, or empty in CSV, if the frame has
  // none.
  void add(const FrameValues& values, const std::string& json_name, const std::string& csv_name,
           std::size_t row) {
    const RigidMotion& motion = values.rigid.at(row);
    const ContactLoads& contact = values.contact;
    const bool has_contact = row < contact.rigid_force.size();
    TextBuilder& json = json_text_;
    json.add(rows_++ == 0 ? "\n{\"name\":" : ",\n{\"name\":");
    json.add(json_name);
    add_array(json, ",\"position\":", motion.pose.position);
    add_array(json, ",\"orientation\":", wxyz(motion.pose.orientation));
    json.add(",\"scale\":1");
    add_array(json, ",\"velocity\":", motion.velocity);
    add_array(json, ",\"angular_velocity\":", motion.angular_velocity);
    if (has_contact) {
      add_array(json, ",\"contact_force\":", contact.rigid_force[row]);
      add_array(json, ",\"contact_torque\":", contact.rigid_torque[row]);
    }
    json.add("}");

    TextBuilder& csv = csv_text_;
    csv.number(values.frame);
    csv.add(",");
    csv.number(values.time);
    csv.add(",");
    csv.add(csv_name);
    csv.numbers(',', motion.pose.position);
    csv.numbers(',', wxyz(motion.pose.orientation));
    csv.add(",1");
    csv.numbers(',', motion.velocity);
    csv.numbers(',', motion.angular_velocity);
    if (has_contact) {
      csv.numbers(',', contact.rigid_force[row]);
      csv.numbers(',', contact.rigid_torque[row]);
    } else {
      csv.add(",,,,,,");
    }
    csv.add("\n");
    if (json.size() > piece_bytes) flush();
  }
  void end_frame() { json_text_.add("]}"); }
  void end() {
    json_text_.add("]}\n");
    flush();
    json_.close();
    csv_.close();
  }

 private:
  void flush() {
    json_.write(json_text_.view());
    csv_.write(csv_text_.view());
    json_text_.clear();
    csv_text_.clear();
  }

  OutputFile json_, csv_;
  TextBuilder json_text_, csv_text_;
  int frames_ = 0, rows_ = 0;  // number of frames so far, and of rows of this frame
};

}  // namespace

ExportNotes export_transforms(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  std::vector<std::string> json_names, csv_names;
  std::size_t deformable = 0;
  for (const ExportedBody& body : run.bodies()) {
    json_names.push_back(json_string(body.name));
    csv_names.push_back(csv_string(body.name));
    deformable += body.is_rigid() ? 0 : 1;
  }
  if (deformable == run.bodies().size())
    throw Error(
        ExitStatus::usage,
        "--to transforms: none of the bodies is rigid, and only rigid bodies have transforms (pc2, mdd, "
        "vtk, ply and obj hold deformable bodies)");
  Tables tables(folder);
  tables.begin(run);
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    tables.begin_frame(values);
    for (std::size_t i = 0; i < run.bodies().size(); ++i)
      if (const ExportedBody& body = run.bodies()[i]; body.is_rigid())
        tables.add(values, json_names[i], csv_names[i], static_cast<std::size_t>(body.row));
    tables.end_frame();
  }
  tables.end();
  if (deformable == 0) return {};
  return {
      fmt::format("{} deformable {} left out, which no transform describes (pc2, mdd, vtk, ply and obj hold "
                  "them)",
                  deformable, deformable == 1 ? "body is" : "bodies are")};
}

}  // namespace duet::io
