// Records and scratch of the search for contact candidates. The search keeps them between steps for their
// storage only; they hold no state.
#pragma once

#include <vector>

#include "sim/contact/detection/broad_phase.h"
#include "sim/contact/detection/edge_contacts.h"
#include "sim/contact/detection/vertex_face_contacts.h"

namespace duet {

/// A point of a guest that is near its host: a contact point to be.
struct NearPoint {
  FeatureId feature;      ///< The place on the guest.
  bool reversed = false;  ///< True if the guest of the pair of bodies is the host here.
  /// m, in the host's shape space: the guest's point. For the edge contacts, vertex-face and support-face
  /// contacts of deformable guests it is the foot of that point on the contact plane instead.
  Vec3 position = Vec3::Zero();
  /// Unit, in the host's shape space: outward normal of the host's surface that the point rests against. Zero
  /// for surface points of deformable guests, whose normals are found later.
  Vec3 normal = Vec3::Zero();
  double gap = 0;  ///< m: signed distance of the point from the host; with the contact offset, if it has one.
  int plane_index = -1;  ///< Index of the plane that it was found with in Chunk::feature_edges; -1: none.
  int patch = -1;        ///< Number of its patch, see ContactPoint::patch; -1: none.
  double share = 0;      ///< Fraction of the patch's load, see ContactPoint::share.
  int vertex = -1;       ///< Vertex of a round surface at which the point is; -1: none.
  /// Whether it lies between vertices of round parts the lowest of which are no higher on all sides.
  bool is_between_lowest = false;
};

/// A flat face of one body that lies on a flat face of another. The convex hull of the points that touch
/// bounds it. For lines (line_contact.h) only `number` and `reversed` are set.
struct ContactPatch {
  int number = -1;               ///< ContactPoint::patch of its points.
  bool reversed = false;         ///< NearPoint::reversed of its points.
  Vec3 normal = Vec3::Zero();    ///< Unit, in the host's shape space: outward normal of the host's face.
  Vec3 foot = Vec3::Zero();      ///< m, in the host's shape space: a point of the host's face.
  double area = 0;               ///< m^2: area of the convex hull.
  std::size_t first_corner = 0,  ///< Index of its first corner in ReductionScratch::hull_corners.
      corners = 0;               ///< Number of its corners.
};

/// Scratch of reduce_contacts(), and the patches that it finds for one pair of bodies.
struct ReductionScratch {
  /// A touch in the coordinates of the face of the host that it is above.
  struct FlatPoint {
    int touch = -1;     ///< Number of the touch, counted from the first of those that are reduced.
    double u = 0,       ///< m: first coordinate along the face.
        w = 0;          ///< m: second coordinate along the face.
    double height = 0;  ///< m: height above the face.
  };
  std::vector<Vec3> normals;    ///< Normal of every touch; zero once a face has been found for it.
  std::vector<FlatPoint> face,  ///< Touches above the face of the host that is looked at.
      facet,                    ///< Those of `face` that lie in one supporting plane of the guest.
      carriers;                 ///< Those of `facet` that are kept inside of its convex hull.
  std::vector<int> hull;    ///< Corners of the convex hull of `facet`, counter-clockwise, as indices into it.
  std::vector<char> state;  ///< For every touch: whether it is untouched, kept or dropped.
  std::vector<int> kept;    ///< Numbers of the touches that are kept, in the order in which they shall come.
  std::vector<NearPoint> arranged;       ///< The touches that are kept, in that order.
  std::vector<Eigen::Vector2d> corners,  ///< m, along the face: corners of the hull of `facet`.
      places;                  ///< m, along the face: all points that carry `facet`, its corners first.
  std::vector<double> shares;  ///< Fractions of the load that the points of `places` carry.
  std::vector<ContactPatch> patches;  ///< Patches of the pair of bodies, found in either direction.
  /// m, in the host's shape space: corners of all `patches`, counter-clockwise about their normals.
  std::vector<Vec3> hull_corners;
};

/// Storage of find_candidates(), kept between steps.
struct CandidateSearch {
  BroadPhase broad_phase;  ///< Finds the pairs of bodies that are near each other.

  /// Consecutive surface points of one deformable body.
  struct Block {
    int begin = 0,            ///< First point, an index into Bodies::points.
        end = 0;              ///< One past the last point.
    Eigen::AlignedBox3d box;  ///< m, world: box around the points.
  };
  std::vector<Block> blocks;  ///< Blocks of the deformable bodies that are near a rigid one, body after body.
  std::vector<int> first_block;  ///< For every deformable body that has blocks: the index of the first one.
  std::vector<Vec3> point;  ///< m, world: positions of the surface points of the bodies that have blocks.

  /// The touches of one pair of bodies: a range of Chunk::touches.
  struct PairTouches {
    BodyPair pair;  ///< The two bodies.
    int begin = 0,  ///< First touch.
        end = 0;    ///< One past the last touch.
  };
  /// Results and scratch of one range of pairs, which one thread at a time works on.
  struct Chunk {
    std::vector<PairTouches> pairs;  ///< Pairs of bodies that have touches.
    std::vector<NearPoint> touches;  ///< Touches of all `pairs`.
    std::vector<EdgeContact>
        planes;                ///< Edge contacts and other planes that NearPoint::plane_index refers to.
    std::vector<double> edge;  ///< m: scratch of edge_contact_on(), distances along an edge.
    VertexSearches corners;    ///< Scratch of find_vertex_face_contacts().
    std::vector<EdgeContact> in_faces;  ///< Scratch of visit_places(): contacts in the faces of one guest.
    ReductionScratch reduction;         ///< Scratch and patches of the pair that is looked at.
    std::size_t first_pair = 0,         ///< Index of the first of `pairs` in ContactSet::pairs.
        first_point = 0;                ///< Index of the first of `touches` in ContactSet::points.
  };
  /// One for every range of pairs; those past the present number keep storage only.
  std::vector<Chunk> chunks;
};

}  // namespace duet
