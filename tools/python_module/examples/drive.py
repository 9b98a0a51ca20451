"""Drives a paddle by a function of time: it strikes a soft ball that hangs in the air, and swings back."""

import sys

import matplotlib.pyplot as plt
import numpy as np

import duet

scene = duet.Scene(
    {
        "frames": 48,
        "gravity": [0, 0, 0],
        "materials": {"rubber": {"density": 500, "youngs_modulus": 1e5, "poisson_ratio": 0.4}},
        "rigid": [
            # A kinematic body goes where set_target() says; its own motion, a spin at no rate, does nothing.
            {"name": "paddle", "shape": {"box": [0.1, 1, 1]}, "motion": {"spin": [{"axis": [0, 1, 0], "rate": 0}]}},
        ],
        "deformable": [
            {"name": "ball", "shape": {"sphere": 0.3}, "position": [0.6, 0, 0], "material": "rubber"},
        ],
    }
)

times, paddle, ball = [], [], []
simulation = scene.simulate()
for frame in simulation:
    times.append(frame.time)
    paddle.append(frame["paddle"].position[0])
    ball.append(frame["ball"].points[:, 0].mean())
    then = frame.time + 1 / scene.fps
    simulation.set_target("paddle", position=[0.4 * np.sin(np.pi * then) ** 2, 0, 0])

plt.plot(times, paddle, label="paddle")
plt.plot(times, ball, label="ball")
plt.xlabel("time, s")
plt.ylabel("x, m")
plt.legend()
plt.savefig(sys.argv[1] if len(sys.argv) > 1 else "drive.png")
print("speed of the ball:", (ball[-1] - ball[-2]) * scene.fps, "m/s")
