"""Imports a run directory of Duet into Blender 3.4 or newer.

As an add-on:  Edit > Preferences > Add-ons > Install..., then File > Import > Duet run: choose manifest.json of the run.
As a script:   blender --python tools/blender/duet_import.py -- out/stack
               blender -b --python tools/blender/duet_import.py -- out/stack --save stack.blend

Rigid bodies become objects with keyed places and rotations, deformable ones meshes with a Mesh Cache modifier whose
caches are written to RUN/export/blender. Frame numbers, frame rate and lengths (m) are those of the run; y up becomes
Blender's z up. Materials, camera and lamps come from an export.json below RUN/export, which every folder that
`duet export` writes has; without one, bodies have plain colors. Level sets come from RUN/export/vdb, if it is there,
as volumes that move with their bodies. The ground is a plane at its height in scene.toml, where Python can read that
(3.11 and newer).
"""

import array
import ast
import glob
import json
import math
import os
import re
import struct
import sys

import bpy
from mathutils import Matrix, Quaternion, Vector

bl_info = {
    "name": "Duet run",
    "author": "The authors of Duet",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > Duet run",
    "description": "Imports a run directory of the simulator Duet",
    "category": "Import-Export",
}

# Turns y up into z up: a quarter of a turn about x.
TURN = Quaternion((math.sqrt(0.5), math.sqrt(0.5), 0, 0))
TYPES = {"<f8": "d", "<f4": "f", "<i8": "q", "<i4": "i"}


class ImportFailed(Exception):
    """Why a folder cannot be imported, in a sentence."""


def read_record(path):
    """The fields of a .npy file that holds one record, as flat arrays. Works without NumPy, which not every Blender has."""
    with open(path, "rb") as file:
        data = file.read()
    fields = {}
    try:
        if data[:8] != b"\x93NUMPY\x01\x00":
            raise ValueError("no .npy file")
        at = 10 + struct.unpack_from("<H", data, 8)[0]
        for name, code, *shape in ast.literal_eval(data[10:at].decode("latin-1"))["descr"]:
            values = array.array(TYPES[code])
            end = at + values.itemsize * math.prod(shape[0] if shape else ())
            values.frombytes(data[at:end])
            if sys.byteorder != "little":
                values.byteswap()
            fields[name] = values
            at = end
        if at != len(data):
            raise ValueError("another length than its head says")
    except (ValueError, KeyError, SyntaxError, struct.error) as error:
        raise ImportFailed(f"{path}: is damaged or no file of a run ({error}); `duet verify RUN` looks closer") from error
    return fields


def z_up(x):
    return Vector((x[0], -x[2], x[1]))


def turned(points, first, count):
    """Three arrays of the coordinates of `count` points from the `first` on, z up."""
    part = points[3 * first:3 * (first + count)]
    return part[0::3], array.array("d", [-z for z in part[2::3]]), part[1::3]


def middle(coordinates):
    """The origin of the object of a deformable body: 0, or about its middle where single precision needs it."""
    extent = max((max(c) - min(c) for c in coordinates), default=0)
    farthest = max((max(abs(x) for x in c) for c in coordinates), default=0)
    if farthest <= 128 * extent or extent == 0:
        return (0.0, 0.0, 0.0)
    unit = 2.0 ** math.floor(math.log2(extent))
    return tuple(round((max(c) + min(c)) / 2 / unit) * unit for c in coordinates)


def interleaved(coordinates, origin):
    values = array.array("f", bytes(12 * len(coordinates[0])))
    for k in range(3):
        values[k::3] = array.array("f", [x - origin[k] for x in coordinates[k]])
    return values


