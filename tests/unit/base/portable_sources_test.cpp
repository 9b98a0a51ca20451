// Guards the promise that the state has the same bits on every machine: nothing in sim/ may call functions
// whose bits depend on the C library, on Eigen or on the standard library. The test searches the sources for
// their names.
#include <filesystem>
#include <fstream>
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
  const char* instead;
};

const std::vector<Forbidden> forbidden = {
    {std::regex(
         R"(std::(sin|cos|tan|asin|acos|atan2?|exp2?|expm1|log(2|10|1p)?|pow|hypot|cbrt|sinh|cosh|tanh|erfc?|[lt]gamma)\()"),
     "sim/base/elementary.h"},
    {std::regex(R"(std::\w+_distribution|std::shuffle|std::sample|std::random_shuffle)"), "scene::Random"},
    {std::regex(R"(\.(ldlt|llt|partialPivLu|fullPivLu|lu|\w*[qQ]r|\w*[sS]vd|eigenvalues|eigenvectors)\(\))"),
     "sim/base/dense_solvers.h"},
    {std::regex(R"(\.(slerp|angularDistance|eulerAngles)\()"), "sim/base/rotation.h"},
    {std::regex(R"(Eigen::(\w*EigenSolver|\w*SVD|LDLT|LLT|\w*LU|\w*QR|AngleAxis\w)|FromTwoVectors)"),
     "sim/base/dense_solvers.h and sim/base/rotation.h"},
    {std::regex(R"(EIGEN_PI|long double|__float)"),
     "std::numbers::pi and double: long doubles have as many bits as a machine likes"},
    {std::regex(R"(_mm\d*_rsqrt|_mm\d*_rcp|_mm\d*_fn?m(add|sub))"),
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
      if (std::regex_search(code_of(line), f.pattern))
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

}  // namespace
}  // namespace duet::portable_sources_test
