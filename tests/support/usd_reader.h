// Reader of the USD files that Duet writes, text and binary. It knows what these files have, and no more.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/base/files.h"
#include "sim/base/types.h"

namespace duet::test {

// A layer: the values of attributes as text, by path of the prim, name and frame, and the lines of metadata
// of prims.
class Usda {
 public:
  // Reads the file: a binary one if its name ends with .usdc, else text.
  explicit Usda(const std::filesystem::path& path);

  bool has_prim(const std::string& path) const { return prims_.contains(path); }
  const std::vector<std::string>& prims() const { return in_order_; }
  const std::string& metadata(const std::string& path) const { return prims_.at(path); }

  bool has(const std::string& prim, const std::string& name) const {
    return values_.contains(prim + "." + name);
  }
  // Returns the value of an attribute at a frame by the interpolation of stages. A frame between two others
  // of the same value may have none of its own.
  std::string text(const std::string& prim, const std::string& name, int frame) const;
  std::size_t samples(const std::string& prim, const std::string& name) const {
    return values_.at(prim + "." + name).size();
  }
  std::vector<double> numbers(const std::string& prim, const std::string& name, int frame = 0) const;
  std::vector<Vec3> vectors(const std::string& prim, const std::string& name, int frame = 0) const;

 private:
  friend class UsdText;
  friend class UsdBinary;

  std::vector<std::string> in_order_;
  std::map<std::string, std::string> prims_;
  std::map<std::string, std::map<int, std::string>> values_;
};

}  // namespace duet::test
