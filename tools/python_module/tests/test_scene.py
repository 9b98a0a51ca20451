"""Scenes: sources, keys, errors."""

import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import duet

BOX = {
    "title": "A box",
    "frames": 4,
    "ground": {"height": 0},
    "materials": {"rubber": {"density": 900, "youngs_modulus": 1e5}},
    "rigid": [{"name": "box", "shape": {"box": np.array([1, 2, 3])}, "position": [0, 2, 0], "density": 500}],
    "deformable": [
        {"name": "jelly", "shape": {"box": [1, 1, 1], "cells": [1, 1, 1]}, "position": [3, 2, 0], "material": "rubber"}
    ],
}


class Sources(unittest.TestCase):
    def test_dict_text_and_file_are_the_same_scene(self):
        scene = duet.Scene(BOX)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "a b.toml")
            scene.write(file)
            for other in (duet.Scene(file), duet.Scene.from_text(scene.text), scene.copy()):
                self.assertEqual(other.as_dict(), scene.as_dict())
                self.assertEqual([body.name for body in other.bodies], ["box", "jelly"])

    def test_shipped_scenes_have_names(self):
        self.assertEqual(duet.Scene("stack").frames, 240)
        self.assertIn("hard", duet.Scene("hard/shapes")._path)

    def test_unknown_files_are_errors(self):
        with self.assertRaisesRegex(duet.FileError, "stakc: No such file or directory, and no scene of this name"):
            duet.Scene("stakc")

    def test_content(self):
        scene = duet.Scene(BOX)
        self.assertEqual(scene.bodies[1], duet.Body("jelly", "deformable", "rubber", ""))
        self.assertEqual(scene.materials["rubber"]["density"], 900)
        self.assertIn("poisson_ratio", scene.materials["rubber"])
        self.assertEqual(scene.camera["vertical_fov"], 30)
        self.assertTrue(scene.effects["deformable_elasticity"][0])
        self.assertFalse(scene.effects["articulation"][0])

    def test_pickled_scenes_keep_keys_and_meshes(self):
        scene = duet.Scene({"rigid": [{"name": "a", "shape": {"mesh": "tet.obj"}, "density": 1}]})
        scene.add_mesh("tet.obj", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                       [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        scene["fps"] = 30
        other = pickle.loads(pickle.dumps(scene))
        self.assertEqual(other["fps"], 30)
        self.assertEqual(len(next(other.simulate(frames=0))["a"].points), 4)


class Keys(unittest.TestCase):
    def test_values_given_set_and_by_default(self):
        scene = duet.Scene(BOX)
        self.assertEqual(scene["rigid.box.shape.box"], [1, 2, 3])
        self.assertEqual(scene["rigid.box.friction"], 0.5)
        self.assertEqual(scene["solver.cfl"], 0.7)
        self.assertEqual(scene["gravity"], [0, -9.8, 0])
        self.assertIsNone(scene["deformable.jelly.mass"])
        scene["rigid.box.friction"] = 0.25
        scene["rigid.box.friction"] = np.float64(0.125)
        scene["gravity"] = np.zeros(3)
        scene["title"] = 'with "quotes"\n'
        self.assertEqual(scene["rigid.box.friction"], 0.125)
        self.assertEqual(scene["gravity"], [0, 0, 0])
        self.assertEqual(scene.title, 'with "quotes"\n')

    def test_presets_change_defaults(self):
        self.assertNotEqual(duet.Scene(BOX, accuracy="fine")["solver.cfl"], duet.Scene(BOX)["solver.cfl"])

    def test_wrong_values_change_nothing(self):
        scene = duet.Scene(BOX)
        with self.assertRaises(duet.SceneError) as raised:
            scene.update({"fps": 30, "rigid.box.friction": -1})
        self.assertEqual(raised.exception.key, "rigid.box.friction")
        self.assertEqual(scene["fps"], 24)
        self.assertEqual(scene["rigid.box.friction"], 0.5)
        with self.assertRaises(TypeError):
            scene["fps"] = object()

    def test_unknown_keys_name_the_similar_one(self):
        scene = duet.Scene(BOX)
        for access in (lambda: scene["solver.cfll"], lambda: scene.update({"solver.cfll": 1})):
            with self.assertRaises(duet.SceneError) as raised:
                access()
            self.assertIn("cfl", raised.exception.remedy)


class Errors(unittest.TestCase):
    def test_problems_have_places(self):
        text = 'frames = 3\n[[rigid]]\nname = "a"\nshape = { sphere = -1 }\ndensity = 1\nfrictoin = 2\n'
        with self.assertRaises(duet.SceneError) as raised:
            duet.Scene.from_text(text, path="my.toml")
        problems = {problem.key: problem for problem in raised.exception.problems}
        self.assertEqual(len(problems), 2, raised.exception)
        wrong = problems["rigid.a.frictoin"]
        self.assertEqual((wrong.file, wrong.line, wrong.column), ("my.toml", 6, 1))
        self.assertIn("friction", wrong.remedy)
        self.assertIn("my.toml:6:1: rigid.a.frictoin", str(raised.exception))
        self.assertEqual(raised.exception.status, 2)
        self.assertEqual(str(pickle.loads(pickle.dumps(raised.exception))), str(raised.exception))

    def test_missing_meshes_are_named(self):
        scene = duet.Scene({"rigid": [{"name": "a", "shape": {"mesh": "nowhere.obj"}, "density": 1}]})
        with self.assertRaisesRegex(duet.SceneError, "nowhere.obj"):
            scene.simulate()

    def test_meshes_of_the_wrong_shape(self):
        scene = duet.Scene(BOX)
        for points, triangles in (([[0, 0]], [[0, 0, 0]]), ([[0, 0, 0]], [[0, 0, 1]]), ([[0, 0, 0]], [[0.0, 0, 0]])):
            with self.assertRaises(ValueError):
                scene.add_mesh("a.obj", points, triangles)
        with self.assertRaises(ValueError):
            scene.add_mesh("../a.obj", [[0, 0, 0]], [[0, 0, 0]])


if __name__ == "__main__":
    unittest.main()
