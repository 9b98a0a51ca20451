// Expected hashes that are committed: a text file for each scene (tests/hashes/README.md), with a hash of
// the whole state in each frame and, for some frames, hashes of every body and quantity.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/step/state_hashes.h"

namespace duet::io {

/// A line of hashes below a frame, in one of three forms. A body's line has a hash for each quantity of
/// that body. In scenes of many bodies, those whose names differ only in digits form a group: its line has
/// the label "group rigid ball* 320" and a hash for each quantity of all members together. Lines with the
/// label "bodies" follow it, with one hash for each member.
struct HashLine {
  /// "rigid box", "deformable cloth", "scene", "group rigid ball* 320" or "bodies". A name that is not one
  /// plain word stands in double quotes, with backslashes before quotes and backslashes and control
  /// characters as `\xHH`: `rigid "my ball"`.
  std::string label;
  std::vector<std::string> hashes;  ///< 8 hexadecimal digits each
  /// For each hash the name of its quantity, or of its body in a line "bodies". The list is empty in lines
  /// that read_expected() returns: files do not hold the names.
  std::vector<std::string> names;
};

/// Hashes of the state at the end of a frame.
struct FrameHashes {
  int frame = 0;                ///< number of the frame; 0: the initial state
  std::string whole;            ///< FrameStats::hash as 16 hexadecimal digits
  std::vector<HashLine> lines;  ///< hashes of bodies and quantities; empty if only the whole state is hashed
};

/// Returns the lines of all bodies and of the scene, in their order. If there are more than `max_lines`
/// bodies, those whose names differ only in digits are grouped, unless the group would have fewer than 8
/// members.
std::vector<HashLine> hash_lines(const std::vector<BodyHashes>& bodies, std::size_t max_lines = 100);

/// Returns the hash as 16 hexadecimal digits.
std::string whole_hash(std::uint64_t hash);

/// Returns the text of a file of expected hashes: the lines of `about` as comments, then the frames.
std::string expected_text(const std::string& about, const std::vector<FrameHashes>& frames);

/// Reads a file that expected_text() made. Throws FileError if the file is missing, has a malformed line or
/// holds no frame.
std::vector<FrameHashes> read_expected(const fs::path& path);

/// First difference between the expected and the found hashes of a frame.
struct HashDifference {
  int frame = 0;         ///< number of the frame
  std::string body;      ///< first body that differs; empty if only the scene differs or no body is known
  std::string quantity;  ///< first quantity that differs, of that body or its group; empty if not known
  int bodies = 0;        ///< number of bodies that differ
  /// Returns the difference as a phrase: "frame 3: velocity of `box` (and 2 more bodies)".
  std::string text() const;
};

/// Compares the hashes of a frame; returns none if they are equal. If `expected` has lines, `found` needs
/// lines with names. If the lines do not describe the same bodies, the difference has no body, and its
/// `quantity` says so.
std::optional<HashDifference> compare_hashes(const FrameHashes& expected, const FrameHashes& found);

}  // namespace duet::io
