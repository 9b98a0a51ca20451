"""Simulates a batch of scenes, one process each: a soft box dropped from several heights."""

import multiprocessing

import numpy as np

import duet

SCENE = {
    "frames": 24,
    "ground": {"height": 0},
    "materials": {"rubber": {"density": 1000, "youngs_modulus": 2e5, "poisson_ratio": 0.4}},
    "deformable": [
        {
            "name": "box",
            "shape": {"box": [0.5, 0.5, 0.5], "cells": [2, 2, 2]},
            "position": [0, 1, 0],
            "material": "rubber",
        }
    ],
}


def largest_strain(height: float) -> float:
    """Returns the largest strain of a box that falls from `height`, m."""
    scene = duet.Scene(SCENE)
    scene["deformable.box.position"] = [0, height, 0]
    return max(frame.strain.max() for frame in scene.simulate(threads=1))


if __name__ == "__main__":
    heights = np.linspace(0.3, 1.5, 5)
    # "spawn" starts processes that have nothing in common with this one, which has threads.
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        strains = pool.map(largest_strain, heights)
    for height, strain in zip(heights, strains):
        print(f"from {height:.1f} m: strain {strain:.3f}")
