// The name of the place on a body at which a contact is. It stays the same from one step to the next, so that
// a contact finds its impulse of the last step.
#pragma once

#include <compare>

namespace duet {

/// Names a place on the guest of a contact, see ContactPoint.
struct FeatureId {
  /// Kinds of places, with the meaning of `index` and `sub`.
  enum class Kind : int {
    none,     ///< No place.
    support,  ///< Support point `index` of a rigid shape, against plane `sub` of its host; see support().
    point,  ///< RigidProperties::samples[index] of a rigid guest, Bodies::points[index] of a deformable one.
    edge,   ///< Edge contact, next to FeatureEdges::nodes[index] of a rigid guest, on Bodies::edges[index]
            ///< of a deformable one.
    point_on_plane,  ///< Sample `index` of a rigid guest against plane `sub` of several that it touches.
    in_face,         ///< In a face of deformable body `sub`, where feature `index` of the host touches it.
    round,           ///< Lowest vertex of a rigid guest's RoundSurface on the way down from sample `index`.
    vertex           ///< RoundSurface::vertices[index] of a rigid guest.
  };
  Kind kind = Kind::none;  ///< What kind of place it is.
  int index = -1;          ///< Number of the feature.
  int sub = -1;            ///< Number that tells apart contacts at one feature; -1: there is one only.

  /// Names support point `k`. `plane` is -1 for the nearest surface of the host, wherever that is; 0 for the
  /// plane in which it was at the beginning of the step; 1 + f for that of face f of a mesh.
  static FeatureId support(int k, int plane = -1) { return {Kind::support, k, plane}; }
  /// Names sample `i` of a rigid guest or surface point `i` of a deformable one.
  static FeatureId point(int i) { return {Kind::point, i, -1}; }
  /// Names the edge contact next to node `i` of a rigid guest's feature edges, or on edge `i` of Bodies.
  static FeatureId edge(int i) { return {Kind::edge, i, -1}; }

  /// Returns whether it names a place that goes along the surface of its body, as this one turns.
  bool follows() const { return kind == Kind::support || kind == Kind::round; }
  /// Returns whether it names a support point.
  bool is_support() const { return kind == Kind::support; }
  /// Returns whether a rigid guest touches there with ContactPoint::edge, whose plane stays for the step: at
  /// edge contacts, and at samples against one of several planes.
  bool uses_edge_point() const { return kind == Kind::edge || kind == Kind::point_on_plane; }

  /// Returns whether two names are the same.
  friend bool operator==(const FeatureId&, const FeatureId&) = default;
  /// Orders places by kind, then by numbers. Of support points the last ones come first. Solvers visit the
  /// contacts of the last step in this order.
  friend std::strong_ordering operator<=>(const FeatureId& a, const FeatureId& b) {
    if (a.kind != b.kind) return a.kind <=> b.kind;
    if (!a.is_support()) return a.index != b.index ? a.index <=> b.index : a.sub <=> b.sub;
    return a.sub != b.sub ? b.sub <=> a.sub : b.index <=> a.index;
  }
};

}  // namespace duet
