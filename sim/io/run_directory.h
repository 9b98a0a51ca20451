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

/// A body as the manifest lists it: its name and look, and the sizes of its surface.
struct ManifestBody {
  std::string name;      ///< name in the scene
  std::string kind;      ///< "rigid", "kinematic", "static" or "deformable"
  std::string look;      ///< name of its look in the scene; empty: the scene chooses none
  std::string material;  ///< name of its material; empty for bodies that are not deformable
  int vertices = 0,      ///< number of positions of its surface
      triangles = 0;     ///< number of triangles of its surface
  /// Bounding box of its surface at frame 0, m, world axes; none if the program that wrote the run left it
  /// out.
  std::optional<Eigen::AlignedBox3d> box = {};
  int normals = 0,  ///< number of normals of its surface; 0 if the program that wrote the run had no values/
      uvs = 0;      ///< number of texture coordinates of its surface; 0 as `normals` is
  /// True if a deformable body has a strain; thin bodies have none. The value has no meaning for other
  /// bodies.
  bool has_strain = true;

  /// Returns true if the body is deformable.
  bool is_deformable() const { return kind == "deformable"; }
};

/// Program and machine that computed frames of a run.
struct Origin {
  std::string version;         ///< version of the program: "0.1.0"
  std::string git_commit;      ///< commit it was built from, with "-changed" if the sources differed from it
  std::string compiler;        ///< "g++ 12.2.0"; empty if the program that wrote the run left it out
  std::string variant;         ///< instructions it was compiled for: "x86-64-v3"; empty as `compiler` is
  std::uint32_t numerics = 0;  ///< its numerics_version; 0 if the program that wrote the run left it out
  std::string machine;         ///< description of the machine
  /// Returns true if all fields are equal.
  bool operator==(const Origin&) const = default;
};

/// Frames of a resumed run that another program or machine computed.
struct EarlierFrames {
  /// Last of the frames. They begin after the last frame of the entry before, or at frame 0.
  int last_frame = 0;
  Origin origin;  ///< program and machine that computed them
  /// Returns true if all fields are equal.
  bool operator==(const EarlierFrames&) const = default;
};

/// Content of manifest.json: what a run is, and which bodies it has.
struct Manifest {
  std::string title,  ///< title of the scene; may be empty
      scene,          ///< path of the scene file, as given
      command;        ///< command line of the program
  Origin origin;      ///< program and machine that computed the newest frames
  /// Frames before those of `origin`, in ascending order; empty if all frames have `origin`.
  std::vector<EarlierFrames> earlier;
  double fps = 24;  ///< frames per simulated second, 1/s
  int frames = 0;   ///< number of the last frame that the run is to have
  std::string units = "metres, seconds, kilograms; y up, right-handed";  ///< units and axes, as text
  std::vector<ManifestBody> bodies;  ///< rigid bodies, then deformable bodies, in the scene's order
};

/// Returns the scene's bodies with the sizes and bounding boxes of `surfaces`, which are those that
/// Simulation::surfaces gives, in the same order.
std::vector<ManifestBody> manifest_bodies(const scene::Scene& scene,
                                          const std::vector<BodySurface>& surfaces);

/// Returns a phrase that names the program: "duet 0.1.0 (0123456789ab), g++ 12.2.0, x86-64-v3".
std::string program_text(const Origin& origin);

/// Returns Manifest::earlier for a run that keeps its frames up to `last_frame` and is continued by `now`.
/// `before` is the manifest that the run has so far.
std::vector<EarlierFrames> earlier_frames(const Manifest& before, int last_frame, const Origin& now);

class RunJournal;

/// Paths of the files of a run, and access to them that keeps the run's journal.
struct RunDirectory {
  fs::path root;  ///< folder of the run
  /// Journal that lists what is written and by which reads are checked; null: nothing is listed or checked.
  std::shared_ptr<RunJournal> journal = {};

  /// Returns the path of manifest.json.
  fs::path manifest() const { return root / "manifest.json"; }
  /// Returns the path of scene.toml: the scene as run, with its overrides.
  fs::path scene() const { return root / "scene.toml"; }
  /// Returns the path of the meshes of a frame: mesh/0000.obj.
  fs::path mesh(int frame) const;
  /// Returns the path of the level sets of the bodies that can move, at a frame: levelset/0000.vdb.
  fs::path level_set(int frame) const;
  /// Returns the path of the level sets of static bodies, which serve all frames: levelset/static.vdb.
  fs::path static_level_sets() const { return root / "levelset" / "static.vdb"; }
  /// Returns the path of the motion at a frame in double precision: values/0000.npy.
  fs::path values(int frame) const;
  /// Returns the path of the surfaces at rest in double precision: values/bodies.npy.
  fs::path body_values() const { return root / "values" / "bodies.npy"; }
  /// Returns the path of the picture of a frame: image/0000.png.
  fs::path image(int frame) const;
  /// Returns the path of the statistics, one line a frame: stats.jsonl.
  fs::path stats() const { return root / "stats.jsonl"; }
  /// Returns the path of the hashes of the state after every stage: hashes.jsonl.
  fs::path stage_hashes() const { return root / "hashes.jsonl"; }
  /// Returns the folder of the checkpoints.
  fs::path checkpoint() const { return root / "checkpoint"; }

  /// Writes the file atomically and lists it in the journal. Throws FileError.
  void write(const fs::path& path, const std::string& bytes) const;
  /// Returns the bytes of the file. Throws FileError if it cannot be read or differs from what the journal
  /// lists.
  std::string read(const fs::path& path) const;
  /// Removes the file, if it is there, and notes that in the journal. Throws FileError.
  void remove(const fs::path& path) const;
  /// Throws FileError if the journal lists the file and it is missing or differs. Does nothing without a
  /// journal.
  void require_whole(const fs::path& path) const;
};

/// Returns the run directory with its journal, if it has one. Throws FileError if the journal cannot be
/// read.
RunDirectory open_run(const fs::path& root);

/// Writes manifest.json. Throws FileError.
void write_manifest(const RunDirectory& run, const Manifest& manifest);

/// Reads manifest.json. Throws FileError if it is missing, differs from what the journal lists, or holds
/// values that no run has.
Manifest read_manifest(const RunDirectory& run);

/// Returns the text of a frame's OBJ file, with positions rounded as in the files of a run. Each body is a
/// named object; positions, normals and texture coordinates are shared and indexed apart.
std::string obj_text(const std::vector<BodySurface>& bodies);

/// How an OBJ file differs from those of a run.
struct ObjStyle {
  std::string comment;  ///< text of the first line, after "# Duet frame: "
  std::string library;  ///< name of the file of materials; empty: no materials
  /// Names of materials in `library`, one for each body; empty without a library.
  std::vector<std::string> materials;
  /// True: positions are rounded as in a run, to 2^-24 of the body's extent or 1e-6 m, whichever is finer.
  /// False: they have all digits of the doubles.
  bool is_rounded = false;
};

/// Returns the text of an OBJ file of the given style.
std::string obj_text(const std::vector<BodySurface>& bodies, const ObjStyle& style);

/// Writes the OBJ file of a frame atomically, without listing it in a journal. Throws FileError.
void write_obj(const fs::path& path, const std::vector<BodySurface>& bodies);

/// Reads an OBJ file that write_obj() wrote. Throws FileError, with the number of the line, for anything
/// else.
std::vector<BodySurface> read_obj(const fs::path& path);

/// Reads the mesh of a frame. Throws FileError if it cannot be read or differs from what the journal lists.
std::vector<BodySurface> read_mesh(const RunDirectory& run, int frame);

}  // namespace duet::io
