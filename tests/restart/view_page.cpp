#include "tests/restart/view_page.h"

#include <bit>
#include <stdexcept>

#include <zlib.h>

namespace duet::test::view_page {
namespace {

std::string from_base64(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::size_t value = letters.find(c);
    if (value == std::string::npos) throw std::runtime_error("no base 64");
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xffU);
  }
  return bytes;
}

std::string inflated(const std::string& packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::runtime_error("no zlib");
  std::string in = packed, out, piece(1 << 16, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  int status = Z_OK;
  while (status == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    status = inflate(&stream, Z_NO_FLUSH);
    out.append(piece, 0, piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END) throw std::runtime_error("no zlib stream");
  return out;
}

// The text between `begin` and "</script>", from `at` on, which moves behind it; nothing where there is none.
std::string next_element(const std::string& html, const std::string& begin, std::size_t& at) {
  const std::size_t start = html.find(begin, at);
  if (start == std::string::npos) return {};
  const std::size_t end = html.find("</script>", start);
  at = end;
  return html.substr(start + begin.size(), end - start - begin.size());
}

struct Reader {
  const std::string& bytes;
  std::size_t at = 0;

  std::uint8_t byte() { return static_cast<std::uint8_t>(bytes.at(at++)); }
  std::uint32_t number() {
    std::uint32_t x = 0;
    for (int shift = 0; shift < 32; shift += 8) x |= static_cast<std::uint32_t>(byte()) << shift;
    return x;
  }
};

// The values of root_byte, of which 255 is `largest`.
std::vector<double> from_root_bytes(const std::vector<std::uint8_t>& bytes, double largest) {
  std::vector<double> values;
  for (const std::uint8_t byte : bytes) values.push_back(largest * byte * byte / (255.0 * 255.0));
  return values;
}

bool is_rigid(const nlohmann::json& body) { return body.at("kind") != "deformable"; }

// A row of ByteRows: differences from the row before, which it becomes.
void read_bytes(Reader& reader, std::vector<std::uint8_t>& row) {
  for (std::uint8_t& x : row) x = static_cast<std::uint8_t>(x + reader.byte());
}

// A row of ByteRows that may be left out: `row` is empty then.
void read_sparse(Reader& reader, std::vector<std::uint8_t>& before, std::vector<std::uint8_t>& row) {
  row.clear();
  if (reader.byte() == 0) return;
  read_bytes(reader, before);
  row = before;
}

// A row of PositionRows, from the two before, which move on.
void read_points(Reader& reader, std::vector<std::uint16_t>& before,
                 std::vector<std::uint16_t>& before_that) {
  const std::size_t size = before.size() / 3;
  const int way = reader.byte();
  std::vector<std::uint16_t> row(before.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    int last = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const auto low = static_cast<std::uint8_t>(reader.bytes.at(reader.at + i));
      const auto high = static_cast<std::uint8_t>(reader.bytes.at(reader.at + size + i));
      const int folded = low + 256 * high;
      int off = folded % 2 == 0 ? folded / 2 : -(folded + 1) / 2;
      if ((way & 2) != 0) off += last;
      last = off;
      const std::size_t k = axis * size + i;
      row[k] =
          static_cast<std::uint16_t>(before[k] + off + ((way & 1) != 0 ? before[k] - before_that[k] : 0));
    }
    reader.at += 2 * size;
  }
  before_that = before;
  before = row;
}

}  // namespace

ViewPage::ViewPage(const std::string& html) {
  std::size_t at = 0;
  run_ = nlohmann::json::parse(next_element(html, "<script type=\"application/json\" id=\"run\">", at));
  const std::string block = "<script type=\"text/plain\" class=\"block\">";
  const std::string meshes = next_element(html, block, at);
  if (meshes.empty()) return;
  read_meshes(inflated(from_base64(meshes)));
  for (std::string text; !(text = next_element(html, block, at)).empty();)
    read_frames(inflated(from_base64(text)));
}

std::size_t ViewPage::index_of(const std::string& body) const {
  const nlohmann::json& bodies = run_.at("bodies");
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (bodies[i].at("name") == body) return i;
  throw std::runtime_error("no body " + body);
}

