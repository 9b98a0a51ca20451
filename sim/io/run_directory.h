// The run directory: the only thing that the simulator's output and the renderer share.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "sim/scene/scene.h"
#include "sim/simulation/frame.h"

namespace duet::io {

namespace fs = std::filesystem;

struct ManifestBody {
  std::string name;
  std::string kind;  // "rigid", "static" or "deformable"
  std::string look;
  std::string material;  // deformable only
  int vertices = 0, triangles = 0;
  // m, around its surface at frame 0; none in runs of programs that did not write it.
  std::optional<Eigen::AlignedBox3d> box = {};
  int normals = 0, uvs = 0;  // 0 in runs of programs that did not write values/
  bool has_strain = true;    // deformable only; thin bodies have none

  bool is_deformable() const { return kind == "deformable"; }
};

// The program that computed frames, and the machine.
struct Origin {
  std::string version;         // of the program: "0.1.0"
  std::string git_commit;      // with "-changed" when it was not built of the commit alone
  std::string compiler;        // "g++ 12.2.0"; empty in runs of programs that did not write it
  std::string variant;         // instructions it was compiled for: "x86-64-v3"; empty as `compiler` is
  std::uint32_t numerics = 0;  // numerics_version; 0 as `compiler` is empty
  std::string machine;
  bool operator==(const Origin&) const = default;
};

// Frames of a resumed run that were computed elsewhere.
struct EarlierFrames {
  int last_frame = 0;  // from the frame after that of the entry before, or from frame 0
  Origin origin;
  bool operator==(const EarlierFrames&) const = default;
};

struct Manifest {
  std::string title, scene, command;
  Origin origin;                       // of the newest frames
  std::vector<EarlierFrames> earlier;  // of the frames before, in their order; none: all are of `origin`
  double fps = 24;
  int frames = 0;  // last frame of the scene
  std::string units = "metres, seconds, kilograms; y up, right-handed";
  std::vector<ManifestBody> bodies;
};

// The scene's bodies with the sizes of their surfaces, which Simulation::surfaces gives in the same order.
std::vector<ManifestBody> manifest_bodies(const scene::Scene& scene,
                                          const std::vector<BodySurface>& surfaces);

// Names the program: "duet 0.1.0 (0123456789ab), g++ 12.2.0, x86-64-v3".
std::string program_text(const Origin& origin);

// Returns Manifest::earlier for a run that keeps its frames up to `last_frame` and that `now` continues.
// `before` is the manifest that the run has so far.
std::vector<EarlierFrames> earlier_frames(const Manifest& before, int last_frame, const Origin& now);

class RunJournal;

struct RunDirectory {
  fs::path root;
  /// Lists what is written and checks what is read; without one, nothing is listed and checked.
  std::shared_ptr<RunJournal> journal = {};

  fs::path manifest() const { return root / "manifest.json"; }
  fs::path scene() const { return root / "scene.toml"; }
  fs::path mesh(int frame) const;       // mesh/0000.obj
  fs::path level_set(int frame) const;  // levelset/0000.vdb, of the bodies that move
  fs::path static_level_sets() const { return root / "levelset" / "static.vdb"; }  // of all frames
  fs::path values(int frame) const;                                                // values/0000.npy
  fs::path body_values() const { return root / "values" / "bodies.npy"; }
  fs::path image(int frame) const;  // image/0000.png
  fs::path stats() const { return root / "stats.jsonl"; }
  fs::path stage_hashes() const { return root / "hashes.jsonl"; }
  fs::path checkpoint() const { return root / "checkpoint"; }

  /// write_atomically, listed in the journal.
  void write(const fs::path& path, const std::string& bytes) const;
  /// read_file. Throws FileError also where the file is not what the journal lists.
  std::string read(const fs::path& path) const;
  /// remove_file, listed in the journal.
  void remove(const fs::path& path) const;
  /// Throws FileError where the journal lists the file and it is missing or another one.
  void require_whole(const fs::path& path) const;
};

/// The run directory with its journal, if it has one. Throws FileError where the journal cannot be read.
RunDirectory open_run(const fs::path& root);

void write_manifest(const RunDirectory& run, const Manifest& manifest);
Manifest read_manifest(const RunDirectory& run);  // throws FileError

// One file a frame, one named object a body, shared positions, normals and texture coordinates indexed apart.
std::string obj_text(const std::vector<BodySurface>& bodies);

/// How an OBJ file differs from those of a run.
struct ObjStyle {
  std::string comment;                 ///< after "# Duet frame: "
  std::string library;                 ///< file of the materials; empty: no materials
  std::vector<std::string> materials;  ///< names in it, one a body
  bool is_rounded = false;             ///< positions as in a run; otherwise all digits of the doubles
};
std::string obj_text(const std::vector<BodySurface>& bodies, const ObjStyle& style);

void write_obj(const fs::path& path, const std::vector<BodySurface>& bodies);
std::vector<BodySurface> read_obj(const fs::path& path);  // reads what write_obj writes; throws FileError
/// The mesh of a frame. Throws FileError also where it is not what the run's journal lists.
std::vector<BodySurface> read_mesh(const RunDirectory& run, int frame);

}  // namespace duet::io
