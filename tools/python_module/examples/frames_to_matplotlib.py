"""Shows a scene in Matplotlib: the picture of the renderer, the mesh colored by strain, and the energies."""

import sys

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import duet

scene = duet.Scene("hard/cloth_on_ball")
frames = list(scene.simulate(frames=int(sys.argv[2]) if len(sys.argv) > 2 else 24))
last = frames[-1]

figure = plt.figure(figsize=(12, 4), layout="constrained")
picture = figure.add_subplot(1, 3, 1)
picture.imshow(last.render({"render.width": 640, "render.height": 360, "render.shadow_samples": 16}))
picture.axis("off")

mesh = figure.add_subplot(1, 3, 2, projection="3d")
speed = np.linalg.norm(last.velocities, axis=1)[last.triangles].mean(axis=1)
corners = last.points[last.triangles][:, :, [0, 2, 1]]  # y is up in Duet, z in Matplotlib
mesh.add_collection3d(Poly3DCollection(corners, facecolors=plt.cm.viridis(speed / max(speed.max(), 1e-9))))
low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
mesh.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
mesh.set_box_aspect(high - low)
mesh.set_title("speed of the points")
mesh.set_axis_off()

chart = figure.add_subplot(1, 3, 3)
times = [frame.time for frame in frames]
for kind in ("kinetic", "potential", "elastic", "total"):
    chart.plot(times, [frame.energies[kind] for frame in frames], label=kind)
chart.set(xlabel="time, s", ylabel="energy, J")
chart.legend()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "frames.png")
