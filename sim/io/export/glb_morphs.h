/// Deformable bodies as glTF's morph targets: one a frame, the first frame is the mesh itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"
#include "sim/io/export/glb_document.h"
#include "sim/io/export/split_vertices.h"
#include "sim/io/export/tracks.h"

namespace duet::io {

/// The differences of a frame's vertices from the mesh of the first frame, in positions or in normals.
struct MorphChange {
  std::uint32_t moved = 0;    ///< vertices
  bool is_as_before = false;  ///< the change of the frame before stands for this frame, too
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();  ///< bounds of the differences

  bool operator==(const MorphChange&) const = default;
};

/// The changes of a body at a frame, and its translation: vertex = origin + translation + mesh + change.
struct MorphFrame {
  MorphChange positions, normals;
  Vec3f translation = Vec3f::Zero();

  bool operator==(const MorphFrame&) const = default;
};

/// The changes of one deformable body from frame to frame, each from the frame before.
class MorphedBody {
 public:
  /// `origin`: of the file, in the export's unit. `values`: of the first frame.
  MorphedBody(const ExportedBody& body, const Vec3& origin, const FrameValues& values);

  /// Goes on to the next frame.
  MorphFrame advance(const FrameValues& values);

  const ExportedBody& body() const { return body_; }
  const SplitVertices& split() const { return split_; }
  /// At the first frame, by vertex.
  const std::vector<Vec3f>& positions() const { return positions_.mesh; }
  const std::vector<Vec3f>& normals() const { return normals_.mesh; }
  Vec3f translation() const { return translation_; }
  /// Differences at the frame reached, by vertex; 0 where they are below what a float holds of the body.
  const std::vector<Vec3f>& position_changes() const { return positions_.changes; }
  const std::vector<Vec3f>& normal_changes() const { return normals_.changes; }

 private:
  struct Attribute {
    std::vector<Vec3f> mesh, changes, next;
    float negligible = 0;  // length of a difference that counts as none

    MorphChange advance();  // takes `next` as the changes, unless those before stand for them
  };

  Vec3 vertex(const Corner& corner) const;

  const ExportedBody& body_;
  const Vec3 origin_;
  SplitVertices split_;
  Surface surface_;  // at the frame reached
  LocalOrigin local_;
  Vec3f translation_ = Vec3f::Zero();
  Attribute positions_, normals_;
};

/// The binary part that holds the morph targets of one frame: three buffer views.
struct MorphBlock {
  std::string dense, sparse_values, sparse_places;
};

/// Returns true if the change is stored as a list of the vertices that move.
bool is_sparse(const MorphChange& change, std::size_t vertices);

/// Lays out the changes of one frame: reserves the views and returns the index of each body's accessors, for
/// positions and normals in turn. `before`: those of the frame before, empty for the first. `vertices`: of
/// each body.
std::vector<int> add_morph_accessors(const std::vector<MorphFrame>& frame,
                                     const std::vector<std::size_t>& vertices, const std::vector<int>& before,
                                     GlbDocument& document);

/// Appends the body's changes to the block, as add_morph_accessors lays them out.
void append(const MorphedBody& body, const MorphFrame& frame, MorphBlock& block);

}  // namespace duet::io
