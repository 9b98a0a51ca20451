// A run as a glTF document: nodes, meshes and the animation of its bodies, camera and lights.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sim/io/export/exporters.h"
#include "sim/io/export/glb_document.h"
#include "sim/io/export/glb_morphs.h"
#include "sim/io/export/tracks.h"

namespace duet::io {

/// Results of a first reading of all frames, which the document needs before the frames are written.
struct GlbMeasures {
  Vec3 origin = Vec3::Zero();        ///< origin of the file's coordinates, in the axes and unit of the export
  PoseTracks poses;                  ///< poses of the rigid bodies, relative to the origin of the run
  std::vector<MorphedBody> morphed;  ///< deformable bodies that have triangles, at the first frame
  std::vector<std::size_t> bodies;   ///< index in ExportedRun::bodies() of each morphed body
  /// Changes of each morphed body at each frame after the first: morphs[frame - 1][morphed body].
  std::vector<std::vector<MorphFrame>> morphs;
  std::vector<bool> changes;  ///< for each morphed body whether its mesh differs from the first in any frame
};

/// Reads all frames of a run once and returns what the document needs of them. Throws FileError.
GlbMeasures measure(const ExportedRun& run);

/// Makes the glTF document of a run. Behind GlbDocument::start() it reserves room for the morph targets:
/// for each frame after the first a MorphBlock of all morphed bodies that change.
class GlbScene {
 public:
  /// Makes the document. `run` and `measures` have to outlive the scene.
  GlbScene(const ExportedRun& run, const GlbMeasures& measures);
  /// Returns the document.
  const GlbDocument& document() const { return document_; }

 private:
  // Indices of the accessors of a mesh; -1: the mesh has none.
  struct Geometry {
    int positions = -1, normals = -1, uvs = -1, run_vertices = -1, indices = -1;
  };

  // Adds the root node and a node with its mesh for each body.
  void add_bodies();
  Json body_node(std::size_t body);
  // Return the index of the mesh of a body in meshes_, which they add if need be.
  int rigid_mesh(std::size_t body);
  int morphed_mesh(std::size_t morphed);
  // Adds the arrays of a mesh to the document.
  Geometry add_geometry(const Surface& surface, const SplitVertices& split,
                        const std::vector<Vec3f>& positions, const std::vector<Vec3f>& normals);
  // Returns the text of a mesh up to the end of its material; morph targets may follow.
  std::string mesh_start(const ExportedBody& body, const Geometry& geometry);
  // Returns the index of the material of a look, which it adds if need be.
  int material(int look);
  void animate_bodies();
  void animate_poses(int node, const PoseTrack& track);
  // Adds a channel for the property `path` of a node, with `components` values at each frame, unless it is
  // constant.
  void animate(int node, const char* path, const std::vector<float>& values, int components);
  void add_camera();
  void add_lights();
  // Adds the meshes with their morph targets to the document.
  void finish_meshes();
  // Adds everything that was gathered in members to the document.
  void finish_json();
  // Adds a child of the root node and returns its index.
  int add_node(Json node);

  const ExportedRun& run_;
  const GlbMeasures& measures_;
  const std::vector<std::size_t> first_same_;  // result of first_with_same_surface()
  GlbDocument document_;
  Json nodes_ = Json::array(), root_children_ = Json::array();
  Json channels_ = Json::array(), samplers_ = Json::array();
  Json materials_ = Json::array();
  std::map<int, int> material_of_look_;             // index in materials_, by index of the look
  std::map<std::size_t, Geometry> rigid_geometry_;  // key: first rigid body with the same surface
  // Indices in meshes_. Keys are the first rigid body with the same surface, and the look.
  std::map<std::pair<std::size_t, int>, int> rigid_meshes_;
  // For each mesh the start of its text, and the index of the morphed body or -1.
  std::vector<std::pair<std::string, int>> meshes_;
  std::vector<int> body_nodes_;  // index of the node of each body
  int times_ = -1;               // accessor of the times of the frames; -1: a single frame
  int weights_ = -1;             // sampler of weights that all bodies with morph targets share; -1: none yet
};

}  // namespace duet::io
