"""blender -b --factory-startup --python-exit-code 1 --python blender_cache_check.py -- MODEL.obj CACHE.pc2 FOLDER: imports
the model as Blender suggests, plays the cache on it as the page for users says, and compares its vertices at every
frame with those of the OBJ sequence in FOLDER, which has the body alone."""

import glob
import os
import sys

import bpy

model, cache, folder = sys.argv[sys.argv.index("--") + 1:]
before = set(bpy.data.objects)
bpy.ops.wm.obj_import(filepath=model)
(item,) = set(bpy.data.objects) - before
modifier = item.modifiers.new("cache", "MESH_CACHE")
modifier.cache_format = "PC2"
modifier.filepath = cache
frames, farthest = 0, 0
for path in sorted(glob.glob(os.path.join(glob.escape(folder), "[0-9]*.obj"))):
    with open(path, encoding="utf-8") as file:
        points = [tuple(map(float, line.split()[1:4])) for line in file if line.startswith("v ")]
    bpy.context.scene.frame_set(int(os.path.basename(path)[:-4]))
    shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    vertices = shown.to_mesh().vertices
    assert len(vertices) == len(points), (len(vertices), len(points))
    for vertex, (x, y, z) in zip(vertices, points):
        place = shown.matrix_world @ vertex.co
        farthest = max(farthest, abs(place.x - x), abs(place.y + z), abs(place.z - y))
    frames += 1
assert farthest < 1e-5, farthest
print(f"compared {frames} frames of {len(item.data.polygons)} polygons, {len(item.data.materials)} materials, "
      f"{len(item.data.uv_layers)} layer of texture coordinates: {farthest:.2g} m apart")
