#include "sim/geometry/files/tet_mesh_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <unordered_map>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet {
namespace {

// Reads a text file word by word and knows the line of the last word, for messages.
class Words {
 public:
  explicit Words(const std::string& path) : path_(path) {
    text_ = io::read_file(path);
    if (text_.starts_with("\xef\xbb\xbf")) text_.erase(0, 3);  // a byte order mark, as some editors put it
  }

  // Returns the next word, a view of the text of the file; empty at its end. Comments run from # to the end
  // of the line.
  std::string_view next() {
    while (at_ < text_.size() && (is_space(text_[at_]) || text_[at_] == '#'))
      if (text_[at_] == '#')
        skip_line();
      else
        line_ += text_[at_++] == '\n' ? 1 : 0;
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return std::string_view(text_).substr(begin, at_ - begin);
  }

  void skip(std::size_t words) {
    for (std::size_t i = 0; i < words; ++i) next();
  }

  // Returns how many numbers follow until a word that is none, or `most` if there are more. Reads no word.
  std::size_t numbers_ahead(std::size_t most) {
    const std::size_t at = at_;
    const int line = line_;
    std::size_t count = 0;
    while (count < most && is_number(next())) ++count;
    at_ = at;
    line_ = line;
    return count;
  }

  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }

  // Reads a number. Throws FileError if the next word is none; `what` names the number in the message.
  template <class Number>
  Number number(const char* what) {
    const std::string_view word = next();
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      fail(fmt::format("expected {}, found `{}`", what, word.substr(0, 40)));
    return value;
  }

  // Reads a count of items. Each item takes at least two characters, so that a damaged count never asks for
  // more memory than the file has.
  std::size_t count(const char* what) {
    const auto value = number<long long>(what);
    if (value < 0 || value > static_cast<long long>(text_.size() / 2))
      fail(fmt::format("{} is {}, which the file has no room for", what, value));
    return static_cast<std::size_t>(value);
  }

  void expect(std::string_view wanted) {
    if (const std::string_view word = next(); word != wanted)
      fail(fmt::format("expected {}, found `{}`", wanted, word.substr(0, 40)));
  }

  [[noreturn]] void fail(const std::string& what,
                         const char* remedy = "export the mesh again, as text") const {
    throw FileError(path_, fmt::format("line {}: {}", line_, what), remedy);
  }

 private:
  // Also true for words that begin like a number: damaged ones.
  static bool is_number(std::string_view word) {
    double value = 0;
    return !word.empty() &&
           (std::string_view("+-.0123456789").find(word[0]) != std::string_view::npos ||
            std::from_chars(word.data(), word.data() + word.size(), value).ec == std::errc());
  }
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

  const std::string& path_;
  std::string text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

// Reads three finite coordinates.
Vec3 read_point(Words& words) {
  Vec3 x;
  for (double& coordinate : x) {
    coordinate = words.number<double>("a coordinate");
    if (!std::isfinite(coordinate)) words.fail("a coordinate is not finite");
  }
  return x;
}

// Reads the items of a section of a Medit file by `read`: `size` numbers each. Line ends mean no more than
// blanks in this format. After each item comes its reference number, which is skipped; files that have none,
// which the format does not allow but programs write, are told from others by the count of numbers. Throws
// FileError if there are more numbers than those of the items.
template <class Read>
void read_items(Words& words, std::size_t count, std::size_t size, Read&& read) {
  const bool has_references = words.numbers_ahead(count * size + 1) != count * size;
  for (std::size_t i = 0; i < count; ++i) {
    read();
    if (has_references) words.number<double>("a reference number");
  }
  if (words.numbers_ahead(1) > 0)
    words.fail(fmt::format("more numbers follow than those of the {} items of the section", count));
}

// Reads a Medit file. Words of other sections, and the version of the format, are skipped.
TetMesh read_medit(Words& words) {
  TetMesh mesh;
  for (std::string_view word = words.next(); !word.empty() && word != "End"; word = words.next()) {
    if (word == "Dimension") {
      if (words.number<int>("the dimension") != 3)
        words.fail("the dimension is not 3", "give a mesh of tetrahedra");
    } else if (word == "Vertices") {
      const std::size_t count = words.count("the number of vertices");
      read_items(words, count, 3, [&] { mesh.nodes.push_back(read_point(words)); });
    } else if (word == "Tetrahedra") {
      const std::size_t count = words.count("the number of tetrahedra");
      read_items(words, count, 4, [&] {
        Tet tet{};
        for (int& node : tet) {
          const auto vertex = words.number<long long>("a vertex");
          if (vertex < 1 || vertex > static_cast<long long>(mesh.nodes.size()))
            words.fail(fmt::format("vertex {} is not among the {} of the mesh", vertex, mesh.nodes.size()));
          node = static_cast<int>(vertex) - 1;
        }
        mesh.tets.push_back(tet);
      });
    }
  }
  return mesh;
}

// Reads Gmsh files of versions 2 and 4.1.
class GmshReader {
 public:
  explicit GmshReader(Words& words) : words_(words) {}