class Run:
    """A run directory: its bodies with their places in the files of values."""

    def __init__(self, folder):
        self.folder = folder
        try:
            with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as file:
                self.manifest = json.load(file)
        except (OSError, ValueError) as error:
            raise ImportFailed(f"{folder}: is no run directory of Duet ({error})") from error
        self.fps = self.manifest["fps"]
        files = glob.glob(os.path.join(glob.escape(folder), "values", "[0-9]*.npy"))
        self.frames = sorted(int(os.path.basename(path)[:-4]) for path in files)
        if not self.frames:
            raise ImportFailed(f"{folder}: has no frames in values/ (simulate the scene anew with a newer Duet)")
        self.rest = read_record(os.path.join(folder, "values", "bodies.npy"))
        self.bodies = []
        at = {"vertices": 0, "normals": 0, "uvs": 0, "triangles": 0}
        rows = points = 0
        for body in self.manifest["bodies"]:
            body = dict(body, **{"first_" + key: value for key, value in at.items()})
            body["is_rigid"] = body["kind"] != "deformable"
            body["row"], body["first_point"] = rows, points
            if body["is_rigid"]:
                rows += 1
            else:
                points += body["vertices"]
            for key in at:
                at[key] += body[key]
            self.bodies.append(body)

    def values(self, frame):
        return read_record(os.path.join(self.folder, "values", f"{frame:04}.npy"))

    def description(self):
        """The newest export.json with looks, or nothing."""
        files = glob.glob(os.path.join(glob.escape(self.folder), "export", "*", "export.json"))
        for path in sorted(files, key=os.path.getmtime, reverse=True):
            with open(path, encoding="utf-8") as file:
                found = json.load(file)
            if found.get("looks"):
                return found
        return None

    def ground_height(self):
        try:
            import tomllib

            with open(os.path.join(self.folder, "scene.toml"), "rb") as file:
                ground = tomllib.load(file).get("ground")
        except (ImportError, OSError, ValueError):
            return None
        return None if ground is None else float(ground.get("height", 0))


def make_mesh(run, body, coordinates):
    """The surface of the body with these vertices."""
    rest, count = run.rest, body["triangles"]
    corners = rest["corner"][9 * body["first_triangles"]:9 * (body["first_triangles"] + count)]
    positions, uvs, normals = corners[0::3], corners[1::3], corners[2::3]
    mesh = bpy.data.meshes.new(body["name"])
    mesh.from_pydata(list(zip(*coordinates)), [], list(zip(positions[0::3], positions[1::3], positions[2::3])))
    if body["uvs"]:
        all_uvs = rest["uv"][2 * body["first_uvs"]:2 * (body["first_uvs"] + body["uvs"])]
        flat = array.array("f", bytes(8 * len(uvs)))
        flat[0::2] = array.array("f", [all_uvs[2 * i] for i in uvs])
        flat[1::2] = array.array("f", [all_uvs[2 * i + 1] for i in uvs])
        mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", flat)
    # An edge is sharp where its two triangles do not share the normals at its ends.
    ends, sharp = {}, set()
    for corner in range(0, len(positions), 3):
        for a, b in ((corner, corner + 1), (corner + 1, corner + 2), (corner + 2, corner)):
            if positions[a] > positions[b]:
                a, b = b, a
            edge, meant = (positions[a], positions[b]), (normals[a], normals[b])
            if ends.setdefault(edge, meant) != meant:
                sharp.add(edge)
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    if sharp:
        for edge in mesh.edges:
            edge.use_edge_sharp = tuple(sorted(edge.vertices)) in sharp
        if hasattr(mesh, "use_auto_smooth"):  # before 4.1 sharp edges count with it alone
            mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
    mesh.update()
    return mesh


def key_channel(action, path, index, frames, values):
    curve = action.fcurves.new(path, index=index)
    curve.keyframe_points.add(len(frames))
    flat = array.array("f", bytes(8 * len(frames)))
    flat[0::2] = array.array("f", frames)
    flat[1::2] = array.array("f", values)
    curve.keyframe_points.foreach_set("co", flat)
    for point in curve.keyframe_points:
        point.interpolation = "LINEAR"
    curve.update()