void ViewPage::read_meshes(const std::string& bytes) {
  Reader reader{bytes};
  std::size_t numbers = 0;
  for (const nlohmann::json& body : run_.at("bodies")) {
    first_number_.push_back(numbers);
    numbers += 16;
    const std::size_t mesh = body.at("mesh");
    const std::size_t positions = run_.at("meshes").at(mesh).at("positions");
    before_.points.emplace_back(is_rigid(body) ? 0 : 3 * positions);
    for (auto* rows : {&before_.near, &before_.speed, &before_.strain, &before_.stress, &before_.pressure})
      rows->emplace_back(positions);
    if (mesh < rest_.size()) continue;
    const nlohmann::json& listed = run_.at("meshes").at(mesh);
    rest_.emplace_back();
    for (std::size_t i = 0; i < positions && is_rigid(body); ++i) {
      Vec3 x;
      for (int axis = 0; axis < 3; ++axis)
        x[axis] = static_cast<double>(std::bit_cast<float>(reader.number()));
      rest_.back().push_back(x);
    }
    const std::size_t vertices = listed.at("vertices"), triangles = listed.at("triangles"),
                      normals = listed.at("normals");
    reader.at += 4 * ((is_rigid(body) ? 3 * normals : 0) + 2 * vertices +
                      (listed.at("uv") ? 2 * vertices : 0) + 3 * triangles);
  }
  before_.numbers.resize(numbers);
  before_that_ = before_;
  if (reader.at != bytes.size()) throw std::runtime_error("the meshes end elsewhere");
}

void ViewPage::read_frames(const std::string& bytes) {
  Reader reader{bytes};
  const std::size_t count = before_.points.size();
  static_assert(sizeof(float) == 4);
  while (reader.at < bytes.size()) {
    const std::size_t numbers = before_.numbers.size();
    for (std::size_t i = 0; i < numbers; ++i) {
      std::uint32_t change = 0;
      for (std::size_t plane = 0; plane < 4; ++plane)
        change |=
            static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes.at(reader.at + plane * numbers + i)))
            << 8 * plane;
      before_.numbers[i] = std::bit_cast<float>(std::bit_cast<std::uint32_t>(before_.numbers[i]) ^ change);
    }
    reader.at += 4 * numbers;
    for (std::size_t i = 0; i < count; ++i) {
      const nlohmann::json& body = run_.at("bodies")[i];
      if (is_rigid(body)) continue;
      read_points(reader, before_.points[i], before_that_.points[i]);
      read_bytes(reader, before_.speed[i]);
      if (body.at("strain")) read_bytes(reader, before_.strain[i]);
      if (body.at("stress")) read_bytes(reader, before_.stress[i]);
    }
    State state = before_;
    for (std::size_t i = 0; i < count; ++i) read_sparse(reader, before_.near[i], state.near[i]);
    if (!run_.at("max_pressure").is_null())
      for (std::size_t i = 0; i < count; ++i)
        if (!is_rigid(run_.at("bodies")[i])) read_sparse(reader, before_.pressure[i], state.pressure[i]);
    states_.push_back(std::move(state));
  }
}

std::vector<Vec3> ViewPage::positions(const std::string& body, std::size_t frame) const {
  const std::size_t i = index_of(body);
  const nlohmann::json& listed = run_.at("bodies")[i];
  const State& state = states_.at(frame);
  const auto vector = [](const nlohmann::json& x) { return Vec3(x.at(0), x.at(1), x.at(2)); };
  const auto number = [&](std::size_t k) { return static_cast<double>(state.numbers[first_number_[i] + k]); };
  const Vec3 place(number(0), number(1), number(2)), origin = vector(run_.at("origin"));
  std::vector<Vec3> positions;
  if (is_rigid(listed)) {
    const Quat turn(number(3), number(4), number(5), number(6));
    for (const Vec3& x : rest_.at(listed.at("mesh"))) positions.push_back(turn * x + place + origin);
    return positions;
  }
  const Vec3 extent = vector(listed.at("extent"));
  const std::size_t size = state.points[i].size() / 3;
  for (std::size_t k = 0; k < size; ++k) {
    Vec3 x;
    for (int axis = 0; axis < 3; ++axis)
      x[axis] = place[axis] + extent[axis] * (state.points[i][as_index(axis) * size + k] / 65535.0 - 0.5) +
                origin[axis];
    positions.push_back(x);
  }
  return positions;
}

std::vector<std::uint8_t> ViewPage::near(const std::string& body, std::size_t frame) const {
  return states_.at(frame).near.at(index_of(body));
}

std::vector<double> ViewPage::stress(const std::string& body, std::size_t frame) const {
  return from_root_bytes(states_.at(frame).stress.at(index_of(body)), run_.at("max_stress"));
}

std::vector<double> ViewPage::pressure(const std::string& body, std::size_t frame) const {
  return from_root_bytes(states_.at(frame).pressure.at(index_of(body)), run_.at("max_pressure"));
}

Vec3 ViewPage::contact_force(const std::string& body, std::size_t frame) const {
  const std::size_t i = index_of(body);
  const std::size_t first = first_number_[i] + (is_rigid(run_.at("bodies")[i]) ? 13 : 11);
  Vec3 force;
  for (std::size_t axis = 0; axis < 3; ++axis)
    force[static_cast<int>(axis)] = static_cast<double>(states_.at(frame).numbers.at(first + axis));
  return force;
}

}  // namespace duet::test::view_page
