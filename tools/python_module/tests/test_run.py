"""Runs, pictures, exports, studies and comparisons."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

import duet
from test_simulation import SCENE

SMALL = {"render.width": 64, "render.height": 36, "render.shadow_samples": 4}


class Runs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.scene = duet.Scene(SCENE)
        cls.run_ = cls.scene.run(Path(cls.folder.name, "a run"), frames=2, threads=1)
        cls.frames = list(cls.scene.simulate(frames=2))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_statistics_are_arrays(self):
        statistics = self.run_.statistics
        self.assertEqual(self.run_.frames, [0, 1, 2])
        self.assertEqual(self.run_.manifest["fps"], 24)
        np.testing.assert_array_equal(statistics["kinetic"], [frame.energies["kinetic"] for frame in self.frames])
        self.assertEqual(statistics["momentum"].shape, (3, 3))
        self.assertEqual(list(statistics["hash"]), [frame.hash for frame in self.frames])
        self.assertGreater(statistics["seconds of I.1 advance velocity"][1], 0)

    def test_meshes_are_those_of_the_frames(self):
        for body in self.frames[2]:
            points, triangles = self.run_.mesh(2, body.name)
            np.testing.assert_allclose(points, body.points, atol=1e-12)
            np.testing.assert_array_equal(triangles, body.triangles)
        with self.assertRaises(KeyError):
            self.run_.mesh(2, "jely")
        with self.assertRaises(duet.FileError):
            self.run_.mesh(7, "jelly")

    def test_pictures(self):
        picture = self.run_.render(2, SMALL)
        self.assertEqual((picture.shape, picture.dtype), ((36, 64, 3), np.uint8))
        self.assertGreater(picture.std(), 5)
        # The frame of the simulation has more digits than the mesh of the run.
        difference = duet.compare(picture, self.frames[2].render(SMALL))
        self.assertLess(difference["rmse"], 0.01)
        self.assertTrue(duet.compare(picture, picture)["same"])
        moved = self.run_.render(2, {**SMALL, "camera.position": [9, 9, 9], "camera.target": [0, 0, 0]})
        self.assertFalse(duet.compare(picture, moved)["same"])
        with self.assertRaisesRegex(duet.Error, "changes no picture"):
            self.run_.render(2, {"gravity": [0, 0, 0]})
        with self.assertRaisesRegex(duet.Error, "pixels"):
            duet.compare(picture, self.run_.render(2, {**SMALL, "render.width": 32}))

    def test_exports(self):
        file = self.run_.export("glb")
        self.assertEqual(file.read_bytes()[:4], b"glTF")
        folder = self.run_.export("ply", Path(self.folder.name, "plies"), frames=(1, 2))
        self.assertEqual(len(list(folder.glob("*.ply"))), 2)
        with self.assertRaisesRegex(duet.Error, "abcd"):
            self.run_.export("abcd")

    def test_other_folders_are_errors(self):
        with self.assertRaisesRegex(duet.FileError, "is no run"):
            duet.Run(self.folder.name)
        with self.assertRaisesRegex(duet.Error, "a run"):
            self.scene.run(self.run_.path)  # without overwrite

    def test_meshes_of_arrays_get_into_runs(self):
        scene = duet.Scene({"rigid": [{"name": "a", "shape": {"mesh": "tet.obj"}, "density": 1}]})
        scene.add_mesh("tet.obj", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                       [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        run = scene.run(Path(self.folder.name, "mesh"), frames=1)
        np.testing.assert_allclose(run.mesh(0, "a")[0].min(axis=0), [0, 0, 0], atol=1e-9)
        self.assertIn("effects", scene.explain())


class Studies(unittest.TestCase):
    def test_results(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = Path(folder, "slide.toml")
            duet.Scene({"frames": 2, "ground": {}, "rigid": [
                {"name": "box", "shape": {"box": [1, 1, 1]}, "position": [0, 0.5, 0], "density": 1,
                 "velocity": [1, 0, 0]}]}).write(scene)
            spec = Path(folder, "spec.toml")
            spec.write_text(f'title = "Slide"\nscene = "{scene}"\nframes = 2\n[reference]\n'
                            'set = ["solver.max_time_step=0.002"]\n[[measures]]\nname = "state"\nkind = "state"\n'
                            '[[knobs]]\nname = "step"\nkey = "solver.max_time_step"\nvalues = [0.02, 0.01, 0.005]\n')
            results = duet.study(spec, Path(folder, "out"), untimed=True)
            self.assertEqual(len(results["rows"]), 3)


if __name__ == "__main__":
    unittest.main()