def key_motion(item, frames, channels):
    """Keys the channels {(path, index): values}; those of a body that rests are set once."""
    moving = {key: values for key, values in channels.items() if any(v != values[0] for v in values)}
    for (path, index), values in channels.items():
        getattr(item, path)[index] = values[0]
    if not moving:
        return
    item.animation_data_create()
    item.animation_data.action = bpy.data.actions.new(item.name)
    for (path, index), values in channels.items():
        if any(key[0] == path for key in moving):
            try:
                key_channel(item.animation_data.action, path, index, frames, values)
            except AttributeError:  # Blender 5 has no list of curves in actions
                for frame, value in zip(frames, values):
                    getattr(item, path)[index] = value
                    item.keyframe_insert(path, index=index, frame=frame)


def texture_scale(run, body):
    """Meters in a unit of the body's texture coordinates u and v, averaged over its area; none without any."""
    first = body["first_triangles"]
    corner = run.rest["corner"][9 * first:9 * (first + body["triangles"])]
    points = run.rest["rest"][3 * body["first_vertices"]:3 * (body["first_vertices"] + body["vertices"])]
    uvs = run.rest["uv"][2 * body["first_uvs"]:2 * (body["first_uvs"] + body["uvs"])]
    sums, area = [0.0, 0.0], 0.0
    for t in range(0, len(corner), 9):
        x = [Vector(points[3 * corner[t + k]:3 * corner[t + k] + 3]) for k in (0, 3, 6)]
        u = [Vector(uvs[2 * corner[t + k]:2 * corner[t + k] + 2]) for k in (1, 4, 7)]
        a, b, p, q = x[1] - x[0], x[2] - x[0], u[1] - u[0], u[2] - u[0]
        det = p.x * q.y - q.x * p.y
        if abs(det) < 1e-12:
            continue
        weight = a.cross(b).length
        sums[0] += weight * ((a * q.y - b * p.y) / det).length
        sums[1] += weight * ((b * p.x - a * q.x) / det).length
        area += weight
    return (sums[0] / area, sums[1] / area) if area > 0 else None


def add_pattern(material, look, scale):
    """A checker, or stripes across u, with whole periods of two bands, as Duet's own pictures have them."""
    size = look["pattern_size"]
    bands = [2 * max(1, math.floor(s / (2 * size) + 0.5)) for s in scale]
    nodes, links = material.node_tree.nodes, material.node_tree.links
    place, mapping, checker = (nodes.new("ShaderNode" + kind) for kind in ("TexCoord", "Mapping", "TexChecker"))
    mapping.inputs["Scale"].default_value = (bands[0], bands[1] if look["pattern"] == "checker" else 0, 0)
    checker.inputs["Scale"].default_value = 1
    checker.inputs["Color1"].default_value = (*look["color2"], 1)
    checker.inputs["Color2"].default_value = (*look["color"], 1)
    links.new(place.outputs["UV"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], checker.inputs["Vector"])
    links.new(checker.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])


class Materials:
    """One material a look; bodies with a pattern have those that fit their texture coordinates."""

    def __init__(self, description):
        self.unit = description["units_per_meter"] if description else 1
        self.looks = {look["name"]: look for look in description["looks"]} if description else {}
        self.worn = {body["name"]: body.get("look") for body in description["bodies"]} if description else {}
        self.made = {}

    def of_body(self, run, body):
        look = self.looks.get(self.worn.get(body["name"]))
        if look is None:
            return None
        scale = texture_scale(run, body) if look["pattern"] in ("checker", "stripes") and "color2" in look else None
        key = (look["name"], scale)
        if key not in self.made:
            self.made[key] = self.make(dict(look, pattern_size=look.get("pattern_size", 1) / self.unit), scale)
        return self.made[key]

    @staticmethod
    def make(look, scale):
        material = bpy.data.materials.new(look["name"])
        material.use_nodes = True
        inputs = material.node_tree.nodes["Principled BSDF"].inputs
        inputs["Base Color"].default_value = (*look["color"], 1)
        inputs["Metallic"].default_value = look["metallic"]
        inputs["Roughness"].default_value = look["roughness"]
        inputs["Alpha"].default_value = look["opacity"]
        if look["opacity"] < 1 and hasattr(material, "blend_method"):
            material.blend_method = "BLEND"
        material.diffuse_color = (*look["color"], look["opacity"])
        if scale is not None:
            add_pattern(material, look, scale)
        return material


