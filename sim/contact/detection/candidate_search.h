// What the search for contact candidates keeps between steps: storage only, no state.
#pragma once

#include <vector>

#include "sim/contact/detection/broad_phase.h"
#include "sim/contact/detection/edge_contacts.h"
#include "sim/contact/detection/vertex_face_contacts.h"

namespace duet {

// A point of a guest that is near its host.
struct NearPoint {
  int point = -1;                // as ContactPoint::guest_point
  bool reversed = false;         // the pair's host is the guest here
  Vec3 position = Vec3::Zero();  // m, in the host's body space
  Vec3 normal = Vec3::Zero();    // of the host's surface that a rigid guest's point rests against
  double gap = 0;                // m
  int ridge = -1;                // in the places found, of a point on a ridge
  int patch = -1;                // as ContactPoint::patch
  double share = 0;              // as ContactPoint::share
};

// A flat face of one body that lies on one of another: the convex hull of the points that touch.
struct ContactPatch {
  int number = -1;                            // ContactPoint::patch of its points
  bool reversed = false;                      // as NearPoint::reversed of its points
  Vec3 normal = Vec3::Zero();                 // unit, outward of the host, in its body space
  Vec3 foot = Vec3::Zero();                   // m, of the host's face, in its body space
  double area = 0;                            // m^2
  std::size_t first_corner = 0, corners = 0;  // of ReductionScratch::hull_corners
};

// Scratch of reduce_contacts.
struct ReductionScratch {
  struct FlatPoint {
    int touch = -1;
    double u = 0, w = 0;  // m, along the plane
    double height = 0;    // m, above the plane
  };
  std::vector<Vec3> normals;
  std::vector<FlatPoint> face, facet, carriers;
  std::vector<int> hull;
  std::vector<char> state;  // of every touch
  std::vector<int> kept;    // touches, in the order in which they shall come
  std::vector<NearPoint> arranged;
  // Of one facet: its corners, all points that carry it, and their shares of the load.
  std::vector<Eigen::Vector2d> corners, places;  // m, along the plane
  std::vector<double> shares;
  // Of all touches of a pair:
  std::vector<ContactPatch> patches;
  std::vector<Vec3> hull_corners;  // m, in the host's body space, counter-clockwise about the normal
};

struct CandidateSearch {
  BroadPhase broad_phase;

  struct Block {  // consecutive surface points of one deformable body
    int begin = 0, end = 0;
    Eigen::AlignedBox3d box;  // m
  };
  std::vector<Block> blocks;
  std::vector<int> first_block;  // of every deformable body that is near a rigid one
  std::vector<Vec3> point;       // m, where the surface points are, of the bodies that have blocks

  struct PairTouches {  // a range of `touches`
    BodyPair pair;
    int begin = 0, end = 0;
  };
  struct Chunk {  // what the pairs of one range found
    std::vector<PairTouches> pairs;
    std::vector<NearPoint> touches;
    std::vector<EdgeContact> ridges;
    std::vector<double> edge;           // m, distances along one
    CornerSearches corners;             // scratch of find_places_at_corners
    std::vector<EdgeContact> in_faces;  // of one pair
    ReductionScratch reduction;
    std::size_t first_pair = 0, first_point = 0;  // where they go
  };
  std::vector<Chunk> chunks;
};

}  // namespace duet
