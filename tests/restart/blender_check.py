"""blender -b --factory-startup --python-exit-code 1 --python blender_check.py -- RUN: imports the run and compares the
bodies at every frame with the run's own meshes, and the boxes of their level sets with theirs."""

import os
import sys

import bpy
from mathutils import Vector

sys.dont_write_bytecode = True  # the folder of the sources stays as it is
run = sys.argv[sys.argv.index("--") + 1]
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "blender"))
import duet_import

print(duet_import.import_run(run))
scene = bpy.context.scene
frames, farthest = 0, 0
for frame in range(scene.frame_start, scene.frame_end + 1):
    scene.frame_set(frame)
    bodies = {}
    with open(os.path.join(run, "mesh", f"{frame:04}.obj"), encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words[:1] == ["o"]:
                points = bodies.setdefault(words[1], [])
            elif words[:1] == ["v"]:
                x, y, z = map(float, words[1:])
                points.append((x, -z, y))
    for name, points in bodies.items():
        item = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get())
        vertices = item.to_mesh().vertices
        assert len(vertices) == len(points), name
        for vertex, point in zip(vertices, points):
            place = item.matrix_world @ vertex.co
            farthest = max(farthest, max(abs(a - b) for a, b in zip(place, point)))
        assert item.material_slots[0].material is not None, name
        level_set = bpy.data.objects[name + " level set"].evaluated_get(bpy.context.evaluated_depsgraph_get())
        assert level_set.data.grids.load() and level_set.data.grids[0].name == "surface", name
        margin = 0.35  # m: a band of 3 voxels of 0.03 m, in blocks of 8 voxels
        for k in range(3):
            shown = [(level_set.matrix_world @ Vector(corner))[k] for corner in level_set.bound_box]
            inner = [point[k] for point in points]
            assert min(inner) - margin < min(shown) < min(inner), name
            assert max(inner) < max(shown) < max(inner) + margin, name
    frames += 1
assert farthest < 1e-5, farthest
assert scene.camera is not None
print(f"compared {frames} frames of {len(bodies)} bodies: {farthest:.2g} m apart")