def make_rigid(run, body, collection, meshes):
    rest = run.rest["rest"][3 * body["first_vertices"]:3 * (body["first_vertices"] + body["vertices"])]
    corner = run.rest["corner"][9 * body["first_triangles"]:9 * (body["first_triangles"] + body["triangles"])]
    shape = (rest.tobytes(), corner.tobytes())
    if shape not in meshes:  # bodies of one shape share it
        meshes[shape] = make_mesh(run, body, (rest[0::3], rest[1::3], rest[2::3]))
    item = bpy.data.objects.new(body["name"], meshes[shape])
    item.rotation_mode = "QUATERNION"
    collection.objects.link(item)
    return item


class Cache:
    """The PC2 file of a deformable body (POINTCACHE2, as the Mesh Cache modifier reads it)."""

    def __init__(self, path, run, body, origin):
        self.body, self.origin, self.path = body, origin, path
        self.samples = run.frames[-1] - run.frames[0] + 1
        self.file = open(path + ".tmp", "wb")
        self.file.write(struct.pack("<12siiffi", b"POINTCACHE2", 1, body["vertices"], run.frames[0], 1, self.samples))
        self.last = None

    def add(self, values, times):
        """The body at a frame; for the frames that were missing before it the one before them is repeated."""
        for _ in range(times - 1):
            self.file.write(self.last)
        points = turned(values["point"], self.body["first_point"], self.body["vertices"])
        packed = interleaved(points, self.origin)
        if sys.byteorder != "little":
            packed.byteswap()
        self.last = packed.tobytes()
        self.file.write(self.last)

    def finish(self):
        self.file.close()
        os.replace(self.path + ".tmp", self.path)


