// Deformable bodies as morph targets of glTF: the first frame is the mesh itself, and each other frame has
// a target.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"
#include "sim/io/export/glb_document.h"
#include "sim/io/export/split_vertices.h"
#include "sim/io/export/tracks.h"

namespace duet::io {

/// Summary of the differences between a frame's vertices and the mesh of the first frame, in positions or
/// in normals.
struct MorphChange {
  std::uint32_t moved = 0;    ///< number of vertices whose difference is not 0
  bool is_as_before = false;  ///< true if the differences of the frame before serve this frame, too
  Vec3f low = Vec3f::Zero(),  ///< least difference in each component
      high = Vec3f::Zero();   ///< greatest difference in each component

  /// Returns true if all members are equal.
  bool operator==(const MorphChange&) const = default;
};

/// Changes of a body at a frame: vertex = origin + translation + mesh + difference. The origin is that of
/// the file, and the mesh is the body at the first frame, relative to its translation then.
struct MorphFrame {
  MorphChange positions,              ///< summary of the differences in positions, unit of the export
      normals;                        ///< summary of the differences in normals
  Vec3f translation = Vec3f::Zero();  ///< translation of the body's node, unit of the export

  /// Returns true if all members are equal.
  bool operator==(const MorphFrame&) const = default;
};

/// A deformable body that goes from frame to frame, with the differences of its vertices from those of the
/// first frame.
class MorphedBody {
 public:
  /// Begins at the first frame, whose values are `values`. `origin` is the origin of the file's
  /// coordinates, in the axes and unit of the export.
  MorphedBody(const ExportedBody& body, const Vec3& origin, const FrameValues& values);

  /// Advances to the next frame, whose values are `values`, and returns its changes. Frames have to come in
  /// order.
  MorphFrame advance(const FrameValues& values);

  /// Returns the body.
  const ExportedBody& body() const { return body_; }
  /// Returns the vertices of the mesh, and which position, normal and texture coordinate each has.
  const SplitVertices& split() const { return split_; }
  /// Returns the positions of the vertices at the first frame, relative to origin and translation.
  const std::vector<Vec3f>& positions() const { return positions_.mesh; }
  /// Returns the normals of the vertices at the first frame.
  const std::vector<Vec3f>& normals() const { return normals_.mesh; }
  /// Returns the translation of the body's node at the frame reached.
  Vec3f translation() const { return translation_; }
  /// Returns the differences in position at the frame reached, for each vertex. Differences of at most
  /// 2^-24 of the body's size are 0.
  const std::vector<Vec3f>& position_changes() const { return positions_.changes; }
  /// Returns the differences in normal at the frame reached, for each vertex. Differences of at most 2^-24
  /// are 0.
  const std::vector<Vec3f>& normal_changes() const { return normals_.changes; }

 private:
  // Positions or normals of the vertices.
  struct Attribute {
    std::vector<Vec3f> mesh,  // values at the first frame
        changes,              // differences from it at the frame reached
        next;                 // differences at the frame to come
    float negligible = 0;     // length up to which a difference counts as 0

    // Replaces `changes` by `next` if one of them differs by more than `negligible`, and summarizes them.
    MorphChange advance();
  };

  // Returns the position of a vertex relative to origin_ and translation_.
  Vec3 vertex(const Corner& corner) const;

  const ExportedBody& body_;
  const Vec3 origin_;
  SplitVertices split_;
  Surface surface_;  // surface at the frame reached
  LocalOrigin local_;
  Vec3f translation_ = Vec3f::Zero();
  Attribute positions_, normals_;
};

/// Bytes of the morph targets of one frame, in three buffer views.
struct MorphBlock {
  std::string dense,  ///< differences of changes that list all vertices, three floats each
      sparse_values,  ///< differences of changes that list only the vertices that move, three floats each
      sparse_places;  ///< indices of these vertices, 32 bits each
};

/// Returns true if the change takes less room as a list of the vertices that move. `vertices` is the number
/// of vertices of the body.
bool is_sparse(const MorphChange& change, std::size_t vertices);

/// Lays out the changes of one frame: reserves buffer views in the document, adds accessors, and returns
/// their indices, two for each body: positions, normals. `frame` has the changes of each body, `vertices`
/// the numbers of their vertices. `before` is the result for the frame before, empty for the first frame
/// with targets; its accessors are used again for changes that are as before.
std::vector<int> add_morph_accessors(const std::vector<MorphFrame>& frame,
                                     const std::vector<std::size_t>& vertices, const std::vector<int>& before,
                                     GlbDocument& document);

/// Appends the body's changes at the frame that it reached to the block, as add_morph_accessors() lays them
/// out. `frame` is the result of MorphedBody::advance().
void append(const MorphedBody& body, const MorphFrame& frame, MorphBlock& block);

}  // namespace duet::io