  TetMesh read() {
    words_.expect("$MeshFormat");
    const auto version = words_.number<double>("the version");
    if (version != 4.1 && !(version >= 2 && version < 3))
      words_.fail(fmt::format("version {} of the format is not known", version),
                  "save it in version 2 or 4.1 as text: gmsh -save -format msh2");
    if (words_.number<int>("the file type") != 0)
      words_.fail("the file is binary", "save it as text: gmsh -save -format msh2 -bin 0");
    for (std::string_view word = words_.next(); !word.empty(); word = words_.next()) {
      if (word == "$Nodes") version < 3 ? read_nodes_2() : read_nodes_4();
      if (word == "$Elements") version < 3 ? read_elements_2() : read_elements_4();
    }
    return std::move(mesh_);
  }

 private:
  // The name of a node: any positive number.
  using Tag = long long;
  // Types of elements: tetrahedra of 4 and 10 nodes. The corners come first in both.
  static constexpr int tet4 = 4, tet10 = 11;
  // Numbers of nodes of the elements, by type from 1 on: of the lines, triangles, quads, tetrahedra,
  // hexahedra, prisms, pyramids and points of first and second order.
  static constexpr std::array<std::size_t, 19> node_counts = {2,  3,  4,  4,  8, 6, 5,  3,  6, 9,
                                                              10, 27, 18, 14, 1, 8, 20, 15, 13};

  void read_nodes_2() {
    const std::size_t count = words_.count("the number of nodes");
    for (std::size_t i = 0; i < count; ++i) {
      const Tag tag = words_.number<Tag>("a node's number");
      add_node(tag, read_point(words_));
    }
  }

  void read_elements_2() {
    const std::size_t count = words_.count("the number of elements");
    for (std::size_t i = 0; i < count; ++i) {
      words_.number<Tag>("an element's number");
      const int type = words_.number<int>("an element's type");
      const std::size_t tags = words_.count("an element's number of tags");
      for (std::size_t t = 0; t < tags; ++t) words_.number<Tag>("a tag");
      read_element(type);
    }
  }

  void read_nodes_4() {
    const std::size_t blocks = words_.count("the number of blocks");
    for (int i = 0; i < 3; ++i) words_.number<Tag>("a number of nodes");
    for (std::size_t block = 0; block < blocks; ++block) {
      const Tag dimension = words_.number<Tag>("the head of a block");
      words_.number<Tag>("the head of a block");
      const bool is_parametric = words_.number<Tag>("the head of a block") != 0;
      if (dimension < 0 || dimension > 3) words_.fail("the dimension of a block is not 0 to 3");
      std::vector<Tag> tags(words_.count("the number of nodes"));
      for (Tag& tag : tags) tag = words_.number<Tag>("a node's number");
      for (const Tag tag : tags) {
        add_node(tag, read_point(words_));
        // Skips the parameters of the point on its curve or surface.
        if (is_parametric) words_.skip(static_cast<std::size_t>(dimension));
      }
    }
  }

