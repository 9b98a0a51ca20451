"""Makes a mesh of NumPy arrays, a torus with bumps, and lets a soft body of that shape fall on the ground."""

import sys

import numpy as np

import duet

n, m = 48, 24  # vertices around the ring and around the tube
u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
tube = 0.18 + 0.03 * np.cos(6 * u)
points = np.stack(
    [(0.5 + tube * np.cos(v)) * np.cos(u), tube * np.sin(v), -(0.5 + tube * np.cos(v)) * np.sin(u)], axis=-1
).reshape(-1, 3)
i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
a, b = i * m + j, (i + 1) % n * m + j
c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)

scene = duet.Scene(
    {
        "frames": 24,
        "ground": {"height": 0},
        "materials": {"rubber": {"density": 1000, "youngs_modulus": 1e5, "poisson_ratio": 0.4, "damping": 0.01}},
        "deformable": [
            {
                "name": "ring",
                "shape": {"mesh": "bumps.obj", "spacing": 0.12},
                "position": [0, 0.7, 0],
                "material": "rubber",
            }
        ],
    }
)
scene.add_mesh("bumps.obj", points, triangles)
*_, last = scene.simulate()
ring = last["ring"]
print(f"{len(ring.tetrahedra)} tetrahedra; the ring ends {ring.points[:, 1].max():.3f} m high")
np.savez(sys.argv[1] if len(sys.argv) > 1 else "ring.npz", points=ring.points, triangles=ring.triangles)
