#include "sim/io/checkpoint.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/hash.h"

namespace duet::io {
namespace {

static_assert(std::endian::native == std::endian::little, "checkpoints are little-endian");

constexpr char magic[8] = {'D', 'U', 'E', 'T', 'C', 'K', 'P', 'T'};
// Version of the layout of the header and of Simulation::save_state(). It is raised when either changes,
// and files of other versions are not read.
constexpr std::uint32_t format_version = 10;

// Beginning of a checkpoint file; the state follows it.
struct Header {
  char magic[8];
  std::uint32_t version;
  std::int32_t frame;
  std::uint64_t numerics;  // numerics_version of the program that computed the state
  std::uint64_t scene;     // identity of the scene, as write_checkpoint() got it
  std::uint64_t size;      // length of the state after the header, bytes
  std::uint64_t hash;      // hash of all fields above and of the state
};
static_assert(sizeof(Header) == 48, "written as it lies in memory: no padding");

// Returns the value of Header::hash for a header whose other fields are set.
std::uint64_t hash_of(const Header& header, const unsigned char* state) {
  return hash_bytes(state, header.size, hash_bytes(&header, offsetof(Header, hash)));
}

// Returns the frames that have a checkpoint file, newest first.
std::vector<int> frames_present(const RunDirectory& run) {
  std::vector<int> frames;
  for (const fs::path& path : files_in(run.checkpoint()))
    if (const int frame = frame_of_file(path, ".bin"); frame >= 0) frames.push_back(frame);
  std::sort(frames.rbegin(), frames.rend());
  return frames;
}

// The checkpoint of a file, or the reason why it is passed over.
struct Examined {
  std::optional<Checkpoint> checkpoint;
  enum class Fault { damaged, other_scene, other_format } kind = Fault::damaged;
  std::string fault;
};

// Checks the bytes of the checkpoint file of a frame. The faults are verb phrases that follow the path.
Examined examine(const std::string& bytes, int frame, std::uint64_t scene) {
  using enum Examined::Fault;
  Header header{};
  // Headers of other formats may have another size, but all begin with `magic` and the number of the
  // format.
  std::memcpy(&header, bytes.data(), std::min(bytes.size(), sizeof header));
  if (bytes.size() < offsetof(Header, frame)) return {{}, damaged, "is too short"};
  if (std::memcmp(header.magic, magic, sizeof magic) != 0) return {{}, damaged, "is no checkpoint"};
  if (header.version != format_version)
    return {{},
            other_format,
            fmt::format("has format {}, this program reads format {}", header.version, format_version)};
  if (bytes.size() < sizeof header) return {{}, damaged, "is too short"};
  const auto* state = reinterpret_cast<const unsigned char*>(bytes.data()) + sizeof header;
  if (header.size != bytes.size() - sizeof header || header.hash != hash_of(header, state))
    return {{}, damaged, "is damaged"};
  if (header.frame != frame) return {{}, damaged, fmt::format("holds frame {}", header.frame)};
  if (header.scene != scene) return {{}, other_scene, "belongs to another scene or other settings"};
  return {
      Checkpoint{frame, {state, state + header.size}, static_cast<std::uint32_t>(header.numerics)}, {}, {}};
}

}  // namespace

fs::path checkpoint_path(const RunDirectory& run, int frame) {
  return run.checkpoint() / fmt::format("{:04}.bin", frame);
}

std::uint64_t scene_identity(const std::string& source, const EffectSet& effects) {
  const std::string active = effects.to_string();
  return hash_bytes(active.data(), active.size(), hash_bytes(source.data(), source.size()));
}

std::optional<std::uint64_t> newest_identity(const RunDirectory& run) {
  const std::vector<int> frames = frames_present(run);
  if (frames.empty()) return std::nullopt;
  std::string start;
  try {
    read_pieces(checkpoint_path(run, frames.front()), [&](std::string_view piece) {
      start += piece;
      return start.size() < sizeof(Header);
    });
  } catch (const FileError&) {
    return std::nullopt;  // a simulation has removed it meanwhile
  }
  Header header{};
  if (start.size() < sizeof header) return std::nullopt;
  std::memcpy(&header, start.data(), sizeof header);
  if (std::memcmp(header.magic, magic, sizeof magic) != 0 || header.version != format_version)
    return std::nullopt;
  return header.scene;
}

void write_checkpoint(const RunDirectory& run, std::uint64_t scene, const Checkpoint& checkpoint) {
  Header header{};
  std::memcpy(header.magic, magic, sizeof magic);
  header.version = format_version;
  header.frame = checkpoint.frame;
  header.numerics = checkpoint.numerics;
  header.scene = scene;
  header.size = checkpoint.state.size();
  header.hash = hash_of(header, checkpoint.state.data());
  std::string bytes(sizeof header + checkpoint.state.size(), '\0');
  std::memcpy(bytes.data(), &header, sizeof header);
  std::copy(checkpoint.state.begin(), checkpoint.state.end(), bytes.begin() + sizeof header);
  run.write(checkpoint_path(run, checkpoint.frame), bytes);

  const std::vector<int> frames = frames_present(run);
  for (std::size_t i = 2; i < frames.size(); ++i) run.remove(checkpoint_path(run, frames[i]));
}

CheckpointSearch find_checkpoint(const RunDirectory& run, std::uint64_t scene) {
  CheckpointSearch search;
  for (const int frame : frames_present(run)) {
    const fs::path path = checkpoint_path(run, frame);
    try {
      Examined examined = examine(read_file(path), frame, scene);
      if (examined.checkpoint) {
        search.found = std::move(examined.checkpoint);
        return search;
      }
      search.foreign |= examined.kind == Examined::Fault::other_scene;
      search.other_format |= examined.kind == Examined::Fault::other_format;
      search.faults.push_back(fmt::format("{} {}", path.string(), examined.fault));
    } catch (const FileError& error) {
      search.faults.emplace_back(error.what());
    }
  }
  return search;
}

}  // namespace duet::io
