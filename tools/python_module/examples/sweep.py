"""Sweeps the friction of a box on a slope and plots how far it slides: beyond tan(20 degrees) it stays."""

import sys

import matplotlib.pyplot as plt
import numpy as np

import duet

angle = np.radians(20)
scene = duet.Scene(
    {
        "frames": 24,
        # Gravity is turned instead of the ground, which is level.
        "gravity": 9.8 * np.array([np.sin(angle), -np.cos(angle), 0]),
        "ground": {"friction": 1.0},
        "rigid": [
            {"name": "box", "shape": {"box": [1, 0.5, 1]}, "position": [0, 0.25, 0], "density": 500, "restitution": 0},
        ],
    }
)


def slide(friction: float) -> float:
    scene["rigid.box.friction"] = friction
    *_, last = scene.simulate()
    return last["box"].position[0]


frictions = np.linspace(0, 0.5, 11)
distances = [slide(mu) for mu in frictions]
exact = 0.5 * 9.8 * np.maximum(np.sin(angle) - frictions * np.cos(angle), 0)

plt.axvline(np.tan(angle), color="gray", linestyle=":", label="tan(20 degrees)")
plt.plot(frictions, exact, "x", markersize=12, label="closed form")
plt.plot(frictions, distances, "o", label="simulated")
plt.gca().set(xlabel="friction coefficient", ylabel="distance after 1 s, m")
plt.legend()
plt.savefig(sys.argv[1] if len(sys.argv) > 1 else "sweep.png")
print("largest difference:", np.abs(distances - exact).max(), "m")
