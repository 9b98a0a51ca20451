// Guards the promise that the state has the same bits on every machine: nothing in sim/ may call functions
// whose bits depend on the C library, on Eigen or on the standard library. The test searches the sources for
// their names.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace duet::portable_sources_test {
namespace {

// A forbidden pattern and what to use instead of it.
struct Forbidden {
  std::regex pattern;
  std::vector<std::string> parts;  // all that the pattern matches has one of these: quick to look for
  const char* instead;
};

const std::vector<Forbidden> forbidden = {
    {std::regex(
         R"(std::(sin|cos|tan|asin|acos|atan2?|exp2?|expm1|log(2|10|1p)?|pow|hypot|cbrt|sinh|cosh|tanh|erfc?|[lt]gamma)\()"),
     {"std::"},
     "sim/base/elementary.h"},
    {std::regex(R"(std::\w+_distribution|std::shuffle|std::sample|std::random_shuffle)"),
     {"std::"},
     "scene::Random"},
    {std::regex(R"(\.(ldlt|llt|partialPivLu|fullPivLu|lu|\w*[qQ]r|\w*[sS]vd|eigenvalues|eigenvectors)\(\))"),
     {"()"},
     "sim/base/dense_solvers.h"},
    {std::regex(R"(\.(slerp|angularDistance|eulerAngles)\()"),
     {"slerp", "angularDistance", "eulerAngles"},
     "sim/base/rotation.h"},
    {std::regex(R"(Eigen::(\w*EigenSolver|\w*SVD|LDLT|LLT|\w*LU|\w*QR|AngleAxis\w)|FromTwoVectors)"),
     {"Eigen::", "FromTwoVectors"},
     "sim/base/dense_solvers.h and sim/base/rotation.h"},
    {std::regex(R"(EIGEN_PI|long double|__float)"),
     {"EIGEN_PI", "long double", "__float"},
     "std::numbers::pi and double: long doubles have as many bits as a machine likes"},
    {std::regex(R"(_mm\d*_rsqrt|_mm\d*_rcp|_mm\d*_fn?m(add|sub))"),
     {"_mm"},
     "square roots, quotients, products and sums"},
};

// Returns a line without its `//` comment.
std::string code_of(const std::string& line) { return line.substr(0, line.find("//")); }

// Returns a message for every forbidden name in `file`.
std::vector<std::string> findings_in(const std::string& name, std::istream& file) {
  std::vector<std::string> found;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number)
    for (const Forbidden& f : forbidden)
      if (std::any_of(f.parts.begin(), f.parts.end(),
                      [&](const std::string& part) { return line.find(part) != std::string::npos; }) &&
          std::regex_search(code_of(line), f.pattern))
        found.push_back(fmt::format("{}:{}: {}\n  use {} instead", name, number, line, f.instead));
  return found;
}

// The count of files proves that the search has found the sources.
TEST(PortableSources, SimCallsNothingWhoseBitsDependOnTheMachine) {
  namespace fs = std::filesystem;
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(test::source_folder() + "/sim")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    std::ifstream file(entry.path());
    ++files;
    for (const std::string& finding : findings_in(entry.path().string(), file)) ADD_FAILURE() << finding;
  }
  EXPECT_GT(files, 200);
}

// Every pattern finds an example of its name, and neither comments nor allowed functions are reported. A
// pattern that matches nothing would let the test above pass for no reason.
TEST(PortableSources, EachForbiddenNameIsFound) {
  for (const char* line : {"const double x = std::sin(y);", "a.ldlt().solve(b)",
                           "std::uniform_real_distribution<> d;", "Quat(Eigen::AngleAxisd(1, n))",
                           "q = Quat::FromTwoVectors(a, b);", "std::pow(x, 2)", "2 * EIGEN_PI"}) {
    std::istringstream source(line);
    EXPECT_EQ(findings_in("", source).size(), 1) << line;
  }
  std::istringstream comment("// std::sin(y) differs\nmath::sin(x) + std::sqrt(y);");
  EXPECT_TRUE(findings_in("", comment).empty());
}

// Appends the types that a file defines in named namespaces, "duet::render::Box". Definitions of types begin
// at the first character of a line, as tools/format has them.
void find_types(std::istream& file, std::vector<std::string>& found) {
  static const std::regex space(R"(namespace ([\w:]+) \{)"),
      type(R"((struct|class|enum class) (\w+)( final)?( : .*)? \{.*)");
  std::string line, name;
  bool is_hidden = false;  // within a namespace without a name
  std::smatch match;
  while (std::getline(file, line)) {
    if (line == "namespace {") is_hidden = true;
    if (line == "}  // namespace") is_hidden = false;
    if (std::regex_match(line, match, space)) name = match[1];
    if (!is_hidden && std::regex_match(line, match, type)) found.push_back(name + "::" + match[2].str());
  }
}

// Two types of one name in one namespace break the rule of one definition, which no compiler and no linker
// sees: a program then takes the constructor of one for the other.
TEST(Sources, DefineEachTypeOnce) {
  namespace fs = std::filesystem;
  std::map<std::string, std::string> files;  // by type
  for (const char* folder : {"/sim", "/render", "/tools"})
    for (const fs::directory_entry& entry :
         fs::recursive_directory_iterator(test::source_folder() + folder)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      std::ifstream file(entry.path());
      std::vector<std::string> types;
      find_types(file, types);
      for (const std::string& type : types) {
        const auto [known, is_new] = files.emplace(type, entry.path().string());
        EXPECT_TRUE(is_new) << type << " is defined in " << known->second << " and " << entry.path();
      }
    }
  EXPECT_GT(files.size(), 300U);
}

TEST(Sources, DefinitionsAreFoundWhereTheirNamesAreSeen) {
  std::istringstream source(
      "namespace duet::render {\nstruct Known;\nnamespace {\nstruct Hidden {\n};\n}  // namespace\n"
      "struct Box {\n  struct Inner {\n  };\n};\nenum class Kind { a, b };\nclass Last final : public Box "
      "{\n");
  std::vector<std::string> types;
  find_types(source, types);
  EXPECT_EQ(types,
            (std::vector<std::string>{"duet::render::Box", "duet::render::Kind", "duet::render::Last"}));
}

}  // namespace
}  // namespace duet::portable_sources_test
