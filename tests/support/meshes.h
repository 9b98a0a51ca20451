// Small closed meshes that are built in code, and random vectors.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/places.h"

#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet::test {

// Returns a uniformly distributed vector in [-1, 1]^3.
Vec3 random_vector(std::mt19937& random);

// Returns a rotation by -3 to 3 rad about a random axis. It is not uniformly distributed. Draws the axis
// first, then the angle.
Quat random_rotation(std::mt19937& random);

// Reads a mesh of the folder assets/. The test fails if the mesh has flaws.
std::shared_ptr<TriangleMesh> asset(const std::string& file);

// Appends the triangles of a convex polygon, as a fan around its first vertex.
void add_face(TriangleMesh& mesh, const std::vector<int>& polygon);

// Returns the box between two corners (m). Vertex i has the upper x, y, z if the bits 0, 1, 2 of i are set.
TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper);

// Returns the surface of a tetrahedron, with outward normals if (b - a) x (c - a) . (d - a) > 0.
TriangleMesh tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// Returns an L of three unit cubes: two side by side along x, and one on top of the first, between z = 0 and
// 1. Its volume is 3 m^3.
TriangleMesh l_mesh();

// Returns a torus about the y axis with `columns` quads around the axis and `rows` around the tube, whose
// vertices lie on the torus. `radius` is that of the circle in the middle of the tube, `tube` that of the
// tube (m).
TriangleMesh torus_mesh(double radius, double tube, int columns, int rows);

// Returns a ball about the origin (m) with `columns` quads around the y axis and `rows` rows from pole to
// pole, those at the poles of triangles. Its vertices lie on the ball.
TriangleMesh ball_mesh(double radius, int columns, int rows);

// Returns a drum about the y axis: a prism whose `columns` corners have the distance `radius` from the axis
// (m), between y = -width / 2 and width / 2.
TriangleMesh drum_mesh(double radius, double width, int columns);

// Returns a bowl about the y axis: the part of a hollow ball about the origin, with the inner radius `radius`
// and walls of `wall` (m), that is within 70 degrees of its lowest point. It has `columns` quads around the
// axis and `rows` rows on either side.
TriangleMesh bowl_mesh(double radius, double wall, int columns, int rows);

// Returns positions and triangles of a surface.
TriangleMesh mesh_of(const Surface& surface);

}  // namespace duet::test
