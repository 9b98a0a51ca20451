/// A run as a glTF document: nodes, meshes and the animation of its bodies, camera and lights.
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

/// Results of a first reading of a run's frames, which the document needs before the frames are written.
struct GlbMeasures {
  Vec3 origin = Vec3::Zero();        ///< of the file's coordinates, in the axes and unit of the export
  PoseTracks poses;                  ///< in the run's coordinates
  std::vector<MorphedBody> morphed;  ///< the deformable bodies with triangles, at the first frame
  std::vector<std::size_t> bodies;   ///< index of each of them in ExportedRun::bodies()
  /// Changes at the frames after the first, by frame and morphed body.
  std::vector<std::vector<MorphFrame>> morphs;
  std::vector<bool> changes;  ///< whether the mesh of a morphed body differs from the first in any frame
};

GlbMeasures measure(const ExportedRun& run);

/// The document of a run, with room reserved for the morph targets behind GlbDocument::start(): frame by
/// frame a MorphBlock of all morphed bodies that change.
class GlbScene {
 public:
  GlbScene(const ExportedRun& run, const GlbMeasures& measures);
  const GlbDocument& document() const { return document_; }

 private:
  /// Accessors of a mesh; -1 where it has none.
  struct Geometry {
    int positions = -1, normals = -1, uvs = -1, run_vertices = -1, indices = -1;
  };

  void add_bodies();
  Json body_node(std::size_t body);
  int rigid_mesh(std::size_t body);
  int morphed_mesh(std::size_t morphed);
  Geometry add_geometry(const Surface& surface, const SplitVertices& split,
                        const std::vector<Vec3f>& positions, const std::vector<Vec3f>& normals);
  std::string mesh_start(const ExportedBody& body, const Geometry& geometry);
  int material(int look);
  void animate_bodies();
  void animate_poses(int node, const PoseTrack& track);
  void animate(int node, const char* path, const std::vector<float>& values, int components);
  void add_camera();
  void add_lights();
  void finish_meshes();
  void finish_json();
  int add_node(Json node);

  const ExportedRun& run_;
  const GlbMeasures& measures_;
  const std::vector<std::size_t> first_same_;  // first_with_same_surface
  GlbDocument document_;
  Json nodes_ = Json::array(), root_children_ = Json::array();
  Json channels_ = Json::array(), samplers_ = Json::array();
  Json materials_ = Json::array();
  std::map<int, int> material_of_look_;
  std::map<std::size_t, Geometry> rigid_geometry_;           // of the first body with a surface
  std::map<std::pair<std::size_t, int>, int> rigid_meshes_;  // of that body and a look
  std::vector<std::pair<std::string, int>> meshes_;          // start of the text, and the morphed body or -1
  std::vector<int> body_nodes_;
  int times_ = -1;    // accessor
  int weights_ = -1;  // sampler that all bodies with morph targets share
};

}  // namespace duet::io
