// Holds what a scene file says, as plain data in SI units. Only the reader (reader/reader.h) makes it from a
// file, and validates everything in it. A World is built from it; the time step never reads it.
#pragma once

#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/deformable/materials/material_model.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/rigid/kinematic_motion.h"
#include "sim/scene/output.h"
#include "sim/scene/picture.h"
#include "sim/scene/solver.h"

namespace duet::scene {

/// The position of a table or key in the scene file.
struct Location {
  int line = 0;    ///< Line, 1-based; 0: not in the file.
  int column = 0;  ///< Column, 1-based; 0: not in the file.
};

/// A rotation about an axis, as files give it.
struct Rotation {
  Vec3 axis = Vec3::UnitY();  ///< Axis of the rotation, world axes, of any length but 0.
  double degrees = 0;         ///< Angle, degrees, counterclockwise seen against the axis; may be many turns.
  /// Returns the rotation vector, rad, world axes.
  Vec3 vector() const { return degrees * std::numbers::pi / 180 * axis.normalized(); }
};

/// Position and motion of a body at frame 0.
struct Placement {
  /// World position of the center of the shape, m. For a mesh: of the origin of its coordinates.
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();   ///< Rotation from the shape's coordinates to the world.
  Vec3 velocity = Vec3::Zero();          ///< Velocity of the center of mass, m/s, world axes.
  Vec3 angular_velocity = Vec3::Zero();  ///< Angular velocity about the center of mass, rad/s, world axes.
};

/// Springs of a mass-spring body.
struct SpringLaw {
  double stiffness = 1000;  ///< Force of a spring that is stretched to twice its rest length, N.
  double damping = 1;       ///< Damping of each spring as a fraction of critical, 1.
};

/// A material of deformable bodies.
struct Material {
  std::string name;             ///< Unique name, by which bodies refer to the material.
  double density = 1000;        ///< Density at rest, kg/m^3.
  double youngs_modulus = 1e6;  ///< Young's modulus, Pa.
  double poisson_ratio = 0.45;  ///< Poisson's ratio, 1, in (-1, 0.5).
  /// Stiffness-proportional Rayleigh damping, s: viscous moduli = damping * elastic moduli.
  double damping = 0.01;
  double mass_damping = 0;  ///< Mass-proportional Rayleigh damping, 1/s: braking force / (mass * velocity).
  MaterialModel model = MaterialModel::neo_hookean;  ///< Stress at large strains; all agree at small ones.
  bool has_springs = false;          ///< True if springs resist stretching in place of finite elements.
  SpringLaw springs;                 ///< Law of those springs; used if `has_springs`.
  bool has_bending_springs = false;  ///< True if springs resist bending in place of bending elements.
  SpringLaw bending_springs{10, 1};  ///< Law of those springs; used if `has_bending_springs`.
  /// Factor on the bending stiffness that Young's modulus and the thickness give shells and rods, 1; 0: limp.
  double bending_factor = 1;
};

/// Kinds of closed shapes. Capsules, cylinders and tori have the axis y.
enum class ShapeKind {
  box,       ///< Box about the origin.
  sphere,    ///< Ball about the origin.
  capsule,   ///< Cylinder with round ends.
  cylinder,  ///< Cylinder with flat ends.
  torus,     ///< Ring.
  mesh       ///< Closed triangle mesh from a file.
};

/// A closed shape in its own coordinates. Members that the kind does not need keep their defaults.
struct Shape {
  ShapeKind kind = ShapeKind::box;  ///< Kind of the shape.
  double radius = 0;         ///< Radius of a sphere, capsule or cylinder, or of a torus's center line, m.
  Vec3 size = Vec3::Zero();  ///< Full edge lengths of a box, m.
  double length = 0;         ///< Length of a capsule's straight part, or height of a cylinder, m.
  double tube = 0;           ///< Radius of a torus's tube, m, less than `radius`.
  std::string mesh_file{};   ///< Mesh file as the scene names it, relative to the scene's folder.
  double scale = 1;          ///< Meters per unit of the mesh.
  int cells = 64;            ///< Cells of a mesh's level set along its longest extent.
  /// The closed mesh in the units of its file. Null for other kinds, and if the scene was read without
  /// meshes.
  std::shared_ptr<const TriangleMesh> mesh = nullptr;
};

/// A keyframe of a kinematic body's motion.
struct Keyframe {
  double time = 0;               ///< Time of the keyframe, s; later than that of the one before.
  std::optional<Vec3> position;  ///< World position at that time, m. None: this keyframe has no position.
  std::optional<Vec3> velocity;  ///< Velocity at that time, m/s. None: chosen so that nothing overshoots.
  bool has_rotation = false;     ///< True if `rotation` is given.
  Rotation rotation;             ///< Rotation at that time, from the body's own orientation on.
};

/// A rotation at a constant rate about an axis through the body's position, with ramps at start and stop.
struct Spin {
  Vec3 axis = Vec3::UnitY();   ///< Axis of the rotation, world axes, of any length but 0.
  double rate = 0;             ///< Revolutions per second, 1/s, counterclockwise seen against the axis.
  double start = 0;            ///< Time at which the body begins to turn, s.
  std::optional<double> stop;  ///< Time at which it stands still again, s. None: never.
  double ramp = 0;             ///< Duration of the acceleration and of the deceleration, s.
};

/// A sinusoidal displacement and rotation, both zero at `start`.
struct Sinusoid {
  Vec3 amplitude = Vec3::Zero();  ///< Half the distance from end to end, m, world axes.
  Rotation rotation;              ///< Half the rotation from end to end, about the body's position.
  double frequency = 1;           ///< Cycles per second, Hz.
  double phase = 0;               ///< Phase at `start`, degrees: 0 in full motion, -90 and 90 at rest.
  double start = 0;               ///< Time at which the body begins to move, s.
  std::optional<double> stop;     ///< Time at which it stops, wherever it is, s. None: never.
};

/// The prescribed motion of a kinematic body: duet::KinematicMotion in the terms of the file.
struct Motion {
  std::vector<Keyframe> keyframes;  ///< Positions and rotations at times; empty: those of the placement.
  Interpolation interpolation = Interpolation::smooth;  ///< Interpolation between keyframes.
  bool loop = false;               ///< True if the keyframes repeat; the last one equals the first one.
  std::vector<Spin> spin;          ///< Rotations that are applied after the keyframes, in turn.
  std::vector<Sinusoid> sinusoid;  ///< Sinusoidal motions that are applied after the spins.
};

/// A rigid body: dynamic, static or kinematic.
struct RigidBody {
  std::string name;               ///< Name, unique among all bodies.
  Location at;                    ///< Position of its table in the scene file.
  Shape shape;                    ///< Shape, which is also its contact surface.
  Placement placement;            ///< Position and motion at frame 0.
  bool is_static = false;         ///< True if the body has infinite mass and never moves.
  bool is_kinematic = false;      ///< True if the body has infinite mass and moves as `motion` says.
  Motion motion;                  ///< Prescribed motion; used if `is_kinematic`.
  std::optional<double> mass;     ///< Mass, kg. A dynamic body has exactly one of mass and density.
  std::optional<double> density;  ///< Density, kg/m^3. A dynamic body has exactly one of mass and density.
  double friction = 0.5;          ///< Coulomb friction coefficient, 1; a pair uses the smaller one.
  double restitution = 0.5;       ///< Newton's coefficient of restitution, 1; a pair uses the smaller one.
  double rolling_friction = 0;  ///< Lever arm of the normal force against rolling, m; a pair uses the larger.
  /// Lever arm of the normal force against spin about the normal, m; a pair uses the larger one.
  double spinning_friction = 0;
  /// Speed at which the drag of the air equals the body's weight, m/s. None: no drag.
  std::optional<double> terminal_speed;
  /// Distance of the contact points on the surface, m. None: see default_sample_spacing().
  std::optional<double> sample_spacing;
  std::string look;  ///< Name of a look; empty: a color of its own, or plain if static.
};

/// Kinds of deformable shapes. The order matters: volumes come first (box to tets), then shells (panel,
/// disc), then rods (rod, helix, knot), then the particle.
enum class DeformableKind {
  box,       ///< Box that is cut into a lattice of tetrahedra.
  sphere,    ///< Ball that is filled with tetrahedra.
  capsule,   ///< Capsule that is filled with tetrahedra.
  cylinder,  ///< Cylinder that is filled with tetrahedra.
  torus,     ///< Torus that is filled with tetrahedra.
  mesh,      ///< Closed triangle mesh that is filled with tetrahedra.
  tets,      ///< Tetrahedra from a file.
  panel,     ///< Rectangular shell in the plane y = 0 with its front upward.
  disc,      ///< Round shell in the plane y = 0 with its front upward.
  rod,       ///< Rod through given points.
  helix,     ///< Rod that is wound about the axis y.
  knot,      ///< Closed rod on a torus about the axis y.
  particle   ///< Single particle with a contact radius.
};

/// The shape of a deformable body at rest. Members that the kind does not need keep their defaults.
struct DeformableShape {
  DeformableKind kind = DeformableKind::box;      ///< Kind of the shape.
  Vec3 size = Vec3::Zero();                       ///< Full edge lengths of a box, m.
  Vec3i cells = Vec3i(4, 4, 4);                   ///< Lattice cells of a box along each edge.
  LatticePattern pattern = LatticePattern::five;  ///< Division of a box's cells into tetrahedra.
  /// Surface that is filled with tetrahedra, of any kind but a box. Its `scale` also scales a file of
  /// tetrahedra.
  Shape surface;
  /// Spacing of the tetrahedra that fill a surface, m. None: default_spacing().
  std::optional<double> spacing;
  bool graded = false;   ///< True if the tetrahedra that fill a surface grow toward its inside.
  std::string tet_file;  ///< File of tetrahedra as the scene names it, relative to the scene's folder.
  /// The tetrahedra of `tet_file` in its units. Null for other kinds, and if the scene was read without
  /// meshes.
  std::shared_ptr<const TetMesh> tets = nullptr;
  Vec2 panel_size = Vec2::Zero();  ///< Edge lengths of a panel along x and z, m.
  /// Cells of a panel along x and z, two triangles each.
  Eigen::Vector2i panel_cells = Eigen::Vector2i(16, 16);
  double radius = 0;         ///< Radius of a disc, helix, knot's ring or particle, m.
  int rings = 8;             ///< Rings of nodes of a disc about the middle node.
  std::vector<Vec3> points;  ///< Points that a rod goes through in order, m.
  bool is_closed = false;    ///< True if a rod leads from its last point back to its first.
  double pitch = 0;          ///< Rise of one turn of a helix, m.
  double turns = 1;          ///< Turns of a helix from end to end.
  double tube = 0;           ///< Distance of a knot from its ring, m, less than `radius`.
  Eigen::Vector2i winding = Eigen::Vector2i(2, 3);  ///< Turns of a knot about the axis y and about its ring.
  int segments = 64;                                ///< Segments of a rod, helix or knot.
  /// True for a panel or disc.
  bool is_shell() const { return kind == DeformableKind::panel || kind == DeformableKind::disc; }
  /// True if the shape consists of tetrahedra.
  bool is_volume() const { return kind <= DeformableKind::tets; }
  /// True for a single particle.
  bool is_particle() const { return kind == DeformableKind::particle; }
  /// True if `surface` is filled with tetrahedra.
  bool is_filled() const {
    return is_volume() && kind != DeformableKind::box && kind != DeformableKind::tets;
  }
};

/// Holds the particles near a line segment: they never move, or move with a kinematic body.
struct Pin {
  Vec3 from = Vec3::Zero();  ///< First end of the segment, m, in the shape's coordinates at rest.
  std::optional<Vec3> to;    ///< Other end, m, in the same coordinates. None: the segment is a point.
  double radius = 1e-3;      ///< Largest distance of a held particle from the segment, m.
  std::string body;          ///< Name of the kinematic rigid body that carries the particles; empty: none.
};

/// Springs that hold particles of flesh to bones (soft bindings).
struct AttachSprings {
  double gain = 1e4;   ///< Stiffness of a spring over the mass of its particle, 1/s^2.
  double damping = 1;  ///< Damping as a fraction of critical, 1.
};

/// A surface that is drawn in place of the boundary of the tetrahedra and moves with them. Forces on it act
/// on the tetrahedra.
struct Skin {
  std::string mesh_file;       ///< Mesh file as the scene names it, relative to the scene's folder.
  double scale = 1;            ///< Meters per unit of the mesh.
  bool contact = false;        ///< True if rigid bodies touch its vertices instead of the boundary.
  std::optional<double> mass;  ///< Mass that it adds to the tetrahedra, kg. None: 0.
  /// The closed mesh in the units of its file; null if the scene was read without its meshes.
  std::shared_ptr<const TriangleMesh> mesh = nullptr;
};

/// Drawn surface of a volume that fills a mesh.
enum class DrawnSurface {
  mesh,       ///< The mesh.
  tetrahedra  ///< The boundary of the tetrahedra that fill it.
};

/// A deformable body: volume, shell, rod or particle.
struct DeformableBody {
  std::string name;                 ///< Name, unique among all bodies.
  Location at;                      ///< Position of its table in the scene file.
  DeformableShape shape;            ///< Shape at rest.
  std::optional<double> thickness;  ///< Thickness of a shell or diameter of a rod, m. None: volume, particle.
  std::vector<Pin> pins;            ///< Pins that hold some of its particles.
  std::vector<std::string> attach;  ///< Names of the rigid bodies that hold the particles inside of them.
  /// Springs by which `attach` holds the particles. None: they are rigidly bound (hard bindings).
  std::optional<AttachSprings> attach_springs;
  DrawnSurface drawn = DrawnSurface::mesh;  ///< Drawn surface of a volume that fills a mesh.
  /// Drawn surface of a volume. The reader makes one of the mesh of a volume that fills a mesh, if the scene
  /// gives no skin and `drawn` is `mesh`.
  std::optional<Skin> skin;
  Placement placement;         ///< Position and motion at frame 0.
  std::string material;        ///< Name of its material.
  std::optional<double> mass;  ///< Mass, kg. None: density of the material times the volume at rest.
  /// Speed at which the drag of the air equals the body's weight, m/s. None: no drag.
  std::optional<double> terminal_speed;
  bool incompressible = false;  ///< True if the volume around every particle is kept.
  /// True if the body collides with itself. None: see collides_with_itself().
  std::optional<bool> self_collision;
  /// Gap to itself and other deformable bodies, m. None: the thickness (for shells, limited by the mesh), or
  /// a tenth of the shortest edge of a volume's surface.
  std::optional<double> collision_thickness;
  double collision_friction = 0.4;  ///< Coulomb friction coefficient against itself and deformable bodies, 1.
  std::string look;                 ///< Name of a look; empty: a color of its own.
};

/// Returns whether contact of the body with itself is simulated. By default it is for shells and rods, which
/// fold, and not for volumes, which hardly can, nor for particles.
inline bool collides_with_itself(const DeformableBody& body) {
  return body.self_collision.value_or(!body.shape.is_volume() && body.shape.kind != DeformableKind::particle);
}

/// Types of joints by the relative motions that they leave free, in the order of duet::JointKind, which
/// defines them.
enum class JointType {
  point,            ///< All rotations.
  hinge,            ///< Rotation about x.
  universal,        ///< Rotation about the parent's x and the child's y.
  prismatic,        ///< Translation along x.
  prismatic_twist,  ///< Translation along x and rotation about it.
  weld              ///< None.
};

/// The frame of a joint at the start, in the world or in the coordinates of a body's shape.
struct JointAxes {
  std::optional<Vec3> position;  ///< Origin of the frame, m. None: the origin of the coordinates.
  Vec3 axis = Vec3::UnitX();     ///< Axis x of the joint, of any length but 0.
  std::optional<Vec3> up;        ///< Its component at right angles to x is y of the joint. None: any.
};

/// Bounds of a coordinate of a joint, in degrees or m as its user says.
struct Interval {
  std::optional<double> least,  ///< Lower bound. None: unbounded.
      most;                     ///< Upper bound. None: unbounded.
};

/// A sinusoidal part of a joint's target.
struct TargetSinusoid {
  Vec3 turn = Vec3::Zero();  ///< Amplitude as a rotation vector in the joint's axes, degrees.
  double travel = 0;         ///< Amplitude along x of a prismatic joint, m.
  double period = 1;         ///< Period, s.
  double phase = 0;          ///< Phase at the start, degrees: 0 in the middle, 90 at the end.
};

/// A keyframe of a joint's target.
struct TargetKey {
  double time = 0;           ///< Time after the start of the target, s.
  Vec3 turn = Vec3::Zero();  ///< Rotation vector in the joint's axes, degrees.
  double travel = 0;         ///< Displacement along x of a prismatic joint, m.
};

/// The traveling wave of a snake as a joint's target; see duet::BodyWave.
struct TargetWave {
  double place = 0,    ///< Position of the joint along the spine, m.
      spacing = 1,     ///< Distance to the joints before and after, m.
      wavelength = 1;  ///< Wavelength along the spine, m.
  double period = 1;   ///< Period of the wave, s.
  double bend = 0,     ///< Amplitude to the sides, along z, m.
      height = 0;      ///< Amplitude upward, along y, m.
};

/// Target of a controlled joint: the sum of a constant and of functions of time; see duet::JointTarget.
struct JointTarget {
  double start = 0;  ///< Time at which the functions of time begin, s; before, the target grows linearly.
  Vec3 turn = Vec3::Zero();              ///< Constant part: rotation vector in the joint's axes, degrees.
  double travel = 0;                     ///< Constant part along x of a prismatic joint, m.
  Vec3 turn_rate = Vec3::Zero();         ///< Part that grows from `start` on, degrees/s.
  double travel_rate = 0;                ///< The same along x of a prismatic joint, m/s.
  std::vector<TargetSinusoid> sinusoid;  ///< Sinusoidal parts.
  std::vector<TargetKey> keyframes;      ///< Keyframes of one part, smooth between them; may be empty.
  bool loop = false;                     ///< True if the keyframes repeat.
  bool has_wave = false;                 ///< True if `wave` is given.
  TargetWave wave;                       ///< Traveling wave; used if `has_wave`.
};

/// Proportional-derivative control of a joint: its error e obeys e'' + damping e' + gain e = 0.
struct JointControl {
  double gain = 1000;                  ///< Proportional gain k_p, 1/s^2.
  std::optional<double> damping;       ///< Derivative gain k_v, 1/s. None: critical, 2 sqrt(k_p).
  std::optional<double> torque_limit;  ///< Largest torque about an axis, N m, or force, N. None: unlimited.
  bool x = true,       ///< True if rotation about x of a point or universal joint is controlled.
      y = true,        ///< True if rotation about y is controlled.
      z = true;        ///< True if rotation about z is controlled.
  bool lead = false;   ///< True if the control knows the target's rate and does not lag by 2 / sqrt(k_p).
  JointTarget target;  ///< Target of the control.
};

/// A joint between two rigid bodies. Either `world` has a position, or both body frames are given.
struct Joint {
  std::string name;                   ///< Name, unique among the joints.
  Location at;                        ///< Position of its table in the scene file.
  JointType type = JointType::point;  ///< Motions that it leaves free.
  std::string parent,                 ///< Name of a rigid body, or `ground`.
      child;                          ///< Name of another rigid body.
  JointAxes world;                    ///< Frame in the world at the start.
  bool has_parent_frame = false,      ///< True if `parent_frame` is given.
      has_child_frame = false;        ///< True if `child_frame` is given.
  JointAxes parent_frame,             ///< Frame in the coordinates of the parent's shape.
      child_frame;                    ///< Frame in the coordinates of the child's shape.
  Interval angle;                     ///< Bounds of the angle of a hinge or prismatic_twist joint, degrees.
  std::optional<double> swing;        ///< Largest angle between the x axes of a point joint, degrees.
  Interval travel;                    ///< Bounds of the displacement along x of a prismatic joint, m.
  /// Largest friction torque about, N m, and force along, N, each axis that is free and not controlled.
  double friction = 0;
  bool collide = false;      ///< True if parent and child can touch each other.
  bool has_control = false;  ///< True if `control` is given.
  JointControl control;      ///< Control of the joint; used if `has_control`.
};

/// The ground: a static rigid body that fills the half space y <= height.
struct Ground {
  double height = 0;             ///< Height of its surface, m.
  double friction = 0.5;         ///< Coulomb friction coefficient, 1; see RigidBody::friction.
  double restitution = 0.5;      ///< Newton's coefficient of restitution, 1; see RigidBody::restitution.
  double rolling_friction = 0;   ///< Lever arm against rolling, m; see RigidBody::rolling_friction.
  double spinning_friction = 0;  ///< Lever arm against spin, m; see RigidBody::spinning_friction.
  std::string look;              ///< Name of a look; empty: the default of the ground.
};

/// A validated scene.
struct Scene {
  std::string path;                        ///< Path of the scene file as given.
  std::string title;                       ///< What the scene shows; may be empty.
  std::string figure;                      ///< Figure of the paper that the scene follows; may be empty.
  int frames = 240;                        ///< Number of the last frame; frame 0 is the initial state.
  double fps = 24;                         ///< Frames per simulated second, 1/s.
  Vec3 gravity = Vec3(0, -9.8, 0);         ///< Acceleration of gravity, m/s^2, world axes.
  std::vector<Material> materials;         ///< Materials of the deformable bodies.
  std::vector<RigidBody> rigid;            ///< Rigid bodies without the ground.
  std::vector<DeformableBody> deformable;  ///< Deformable bodies.
  std::vector<Joint> joints;               ///< Joints between rigid bodies.
  std::optional<Ground> ground;            ///< The ground. None: there is none.
  Solver solver;                           ///< Accuracy and bounds of the simulation.
  Camera camera;                           ///< The camera.
  bool has_camera = false,                 ///< True if the file has [camera].
      has_sky = false;                     ///< True if the file has [sky].
  std::vector<Light> lights;               ///< Lights; empty: the renderer may add one.
  Sky sky;                                 ///< Ambient light and background.
  std::vector<Look> looks;                 ///< Looks of surfaces.
  Render render;                           ///< Size and quality of the pictures.
  Output output;                           ///< What is written besides the frames.
};

}  // namespace duet::scene
