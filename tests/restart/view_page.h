// A page of `duet view`, read as a browser reads it: what its elements hold, and where its bodies are.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/base/types.h"

namespace duet::test::view_page {

class ViewPage {
 public:
  /// Throws where the page is not as tools/view/page_data.h says.
  explicit ViewPage(const std::string& html);

  const nlohmann::json& run() const { return run_; }
  std::vector<int> frames() const { return run_.at("frames").get<std::vector<int>>(); }
  /// m, the positions of the body at the frame with the index.
  std::vector<Vec3> positions(const std::string& body, std::size_t frame) const;
  /// How near the positions are to other bodies, 0 to 255; empty where none is.
  std::vector<std::uint8_t> near(const std::string& body, std::size_t frame) const;
  /// Pa, stresses at the positions of a deformable body.
  std::vector<double> stress(const std::string& body, std::size_t frame) const;
  /// Pa, pressures of contact at the positions of a deformable body; empty where all are 0.
  std::vector<double> pressure(const std::string& body, std::size_t frame) const;
  /// N, the force of contact on the body.
  Vec3 contact_force(const std::string& body, std::size_t frame) const;

 private:
  struct State {
    std::vector<float> numbers;                      // of all bodies
    std::vector<std::vector<std::uint16_t>> points;  // of each body, all x first; empty for rigid ones
    std::vector<std::vector<std::uint8_t>> near, speed, strain, stress, pressure;
  };
  std::size_t index_of(const std::string& body) const;
  void read_meshes(const std::string& bytes);
  void read_frames(const std::string& bytes);

  nlohmann::json run_;
  std::vector<std::vector<Vec3>> rest_;    // of each mesh
  std::vector<std::size_t> first_number_;  // of each body in a state's numbers
  std::vector<State> states_;
  State before_, before_that_;  // sums of the differences so far, for the rows
};

}  // namespace duet::test::view_page
