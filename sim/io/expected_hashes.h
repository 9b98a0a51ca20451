// The hashes that are committed: a text file for each scene, with the hash of the whole state in each frame
// and, of some frames, hashes for every body and quantity, so that a difference has a name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/step/state_hashes.h"

namespace duet::io {

/// A line of a frame: a body with a hash for each of its quantities; or, in scenes of many bodies, a group of
/// those whose names differ in their numbers alone ("group rigid ball* 320") with a hash for each quantity of
/// all of them together, followed by lines "bodies" with one hash for each body.
struct HashLine {
  std::string label;  ///< "rigid box", "deformable cloth", "scene", "group rigid ball* 320", "bodies"
  std::vector<std::string> hashes;  ///< 8 hexadecimal digits each
  std::vector<std::string>
      names;  ///< what each is of: a quantity, of "bodies" a body; files do not have them
};

struct FrameHashes {
  int frame = 0;
  std::string whole;            ///< FrameStats::hash, 16 hexadecimal digits
  std::vector<HashLine> lines;  ///< empty where only the whole state is wanted
};

/// Lines for all bodies. More than `most_lines` bodies are grouped.
std::vector<HashLine> hash_lines(const std::vector<BodyHashes>& bodies, std::size_t most_lines = 100);
std::string whole_hash(std::uint64_t hash);

/// The text of a file: `about` as comment lines, then the frames.
std::string expected_text(const std::string& about, const std::vector<FrameHashes>& frames);
/// Throws FileError if the file is missing or is no such text.
std::vector<FrameHashes> read_expected(const fs::path& path);

struct HashDifference {
  int frame = 0;
  std::string body;      ///< the first that differs; empty: the scene, or not known
  std::string quantity;  ///< the first that differs of that body or its group; empty: not known
  int bodies = 0;        ///< how many differ
  std::string text() const;
};

/// None if the frames are equal. `found` has lines with names where `expected` has lines.
std::optional<HashDifference> compare_hashes(const FrameHashes& expected, const FrameHashes& found);

}  // namespace duet::io
