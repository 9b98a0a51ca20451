// Small closed meshes built in code.
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

Vec3 random_vector(std::mt19937& random);  // in [-1, 1]^3

Quat random_rotation(std::mt19937& random);

// One of assets/, which has no flaws.
std::shared_ptr<TriangleMesh> asset(const std::string& file);

// Triangles of a polygon, as a fan.
void add_face(TriangleMesh& mesh, const std::vector<int>& polygon);

// The box between two corners; vertex i has the upper x, y, z where bits 0, 1, 2 of i are set.
TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper);

TriangleMesh tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// An L of two unit cubes beside and one on top of the first, in the plane z = 0..1; its volume is 3.
TriangleMesh l_mesh();

// The torus about the axis y, with `columns` times `rows` quads whose vertices lie on it.
TriangleMesh torus_mesh(double radius, double tube, int columns, int rows);

TriangleMesh mesh_of(const Surface& surface);

}  // namespace duet::test
