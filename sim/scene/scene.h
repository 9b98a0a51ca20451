// What a scene file says, as plain data in SI units. The reader (reader.h) is the only one that makes it from
// a file; everything in it has been validated there. Cold data: the step never reads it, World is built from
// it.
#pragma once

#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/contact/push_out/push_out_order.h"
#include "sim/deformable/materials/material_model.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/rigid/kinematic_motion.h"
#include "sim/rigid/orientation_update.h"

namespace duet::scene {

struct Location {  // of the table or key in the file; 1-based
  int line = 0;
  int column = 0;
};

struct Rotation {
  Vec3 axis = Vec3::UnitY();  // world axes, any length but 0
  double degrees = 0;
  Vec3 vector() const { return degrees * std::numbers::pi / 180 * axis.normalized(); }  // rad
};

struct Placement {
  Vec3 position = Vec3::Zero();          // m, of the shape's centre; of the origin of a mesh's coordinates
  Quat orientation = Quat::Identity();   // from `rotation = { axis = [x, y, z], degrees = d }`
  Vec3 velocity = Vec3::Zero();          // m/s
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, about the centre of mass, in world axes
};

// Springs of a mass-spring body: a spring pulls with `stiffness` when it is stretched to twice its length.
struct SpringLaw {
  double stiffness = 1000;  // N
  double damping = 1;       // of critical damping of each spring on its particles
};

struct Material {
  std::string name;
  double density = 1000;        // kg/m^3
  double youngs_modulus = 1e6;  // Pa
  double poisson_ratio = 0.45;  // 1, in (-1, 0.5)
  double damping =
      0.01;  // s, stiffness-proportional Rayleigh damping: viscous moduli = damping * elastic moduli
  double mass_damping = 0;  // 1/s, mass-proportional Rayleigh damping: braking force over mass and velocity
  MaterialModel model = MaterialModel::neo_hookean;
  bool has_springs = false;  // they resist stretching in place of finite elements
  SpringLaw springs;
  bool has_bending_springs = false;  // they resist the bending of shells and rods in place of elements
  SpringLaw bending_springs{10, 1};
  double bending_factor = 1;  // of bending elements, on the stiffness that the modulus and the thickness give
};

enum class ShapeKind { box, sphere, capsule, cylinder, torus, mesh };
struct Shape {  // capsules, cylinders and tori have the axis y
  ShapeKind kind = ShapeKind::box;
  double radius = 0;         // m, sphere, capsule, cylinder; of a torus' centre line
  Vec3 size = Vec3::Zero();  // m, full edge lengths, box
  double length = 0;         // m, of a capsule's straight part; height of a cylinder
  double tube = 0;           // m, radius of a torus' tube
  std::string mesh_file{};   // as in the file: relative to the scene's folder
  double scale = 1;          // m of the scene per unit of the mesh
  int cells = 64;            // of a mesh's level set along its longest extent
  std::shared_ptr<const TriangleMesh> mesh =
      nullptr;  // closed; null if the scene was read without its meshes
};

// How a kinematic body moves: duet::KinematicMotion in the terms of the file.
struct Keyframe {
  double time = 0;               // s
  std::optional<Vec3> position;  // m
  std::optional<Vec3> velocity;  // m/s
  bool has_rotation = false;
  Rotation rotation;
};
struct Spin {
  Vec3 axis = Vec3::UnitY();   // world axes, any length but 0
  double rate = 0;             // revolutions per second
  double start = 0;            // s
  std::optional<double> stop;  // s
  double ramp = 0;             // s
};
struct Sinusoid {
  Vec3 amplitude = Vec3::Zero();  // m
  Rotation rotation;
  double frequency = 1;        // Hz
  double phase = 0;            // degrees
  double start = 0;            // s
  std::optional<double> stop;  // s
};
struct Motion {
  std::vector<Keyframe> keyframes;
  Interpolation interpolation = Interpolation::smooth;
  bool loop = false;
  std::vector<Spin> spin;
  std::vector<Sinusoid> sinusoid;
};

struct RigidBody {
  std::string name;
  Location at;
  Shape shape;
  Placement placement;
  bool is_static = false;     // infinite mass, never moves
  bool is_kinematic = false;  // infinite mass, moves as `motion` says
  Motion motion;
  std::optional<double> mass;     // kg; exactly one of mass and density is given for a dynamic body
  std::optional<double> density;  // kg/m^3
  double friction = 0.5;          // Coulomb coefficient; a pair uses the smaller one
  double restitution = 0.5;       // Newton's coefficient; a pair uses the smaller one
  double rolling_friction =
      0;  // m, lever arm of the normal force against rolling; a pair uses the larger one
  double spinning_friction = 0;  // m, the same against spinning about the normal; a pair uses the larger one
  std::optional<double> terminal_speed;  // m/s, at which the drag of the air carries the body's weight
  std::optional<double> sample_spacing;  // m, of contact points on the surface
  std::string look;                      // name of a look
};

// Volumes (a box is cut into a lattice, a surface filled, or tets come from a file), then shells (panel,
// disc: in the plane y = 0, front upward), then rods, then a single particle.
enum class DeformableKind {
  box,
  sphere,
  capsule,
  cylinder,
  torus,
  mesh,
  tets,
  panel,
  disc,
  rod,
  helix,
  knot,
  particle
};
struct DeformableShape {
  DeformableKind kind = DeformableKind::box;
  Vec3 size = Vec3::Zero();                       // m, of the box
  Vec3i cells = Vec3i(4, 4, 4);                   // of the box: lattice cells along each edge
  LatticePattern pattern = LatticePattern::five;  // of the box
  Shape surface;                  // that is filled with tets: any but a box; its scale is a file's, too
  std::optional<double> spacing;  // m, of the tets that fill a surface; none: default_spacing
  bool graded = false;            // larger tets inside
  std::string tet_file;           // as in the scene: relative to its folder
  std::shared_ptr<const TetMesh> tets =
      nullptr;                     // of the file; null if the scene was read without its meshes
  Vec2 panel_size = Vec2::Zero();  // m, along x and z
  Eigen::Vector2i panel_cells = Eigen::Vector2i(16, 16);  // two triangles a cell
  double radius = 0;         // m, of the disc; of the helix; of the knot's ring; of the particle's ball
  int rings = 8;             // of the disc
  std::vector<Vec3> points;  // m, that the rod goes through
  bool is_closed = false;    // the rod ends where it begins
  double pitch = 0;          // m a turn, of the helix
  double turns = 1;          // of the helix
  double tube = 0;           // m, how far the knot winds about its ring
  Eigen::Vector2i winding = Eigen::Vector2i(2, 3);  // of the knot, about the axis y and about its ring
  int segments = 64;                                // of rods
  bool is_shell() const { return kind == DeformableKind::panel || kind == DeformableKind::disc; }
  bool is_volume() const { return kind <= DeformableKind::tets; }
  bool is_particle() const { return kind == DeformableKind::particle; }
  bool is_filled() const {
    return is_volume() && kind != DeformableKind::box && kind != DeformableKind::tets;
  }
};

// Particles near the line from one point to another never move, or move with a kinematic body.
struct Pin {
  Vec3 from = Vec3::Zero();  // m, in the shape's coordinates at rest
  std::optional<Vec3> to;    // m; without it, a point
  double radius = 1e-3;      // m
  std::string body;          // name of a kinematic rigid body; may be empty
};

// Springs that hold flesh to bones, by their effect on the flesh alone.
struct AttachSprings {
  double gain = 1e4;   // 1/s^2, stiffness over the particle's mass
  double damping = 1;  // of critical
};

// A surface that is drawn in place of the boundary and moves with the tets. Forces on it act on them.
struct Skin {
  std::string mesh_file;                               // as in the scene: relative to its folder
  double scale = 1;                                    // m per unit of the mesh
  bool contact = false;                                // rigid bodies touch its vertices, not the boundary
  std::optional<double> mass;                          // kg, besides that of the tets, which carry it
  std::shared_ptr<const TriangleMesh> mesh = nullptr;  // null if the scene was read without its meshes
};

/// Which surface of a volume made of a mesh is drawn: the mesh, or the boundary of the tets that fill it.
enum class DrawnSurface { mesh, tetrahedra };

struct DeformableBody {
  std::string name;
  Location at;
  DeformableShape shape;
  std::optional<double> thickness;  // m, of shells; the diameter of rods
  std::vector<Pin> pins;
  std::vector<std::string> attach;  // names of rigid bodies that hold the particles inside of them
  std::optional<AttachSprings> attach_springs;  // that hold them, in place of stiff bonds
  DrawnSurface drawn = DrawnSurface::mesh;
  std::optional<Skin> skin;  // of volumes; the mesh itself where that is drawn and the scene names no skin
  Placement placement;
  std::string material;                  // name of a material
  std::optional<double> mass;            // kg; overrides density * volume
  std::optional<double> terminal_speed;  // m/s, at which the drag of the air carries the body's weight
  bool incompressible = false;
  std::optional<bool> self_collision;         // with itself; else as collides_with_itself decides
  std::optional<double> collision_thickness;  // m; else a tenth of the surface's shortest edge
  double collision_friction = 0.4;            // against itself and other deformable bodies
  std::string look;
};

// Whether parts of the body are kept from each other: shells and rods fold where volumes hardly can.
inline bool collides_with_itself(const DeformableBody& body) {
  return body.self_collision.value_or(!body.shape.is_volume() && body.shape.kind != DeformableKind::particle);
}

enum class JointType { point, hinge, universal, prismatic, prismatic_twist, weld };
struct JointAxes {               // a joint's frame at the start, in the world, or in a body's own coordinates
  std::optional<Vec3> position;  // m
  Vec3 axis = Vec3::UnitX();     // x of the joint, any length but 0
  std::optional<Vec3> up;        // y of the joint: what of this is at right angles to x
};
struct Interval {
  std::optional<double> least, most;
};
struct TargetSwing {
  Vec3 turn = Vec3::Zero();  // degrees about x, y and z of the joint
  double travel = 0;         // m along x
  double period = 1;         // s
  double phase = 0;          // degrees
};
struct TargetKey {
  double time = 0;  // s
  Vec3 turn = Vec3::Zero();
  double travel = 0;
};
struct TargetWave {                               // of a snake; duet::BodyWave
  double place = 0, spacing = 1, wavelength = 1;  // m
  double period = 1;                              // s
  double bend = 0, height = 0;                    // m
};
struct JointTarget {
  double start = 0;  // s
  Vec3 turn = Vec3::Zero();
  double travel = 0;
  std::vector<TargetSwing> sinusoid;
  std::vector<TargetKey> keyframes;
  bool loop = false;
  bool has_wave = false;
  TargetWave wave;
};
struct JointControl {
  double gain = 1000;                  // 1/s^2
  std::optional<double> damping;       // 1/s; else critical
  std::optional<double> torque_limit;  // N m, or N
  bool x = true, y = true, z = true;
  bool lead = false;
  JointTarget target;
};
struct Joint {
  std::string name;
  Location at;
  JointType type = JointType::point;
  std::string parent, child;  // names of rigid bodies, or `ground`
  JointAxes world;
  bool has_parent_frame = false, has_child_frame = false;
  JointAxes parent_frame, child_frame;
  Interval angle;               // degrees
  std::optional<double> swing;  // degrees
  Interval travel;              // m
  double friction = 0;          // N m, or N
  bool collide = false;
  bool has_control = false;
  JointControl control;
};

struct Ground {       // the half space y <= height, static
  double height = 0;  // m
  double friction = 0.5;
  double restitution = 0.5;
  double rolling_friction = 0;   // m
  double spinning_friction = 0;  // m
  std::string look;
};

enum class Accuracy { draft, standard, fine };
enum class RigidPushOut { all_contacts, deepest_points };
enum class Switch { automatic, on, off };
enum class Integration { semi_implicit, implicit };
enum class Compression { damped, followed };
enum class VelocityConstraints { after_solve, before_solve };
using duet::OrientationUpdate;

// Defaults come from the accuracy preset; a key in the file wins over the preset.
enum class OverlapPolicy { part, refuse };

struct Solver {
  Accuracy accuracy = Accuracy::standard;
  Integration integration = Integration::semi_implicit;  // of elastic forces; damping is always implicit
  int newton_iterations = 20;                            // bound on those of an implicit solve
  double cfl = 0.7;                               // time step as a fraction of the elastic stability limit
  Compression compression = Compression::damped;  // elements that it makes stiffer than any at rest
  double relaxation = 0;  // least limit of elasticity, over the damping time of what damping holds
  double max_travel =
      0.1;  // how far another body may enter a moving one in a step, as a fraction of its size
  double max_rotation = 0.314159;   // rad, largest rotation of a rigid body a step
  double max_time_step = 1.0 / 48;  // s
  double cg_tolerance = 1e-3;       // m/s, largest residual velocity
  int cg_iterations = 1000;         // bound on conjugate-gradient iterations
  int collision_iterations = 5;     // Gauss-Seidel sweeps of step II
  int contact_iterations = 20;      // Gauss-Seidel sweeps of steps III and V.4
  bool whole_islands = true;        // of a few rigid bodies, after these sweeps
  int max_substeps = 100'000;       // of a frame, after which the simulation stops
  double volume_tolerance = 1e-4;   // largest relative error of a one-ring's volume that a step leaves
  int pressure_iterations = 100;    // bound on iterations of the volume correction and of step V.1
  int push_out_iterations = 4;      // geometries of step IV.2
  int push_out_sweeps = 10;         // over the central bodies at one geometry
  bool push_out_gradual = true;     // a growing part of every overlap at first
  PushOutOrder push_out_order = PushOutOrder::together;
  RigidPushOut rigid_push_out = RigidPushOut::all_contacts;
  bool deformable_collision = true;              // of deformable bodies with each other and with themselves
  Switch shock_propagation = Switch::automatic;  // level by level after the sweeps of contact
  VelocityConstraints velocity_constraints = VelocityConstraints::after_solve;  // of step V
  int projection_iterations = 2;  // forward and backward sweeps of the projection in the conjugate gradients
  int face_samples = 4;  // lattice order of extra contact points on deformable faces; 0: vertices only
  bool contact_reduction = true;  // of rigid flat faces, to the points that carry them
  OrientationUpdate orientation = OrientationUpdate::exact;
  bool keep_spin = true;                                // of soft bodies and bones that nothing touches
  OverlapPolicy initial_overlap = OverlapPolicy::part;  // of bodies at frame 0
};

struct CameraKey {                     // what it leaves out is as the camera's own keys say
  double time = 0;                     // s
  std::optional<Vec3> position;        // m
  std::optional<Vec3> target;          // m
  std::optional<double> vertical_fov;  // degrees
};
struct Camera {
  Vec3 position = Vec3(0, 2, 10);
  Vec3 target = Vec3::Zero();
  Vec3 up = Vec3::UnitY();
  double vertical_fov = 30;               // degrees
  std::vector<CameraKey> keyframes = {};  // it moves between them: CameraPath
};

enum class LightKind { area, point };
struct Light {
  std::string name;
  LightKind kind = LightKind::area;
  Vec3 position = Vec3(0, 10, 0);  // m
  Vec3 target = Vec3::Zero();      // m; an area light is a disc that faces its target and casts soft shadows
  double radius = 1;               // m, of the disc
  double power = 1000;  // irradiance at distance d (facing): power / (4 pi d^2), as in the paper's pictures
  Vec3 color = Vec3::Ones();  // linear RGB
  bool shadow = true;         // point lights: false
};

struct Sky {                           // ambient light from all directions, and the background
  Vec3 zenith = Vec3(0.45, 0.6, 0.9);  // linear RGB radiance
  Vec3 horizon = Vec3(0.9, 0.93, 1.0);
  double intensity = 0.5;  // factor on both as light
};

struct Look {
  std::string name;
  Vec3 color = Vec3(0.8, 0.8, 0.8);   // linear RGB, base colour
  double metallic = 0;                // 0..1
  double roughness = 0.5;             // 0..1
  std::string pattern;                // "" or "checker" (ground; bands that show spin on balls: "stripes")
  Vec3 color2 = Vec3(0.6, 0.6, 0.6);  // second colour of the pattern
  double pattern_size = 1;            // m
  double opacity = 1;                 // 0..1, share of a pixel that hides what lies behind
  std::vector<Vec3> spots;            // u, v, radius in texture coordinates: round spots of the second colour
  static constexpr std::size_t most_spots = 16;
};

enum class ColorBy { look, strain };
struct Render {
  int width = 1280;
  int height = 720;
  int supersampling = 2;    // samples per pixel along each axis
  int shadow_samples = 64;  // shadow maps shared by all shadow-casting lights and the sky
  double exposure = 1.0;    // factor on radiance before tone mapping
  ColorBy color = ColorBy::look;
  double strain_range = 0.5;  // at the yellow end of the scale
};

struct Scene {
  std::string path;  // as given
  std::string title;
  std::string figure;               // of the paper, may be empty
  int frames = 240;                 // frames 0..frames are written, frame 0 is the initial state
  double fps = 24;                  // 1/s
  Vec3 gravity = Vec3(0, -9.8, 0);  // m/s^2
  std::vector<Material> materials;
  std::vector<RigidBody> rigid;
  std::vector<DeformableBody> deformable;
  std::vector<Joint> joints;
  std::optional<Ground> ground;
  Solver solver;
  Camera camera;
  bool has_camera = false, has_sky = false;  // whether the file has [camera] and [sky]
  std::vector<Light> lights;
  Sky sky;
  std::vector<Look> looks;
  Render render;
};

}  // namespace duet::scene