def make_deformable(run, body, collection, first, folder):
    coordinates = turned(first["point"], body["first_point"], body["vertices"])
    origin = middle(coordinates)
    local = [array.array("d", [x - origin[k] for x in coordinates[k]]) for k in range(3)]
    item = bpy.data.objects.new(body["name"], make_mesh(run, body, local))
    item.location = origin
    collection.objects.link(item)
    # The number keeps names apart where upper and lower case are the same.
    name = re.sub(r"[^\w.-]", "_", body["name"])
    cache = Cache(os.path.join(folder, f"{body['first_point']}-{name}.pc2"), run, body, origin)
    modifier = item.modifiers.new("Duet", "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = cache.path
    modifier.frame_start = run.frames[0]
    return item, cache


def look_along(position, target, up):
    """The rotation of a camera or lamp, which looks along its -z with its y up."""
    back = (position - target).normalized()
    side = up.cross(back)
    side = side.normalized() if side.length > 1e-9 else back.orthogonal().normalized()
    return Matrix((side, back.cross(side), back)).transposed().to_quaternion()


def make_view(run, description, collection, scene):
    def place(x):
        x = [c / description["units_per_meter"] for c in x]
        return Vector(x) if description["up"] == "z" else z_up(x)

    def direction(x):
        return Vector(x) if description["up"] == "z" else z_up(x)

    seen = description["camera"]
    camera = bpy.data.cameras.new("Camera")
    camera.sensor_fit = "VERTICAL"
    camera.clip_end = 1e4
    item = bpy.data.objects.new("Camera", camera)
    item.rotation_mode = "QUATERNION"
    collection.objects.link(item)
    scene.camera = item
    scene.render.resolution_x, scene.render.resolution_y = seen["width"], seen["height"]
    for at in seen.get("motion", [dict(seen, frame=None)]):
        item.location = place(at["position"])
        item.rotation_quaternion = look_along(item.location, place(at["target"]), direction(at["up"]))
        camera.angle_y = math.radians(at["vertical_fov"])
        if at["frame"] is not None:
            item.keyframe_insert("location", frame=at["frame"])
            item.keyframe_insert("rotation_quaternion", frame=at["frame"])
            camera.keyframe_insert("lens", frame=at["frame"])
    for light in description["lights"]:
        is_area = light["kind"] == "area"
        lamp = bpy.data.lights.new(light["name"], "AREA" if is_area else "POINT")
        # Irradiance at the distance d is power / (4 pi d^2); that of a disc that faces it is energy / (pi d^2).
        lamp.energy = light["power"] / 4 if is_area else light["power"]
        lamp.color = light["color"]
        lamp.use_shadow = light["shadow"]
        if is_area:
            lamp.shape, lamp.size = "DISK", 2 * light["radius"] / description["units_per_meter"]
        item = bpy.data.objects.new(light["name"], lamp)
        item.rotation_mode = "QUATERNION"
        item.location = place(light["position"])
        item.rotation_quaternion = look_along(item.location, place(light["target"]), Vector((0, 0, 1)))
        collection.objects.link(item)


def make_ground(height, collection):
    far = 100.0
    mesh = bpy.data.meshes.new("ground")
    mesh.from_pydata([(-far, -far, 0), (far, -far, 0), (far, far, 0), (-far, far, 0)], [], [(0, 1, 2, 3)])
    item = bpy.data.objects.new("ground", mesh)
    item.location = (0, 0, height)
    collection.objects.link(item)


def make_level_sets(run, items, collection):
    """Adds what `duet export RUN --to vdb` wrote: for a rigid body the grid of its shape, which moves with it, for a
    deformable one a sequence. They are hidden in renders, where a level set is a fog. Returns their number."""
    home = os.path.join(run.folder, "export", "vdb")
    try:
        with open(os.path.join(home, "export.json"), encoding="utf-8") as file:
            found = json.load(file)
    except OSError:
        return 0
    bodies = {body["name"]: item for body, item in zip(run.bodies, items)}
    volumes = {}
    first, made = found["first_frame"], 0
    for body in found["bodies"]:
        path = body.get("level_set") or body.get("level_sets")
        if path is None:
            continue
        if path not in volumes:  # bodies of one shape share it
            volumes[path] = bpy.data.volumes.new(body["name"] + " level set")
            volumes[path].filepath = os.path.join(home, path.replace("####", f"{first:04}"))
        volume = volumes[path]
        item = bpy.data.objects.new(body["name"] + " level set", volume)
        if "level_set" in body:
            item.parent = bodies[body["name"]]
        else:
            volume.is_sequence = True
            volume.frame_start, volume.frame_offset = first, first - 1
            volume.frame_duration = found["last_frame"] - first + 1
            item.rotation_euler = (math.pi / 2 if found["up"] == "y" else 0, 0, 0)
        item.scale = [1 / found["units_per_meter"]] * 3
        item.hide_render = True
        collection.objects.link(item)
        made += 1
    return made


def import_run(folder, scene=None):
    """Adds a collection with the run to the scene. Returns what was made, in a sentence. Raises ImportFailed."""
    run = Run(os.path.abspath(folder))
    scene = scene or bpy.context.scene
    description = run.description()
    name = run.manifest["title"] or os.path.basename(run.folder)
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    scene.render.fps = max(1, round(run.fps))
    scene.render.fps_base = scene.render.fps / run.fps
    scene.frame_start, scene.frame_end = run.frames[0], run.frames[-1]
    caches_folder = os.path.join(run.folder, "export", "blender")

    first = run.values(run.frames[0])
    meshes, items, caches, rigid = {}, [], [], []
    for body in run.bodies:
        if body["is_rigid"]:
            items.append(make_rigid(run, body, collection, meshes))
            rigid.append((body["row"], items[-1]))
        else:
            os.makedirs(caches_folder, exist_ok=True)
            item, cache = make_deformable(run, body, collection, first, caches_folder)
            items.append(item)
            caches.append(cache)

    paths = [("location", k) for k in range(3)] + [("rotation_quaternion", k) for k in range(4)]
    channels = {row: {path: array.array("d") for path in paths} for row, _ in rigid}
    before = run.frames[0] - 1
    for frame in run.frames:
        values = first if frame == run.frames[0] else run.values(frame)
        for row, motion in channels.items():
            location = z_up(values["position"][3 * row:3 * row + 3])
            rotation = TURN @ Quaternion(values["orientation"][4 * row:4 * row + 4])
            last = [motion["rotation_quaternion", k] for k in range(4)]
            # q and -q are one rotation: the nearer one, so that the way between keys is short.
            if last[0] and sum(a[-1] * b for a, b in zip(last, rotation)) < 0:
                rotation.negate()
            for k in range(3):
                motion["location", k].append(location[k])
            for k in range(4):
                motion["rotation_quaternion", k].append(rotation[k])
        for cache in caches:
            cache.add(values, frame - before)
        before = frame
    for row, item in rigid:
        key_motion(item, run.frames, channels[row])
    for cache in caches:
        cache.finish()

    materials = Materials(description)
    for body, item in zip(run.bodies, items):
        material = materials.of_body(run, body)
        if material is None:
            continue
        if not item.data.materials:
            item.data.materials.append(None)
        item.material_slots[0].link = "OBJECT"  # bodies that share a mesh may differ in looks
        item.material_slots[0].material = material
    if description and "camera" in description:
        make_view(run, description, collection, scene)
    height = run.ground_height()
    if height is not None:
        make_ground(height, collection)
    level_sets = make_level_sets(run, items, collection)
    scene.frame_set(run.frames[0])
    said = f"{len(items)} bodies, frames {run.frames[0]} to {run.frames[-1]}, of {run.folder}"
    if level_sets:
        said += f"; {level_sets} level sets as volumes"
    if description is None:
        said += "; no looks, camera and lamps: `duet export RUN --to transforms` or another format writes them"
    return said


class DUET_OT_import(bpy.types.Operator):
    """Imports a run directory of Duet"""

    bl_idname = "import_scene.duet"
    bl_label = "Import Duet run"
    bl_options = {"UNDO"}

    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="manifest.json", options={"HIDDEN"})

    def execute(self, context):
        path = bpy.path.abspath(self.filepath)
        try:
            said = import_run(path if os.path.isdir(path) else os.path.dirname(path), context.scene)
        except (ImportFailed, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, said)
        return {"FINISHED"}

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


def menu_entry(self, context):
    self.layout.operator(DUET_OT_import.bl_idname, text="Duet run (manifest.json)")


def register():
    bpy.utils.register_class(DUET_OT_import)
    bpy.types.TOPBAR_MT_file_import.append(menu_entry)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(menu_entry)
    bpy.utils.unregister_class(DUET_OT_import)


def main(words):
    usage = "usage: blender [-b] --python duet_import.py -- RUN [--save FILE.blend]"
    save = None
    if "--save" in words:
        at = words.index("--save")
        if at + 1 == len(words):
            sys.exit(usage)
        save = words[at + 1]
        del words[at:at + 2]
    if len(words) != 1:
        sys.exit(usage)
    for item in list(bpy.data.objects):  # of Blender's own first scene
        if item.name in ("Cube", "Light", "Camera"):
            bpy.data.objects.remove(item)
    try:
        print("duet_import: " + import_run(words[0]))
    except (ImportFailed, OSError) as error:
        sys.exit(f"duet_import: {error}")
    if save:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(save))


if __name__ == "__main__":
    if "--" in sys.argv:
        main(sys.argv[sys.argv.index("--") + 1:])
    else:
        register()