  void read_elements_4() {
    const std::size_t blocks = words_.count("the number of blocks");
    for (int i = 0; i < 3; ++i) words_.number<Tag>("a number of elements");
    for (std::size_t block = 0; block < blocks; ++block) {
      for (int i = 0; i < 2; ++i) words_.number<Tag>("the head of a block");
      const int type = words_.number<int>("the type of the elements");
      const std::size_t count = words_.count("the number of elements");
      for (std::size_t i = 0; i < count; ++i) {
        words_.number<Tag>("an element's number");
        read_element(type);
      }
    }
  }

  // Appends a node and remembers its number.
  void add_node(Tag tag, const Vec3& x) {
    numbers_[tag] = static_cast<int>(mesh_.nodes.size());
    mesh_.nodes.push_back(x);
  }

  // Reads the nodes of an element; only the corners of tetrahedra are kept. An element of a type whose number
  // of nodes is not known here takes the rest of its line, as Gmsh writes it.
  void read_element(int type) {
    const bool is_known = type >= 1 && type <= static_cast<int>(node_counts.size());
    std::size_t left = is_known ? node_counts[static_cast<std::size_t>(type) - 1] : 0;
    if (type == tet4 || type == tet10) {
      Tet tet{};
      for (int& node : tet) {
        const Tag tag = words_.number<Tag>("a node");
        const auto found = numbers_.find(tag);
        if (found == numbers_.end()) words_.fail(fmt::format("there is no node {}", tag));
        node = found->second;
      }
      mesh_.tets.push_back(tet);
      left -= tet.size();
    }
    if (is_known)
      words_.skip(left);
    else
      words_.skip_line();
  }

  Words& words_;
  TetMesh mesh_;
  std::unordered_map<Tag, int> numbers_;
};

}  // namespace

TetMesh read_tet_mesh(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw FileError(path, "there is no such file", "check the path");
  if (ending != ".mesh" && ending != ".msh")
    throw FileError(path, "is no file of tetrahedra that is known by its ending",
                    "use .mesh (Medit) or .msh (Gmsh); `duet tetrahedralize` makes one of a surface");
  Words words(path);
  TetMesh mesh = ending == ".mesh" ? read_medit(words) : GmshReader(words).read();
  if (mesh.tets.empty())
    throw FileError(path, "has no tetrahedron", "export the volume mesh, not the surface alone");
  return mesh;
}

std::string medit_text(const TetMesh& mesh) {
  std::string text = fmt::format("{}{}\n", medit_start, mesh.nodes.size());
  const auto out = std::back_inserter(text);
  for (const Vec3& x : mesh.nodes) fmt::format_to(out, "{} {} {} 0\n", x.x(), x.y(), x.z());
  fmt::format_to(out, "Tetrahedra\n{}\n", mesh.tets.size());
  for (const Tet& t : mesh.tets)
    fmt::format_to(out, "{} {} {} {} 0\n", t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
  return text + "End\n";
}

std::string vtk_text(const TetMesh& mesh) {
  std::string text =
      fmt::format("{}DATASET UNSTRUCTURED_GRID\nPOINTS {} double\n", vtk_start, mesh.nodes.size());
  const auto out = std::back_inserter(text);
  for (const Vec3& x : mesh.nodes) fmt::format_to(out, "{} {} {}\n", x.x(), x.y(), x.z());
  fmt::format_to(out, "CELLS {} {}\n", mesh.tets.size(), 5 * mesh.tets.size());
  for (const Tet& t : mesh.tets) fmt::format_to(out, "4 {} {} {} {}\n", t[0], t[1], t[2], t[3]);
  fmt::format_to(out, "CELL_TYPES {}\n", mesh.tets.size());
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) text += "10\n";  // the type of a tetrahedron
  return text;
}

}  // namespace duet
