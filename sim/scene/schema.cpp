#include "sim/scene/schema.h"

#include <iterator>

#include "sim/base/frame_limits.h"
#include "sim/scene/schema_parts.h"

namespace duet::scene {
namespace {

Bounds strictly_between(double lower, double upper) { return {lower, upper, true, true}; }

Key rotation_key(Rotation& rotation, std::string_view meaning = "turns the shape about its position",
                 bool* given = nullptr) {
  return {"rotation",
          Group{{{"axis", &rotation.axis, "", any, "axis of the rotation, in world axes; any length but 0",
                  required},
                 {"degrees", &rotation.degrees, "degrees", any,
                  "angle, counter-clockwise seen against the axis", required}},
                given},
          "", any, meaning};
}

Key motion_key(RigidBody& body) {
  Motion& motion = body.motion;
  return {
      "motion",
      Group{{{"keyframes", list(motion.keyframes), "", any, "places at times; at rest before and after them"},
             {"interpolation", choice(motion.interpolation, {"smooth", "linear"}), "", any,
              "between keyframes: smooth, or at constant velocity"},
             {"loop", &motion.loop, "", any, "the keyframes repeat; the last one is the first one again"},
             {"spin", list(motion.spin), "", any, "turning at a constant rate"},
             {"sinusoid", list(motion.sinusoid), "", any, "swinging to and fro"}},
            &body.is_kinematic},
      "", any, "makes the body kinematic: it moves as this says, has no mass, and nothing stops it"};
}

std::vector<Key> shape_keys(Shape& shape) {
  return {
      {"box", &shape.size, "m", positive, "full edge lengths", one_of},
      {"sphere", &shape.radius, "m", positive, "radius", one_of},
      {"capsule",
       Group{{{"radius", &shape.radius, "m", positive, "of the round ends", required},
              {"length", &shape.length, "m", positive, "of the straight part, along y", required}}},
       "", any, "`{ radius = r, length = l }`", one_of},
      {"cylinder",
       Group{{{"radius", &shape.radius, "m", positive, "of the round side", required},
              {"height", &shape.length, "m", positive, "along y", required}}},
       "", any, "`{ radius = r, height = h }`", one_of},
      {"torus",
       Group{{{"radius", &shape.radius, "m", positive, "of the tube's center line, about y", required},
              {"tube", &shape.tube, "m", positive, "radius of the tube, less than the other", required}}},
       "", any, "`{ radius = r, tube = t }`", one_of},
      {"mesh", &shape.mesh_file, "", any,
       "closed triangle mesh: .obj .ply .stl .gltf .glb; the path starts at the scene's folder", one_of},
      {"scale", &shape.scale, "", positive, "metres per unit of the mesh; meshes only"},
      {"cells", &shape.cells, "", between(8, 256),
       "of the grid of distances, along the longest extent of the mesh; meshes only"},
  };
}

// Returns the key of a table of springs, which sets `given` if the file has it.
Key springs_key(std::string_view name, SpringLaw& law, bool& given, std::string_view meaning) {
  return {
      name,
      Group{{{"stiffness", &law.stiffness, "N", positive, "force of a spring stretched to twice its length",
              required},
             {"damping", &law.damping, "", non_negative, "of critical damping of a spring on its particles"}},
            &given},
      "", any, meaning};
}

// Bounds of the number of segments of a rod.
const Bounds segments{.lower = 3, .upper = 1e5};

std::vector<Key> shape_keys(DeformableShape& shape) {
  std::vector<Key> keys = {
      {"box", &shape.size, "m", positive, "full edge lengths at rest", one_of},
      {"cells", &shape.cells, "", between(1, 128), "lattice cells along each edge of the box; boxes only"},
      {"pattern", choice(shape.pattern, {"five", "six", "bcc"}), "", any,
       "five mirrored or six equal tetrahedra a cell, or body-centerd cubic; boxes only"},
      {"tets", &shape.tet_file, "", any,
       "tetrahedra from a file: .mesh (Medit) or .msh (Gmsh); the path starts at the scene's folder", one_of},
      {"spacing", &shape.spacing, "m", positive,
       "of the tetrahedra that fill a surface; without it, four cells across the thickest part"},
      {"graded", &shape.graded, "", any, "larger tetrahedra inside, where they fill a surface"},
      {"panel",
       Group{{{"size", &shape.panel_size, "m", positive, "along x and z", required},
              {"cells", &shape.panel_cells, "", between(1, 1000), "along x and z, two triangles a cell"}}},
       "", any, "rectangle of cloth or plate about the origin, in the plane y = 0", one_of},
      {"disc",
       Group{{{"radius", &shape.radius, "m", positive, "of its rim", required},
              {"rings", &shape.rings, "", between(1, 300), "of nodes about the middle one"}}},
       "", any, "of cloth or plate, in the plane y = 0", one_of},
      {"rod",
       Group{{{"points", &shape.points, "m", any, "that it goes through in order, two or more", required},
              {"closed", &shape.is_closed, "", any, "from the last point it leads back to the first one"},
              {"segments", &shape.segments, "", segments, "of equal length"}}},
       "", any, "rope or wire through points, smooth between them", one_of},
      {"helix",
       Group{{{"radius", &shape.radius, "m", positive, "about the axis y", required},
              {"pitch", &shape.pitch, "m", positive, "rise of one turn", required},
              {"turns", &shape.turns, "", above_up_to(0, 1e3), "from end to end"},
              {"segments", &shape.segments, "", segments, "of equal length"}}},
       "", any, "rope or wire wound up as a screw", one_of},
      {"knot",
       Group{{{"radius", &shape.radius, "m", positive, "of a ring about the axis y", required},
              {"tube", &shape.tube, "m", positive, "how far from the ring it winds, less than its radius",
               required},
              {"winding", &shape.winding, "", between(1, 50), "turns about the axis and about the ring"},
              {"segments", &shape.segments, "", segments, "of equal length"}}},
       "", any, "closed rope wound about a ring; the trefoil has the winding [2, 3]", one_of},
      {"particle", &shape.radius, "m", positive,
       "radius of a ball that slides and falls but does not turn; it touches rigid bodies only", one_of},
  };
  for (Key& key : shape_keys(shape.surface)) {
    if (key.name == "box" || key.name == "cells") continue;
    if (key.name == "scale") key.meaning = "metres per unit of the mesh or of the file of tetrahedra";
    keys.push_back(std::move(key));
  }
  return keys;
}

}  // namespace

std::vector<Key> keys(Scene& scene) {
  return {
      {"title", &scene.title, "", any, "what the scene shows"},
      {"figure", &scene.figure, "", any, "the figure of the paper that the scene follows"},
      {"frames", &scene.frames, "", between(1, max_frames),
       "frames to simulate; frame 0, the initial state, comes on top"},
      {"fps", &scene.fps, "1/s", between(min_fps, max_fps), "frames per simulated second"},
      {"gravity", &scene.gravity, "m/s^2", any, "acceleration of all bodies; y is up"},
  };
}

std::vector<Key> keys(Material& material) {
  return {
      {"density", &material.density, "kg/m^3", positive, "mass of a unit of undeformed volume"},
      {"youngs_modulus", &material.youngs_modulus, "Pa", positive, "stiffness against stretching"},
      {"poisson_ratio", &material.poisson_ratio, "", strictly_between(-1, 0.5),
       "lateral shrinking under a stretch; 0.5 would be incompressible"},
      {"damping", &material.damping, "s", non_negative, "viscous moduli = damping * elastic moduli"},
      {"mass_damping", &material.mass_damping, "1/s", non_negative,
       "braking force over mass and velocity; slows the body as a whole, too"},
      {"model", choice(material.model, {std::begin(material_model_names), std::end(material_model_names)}),
       "", any, "how stress follows from large strains; at small strains all are alike"},
      springs_key("springs", material.springs, material.has_springs,
                  "resist stretching in place of finite elements, along edges and across tetrahedra"),
      springs_key("bending_springs", material.bending_springs, material.has_bending_springs,
                  "resist bending in place of bending elements, across edges and over the nodes of rods"),
      {"bending_factor", &material.bending_factor, "", non_negative,
       "on the bending stiffness that Young's modulus and the thickness give shells and rods; 0: limp"},
  };
}

std::vector<Key> keys(Pin& pin) {
  return {
      {"from", &pin.from, "m", any, "a point, in the coordinates of the shape at rest", required},
      {"to", &pin.to, "m", any, "the other end of a line; without it, the point alone"},
      {"radius", &pin.radius, "m", positive, "how far from there particles are held"},
      {"body", Reference{&pin.body, "rigid"}, "", any,
       "a rigid body with a `motion`, which carries the particles along; without it, they never move"},
  };
}

std::vector<Key> keys(Keyframe& keyframe) {
  return {
      {"time", &keyframe.time, "s", any, "of the keyframe; later than that of the one before it", required},
      {"position", &keyframe.position, "m", any, "at that time, in place of the body's `position`"},
      {"velocity", &keyframe.velocity, "m/s", any,
       "at that time, with a position; else 0 at the ends and chosen so that nothing overshoots between"},
      rotation_key(keyframe.rotation, "at that time, from the body's `rotation` on; may be many turns",
                   &keyframe.has_rotation),
  };
}

std::vector<Key> keys(Spin& spin) {
  return {
      {"axis", &spin.axis, "", any, "through the body's position, in world axes; any length but 0", required},
      {"rate", &spin.rate, "1/s", any, "revolutions per second, counter-clockwise seen against the axis",
       required},
      {"start", &spin.start, "s", any, "when it begins to turn"},
      {"stop", &spin.stop, "s", any, "when it stands still again; without it, never"},
      {"ramp", &spin.ramp, "s", non_negative,
       "how long it takes to reach its rate, and to lose it at the end"},
  };
}

std::vector<Key> keys(Sinusoid& sinusoid) {
  return {
      {"amplitude", &sinusoid.amplitude, "m", any, "half of the way from end to end"},
      rotation_key(sinusoid.rotation, "half of the turn from end to end, about the body's position"),
      {"frequency", &sinusoid.frequency, "Hz", positive, "cycles per second", required},
      {"phase", &sinusoid.phase, "degrees", any,
       "where in the cycle it starts, at no displacement: 0 in full motion, -90 and 90 at rest"},
      {"start", &sinusoid.start, "s", any, "when it begins to move"},
      {"stop", &sinusoid.stop, "s", any, "when it stops moving, wherever it is; without it, never"},
  };
}

std::vector<Key> keys(RigidEntry& entry) {
  RigidBody& body = entry.body;
  Placement& placement = body.placement;
  return {
      {"name", Name{&body.name}, "", any, "unique among all bodies; `ground` is taken", required},
      {"shape", Group{shape_keys(body.shape)}, "", any,
       "exactly one of its box, sphere, capsule, cylinder, torus and mesh", required},
      {"position", &placement.position, "m", any,
       "of the shape's center; of the origin of a mesh's coordinates"},
      rotation_key(entry.rotation),
      {"velocity", &placement.velocity, "m/s", any, "of the center of mass at frame 0; dynamic bodies only"},
      {"angular_velocity", &placement.angular_velocity, "rad/s", any,
       "about the center of mass at frame 0, in world axes; dynamic bodies only"},
      {"static", &body.is_static, "", any, "the body never moves and has no mass"},
      motion_key(body),
      {"mass", &body.mass, "kg", positive,
       "of the body; exactly one of mass and density, dynamic bodies only", one_of},
      {"density", &body.density, "kg/m^3", positive,
       "of a unit of volume; exactly one of mass and density, dynamic bodies only", one_of},
      {"friction", &body.friction, "", non_negative,
       "Coulomb's coefficient; a pair of bodies uses the smaller one"},
      {"restitution", &body.restitution, "", between(0, 1),
       "Newton's coefficient of rebound; a pair of bodies uses the smaller one"},
      {"rolling_friction", &body.rolling_friction, "m", non_negative,
       "lever arm of the normal force that brakes rolling; a pair of bodies uses the larger one"},
      {"spinning_friction", &body.spinning_friction, "m", non_negative,
       "lever arm of the normal force that brakes spin about the normal; a pair of bodies uses the larger "
       "one"},
      {"terminal_speed", &body.terminal_speed, "m/s", positive,
       "at which the air's drag, which grows with the speed's square, carries its weight; else no drag"},
      {"sample_spacing", &body.sample_spacing, "m", positive,
       "of contact points on the surface; without it, an eighth of the edge of a cube of the same volume"},
      {"look", Reference{&body.look, "looks"}, "", any,
       "how the body is drawn; without one, in a color of its own, or plain where it is static"},
      repeat_key(entry.repeat),
  };
}

std::vector<Key> keys(DeformableEntry& entry) {
  DeformableBody& body = entry.body;
  Placement& placement = body.placement;
  return {
      {"name", Name{&body.name}, "", any, "unique among all bodies; `ground` is taken", required},
      {"shape", Group{shape_keys(body.shape)}, "", any,
       "exactly one: volume (box to tets), shell (panel, disc), rod (rod, helix, knot) or particle",
       required},
      {"thickness", &body.thickness, "m", positive, "of shells, which need one; the diameter of rods",
       one_of},
      {"pins", list(body.pins), "", any,
       "particles that never move, for example where a cloth hangs, or move with a kinematic body"},
      {"attach", References{&body.attach, "rigid"}, "", any,
       "rigid bodies, as bones: the particles inside of them move with them, and the two never touch"},
      {"attach_springs",
       Group{{{"gain", &entry.attach_springs.gain, "1/s^2", positive,
               "stiffness of a spring over the mass of its particle", required},
              {"damping", &entry.attach_springs.damping, "", non_negative, "of critical"}},
             &entry.has_attach_springs},
       "", any, "springs that hold the particles to their bones, in place of stiff bonds"},
      {"skin",
       Group{{{"mesh", &entry.skin.mesh_file, "", any,
               "closed triangle mesh in the coordinates of the shape; the path starts at the scene's folder",
               required},
              {"scale", &entry.skin.scale, "", positive, "metres per unit of the mesh"},
              {"contact", &entry.skin.contact, "", any,
               "whether rigid bodies touch its vertices in place of the tetrahedra's boundary"},
              {"mass", &entry.skin.mass, "kg", positive,
               "of the surface, besides that of the tetrahedra; without it, none"}},
             &entry.has_skin},
       "", any, "surface that is drawn and exported in place of the tetrahedra's, which carry it along"},
      {"drawn", choice(body.drawn, {"mesh", "tetrahedra"}), "", any,
       "surface of a mesh that is filled: the mesh, or the boundary of the tetrahedra, which touches"},
      {"position", &placement.position, "m", any,
       "of the shape's center; of the origin of a mesh's coordinates"},
      rotation_key(entry.rotation),
      {"velocity", &placement.velocity, "m/s", any, "of the center at frame 0"},
      {"angular_velocity", &placement.angular_velocity, "rad/s", any,
       "about the center at frame 0, in world axes"},
      {"material", Reference{&body.material, "materials"}, "", any, "what the body is made of", required},
      {"mass", &body.mass, "kg", positive, "replaces the material's density * volume"},
      {"terminal_speed", &body.terminal_speed, "m/s", positive,
       "at which the air's drag, which grows with the speed's square, carries its weight; else no drag"},
      {"incompressible", &body.incompressible, "", any,
       "keeps the volume around every particle, whatever the material's Poisson ratio"},
      {"self_collision", &body.self_collision, "", any,
       "whether the body collides with itself, as it does with others; else shells and rods do, volumes do "
       "not"},
      {"collision_thickness", &body.collision_thickness, "m", positive,
       "gap kept from itself and other deformable bodies; else the thickness, or a tenth of the shortest "
       "edge"},
      {"collision_friction", &body.collision_friction, "", non_negative,
       "Coulomb coefficient against itself and other deformable bodies; a pair uses the smaller one"},
      {"look", Reference{&body.look, "looks"}, "", any,
       "how the body is drawn; without one, in a color of its own"},
      repeat_key(entry.repeat),
  };
}

std::vector<Key> keys(Ground& ground) {
  return {
      {"height", &ground.height, "m", any, "everything below this y is solid"},
      {"friction", &ground.friction, "", non_negative, "as for rigid bodies"},
      {"restitution", &ground.restitution, "", between(0, 1), "as for rigid bodies"},
      {"rolling_friction", &ground.rolling_friction, "m", non_negative, "as for rigid bodies"},
      {"spinning_friction", &ground.spinning_friction, "m", non_negative, "as for rigid bodies"},
      {"look", Reference{&ground.look, "looks"}, "", any, "how the ground is drawn"},
  };
}

std::vector<Section> sections(Prototype& prototype) {
  Scene& scene = prototype.scene;
  return {
      {"", Layout::root, "the scene as a whole", keys(scene)},
      {"materials", Layout::named, "materials of deformable bodies", keys(prototype.material)},
      {"rigid", Layout::list, "rigid bodies: dynamic, or static, or kinematic if they have a motion",
       keys(prototype.rigid)},
      {"deformable", Layout::list, "deformable bodies", keys(prototype.deformable)},
      {"instances", Layout::list, "copies of the bodies and joints of [prefabs.NAME], see scenes/README.md",
       keys(prototype.instance)},
      {"joints", Layout::list, "joints between rigid bodies", keys(prototype.joint)},
      {"ground", Layout::table, "the solid half space below a height; absent: no ground",
       keys(prototype.ground)},
      {"solver", Layout::table, "accuracy and bounds of the simulation", keys(scene.solver)},
      {"camera", Layout::table, "the view; absent: all that moves", keys(scene.camera)},
      {"lights", Layout::list, "lamps; absent, without [sky]: one", keys(prototype.light)},
      {"sky", Layout::table, "light from all directions, and the background", keys(scene.sky)},
      {"looks", Layout::named, "how surfaces are drawn", keys(prototype.look)},
      {"render", Layout::table, "the pictures", keys(scene.render)},
      {"output", Layout::table, "what a run writes besides its frames", keys(scene.output)},
  };
}

}  // namespace duet::scene
