"""Targets, forces and releases between frames."""

import unittest

import numpy as np

import duet


def scene(**more):
    return duet.Scene(
        {
            "gravity": [0, 0, 0],
            "frames": 4,
            "rigid": [
                {"name": "box", "shape": {"box": [1, 1, 1]}, "mass": 2},
                {"name": "driven", "shape": {"sphere": 0.1}, "position": [5, 0, 0],
                 "motion": {"spin": [{"axis": [0, 1, 0], "rate": 0}]}},
                {"name": "arm", "shape": {"box": [1, 0.1, 0.1]}, "position": [9.5, 0, 0], "mass": 1},
                {"name": "peg", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [9, 0, 0], "static": True},
            ],
            "joints": [
                {"name": "hinge", "type": "hinge", "parent": "peg", "child": "arm", "position": [9, 0, 0],
                 "axis": [0, 0, 1], "control": {"gain": 2000}},
            ],
            **more,
        }
    )


class Steering(unittest.TestCase):
    def test_forces_give_their_impulse_once(self):
        simulation = scene().simulate()
        next(simulation)
        simulation.add_force("box", [3, 0, 0])
        simulation.add_force("box", [0, 6, 0], at=[0.5, 0, 0], moment=[0, 0, 1])
        frame = next(simulation)
        np.testing.assert_allclose(frame["box"].velocity, [1.5 / 24, 3 / 24, 0], atol=1e-12)
        np.testing.assert_allclose(frame["box"].angular_velocity, [0, 0, 4 / 24 / (2 / 6)], rtol=1e-3)
        np.testing.assert_allclose(next(simulation)["box"].velocity, [1.5 / 24, 3 / 24, 0], atol=1e-12)

    def test_bodies_go_to_their_targets_and_stop(self):
        simulation = scene().simulate()
        next(simulation)
        simulation.set_target("driven", position=[5, 0.1, 0])
        frame = next(simulation)
        np.testing.assert_allclose(frame["driven"].position, [5, 0.1, 0], atol=1e-12)
        np.testing.assert_allclose(frame["driven"].velocity, [0, 2.4, 0], atol=1e-9)
        simulation.set_target("driven", orientation=[np.cos(0.1), 0, 0, np.sin(0.1)])
        frame = next(simulation)
        np.testing.assert_allclose(frame["driven"].orientation, [np.cos(0.1), 0, 0, np.sin(0.1)], atol=1e-12)
        np.testing.assert_array_equal(next(simulation)["driven"].velocity, [0, 0, 0])

    def test_joints_go_to_their_targets(self):
        simulation = scene(frames=24).simulate()
        simulation.set_target("hinge", 0.5)
        *_, last = simulation
        x, y, _ = last["arm"].position - [9, 0, 0]
        self.assertAlmostEqual(np.arctan2(y, x), 0.5, delta=1e-3)

    def test_releases(self):
        simulation = scene(gravity=[0, -9.8, 0], frames=12).simulate()
        next(simulation)
        self.assertEqual(simulation.joints, ["hinge"])
        simulation.release("hinge")
        self.assertEqual(simulation.joints, [])
        simulation.release("driven", density=1000)
        self.assertEqual(simulation.frame["driven"].kind, "rigid")
        *_, last = simulation
        for name in ("arm", "driven", "box"):
            self.assertAlmostEqual(last[name].velocity[1], -9.8 / 2, delta=1e-9)
        self.assertEqual(last.number, 12)

    def test_errors_have_remedies(self):
        simulation = scene().simulate()
        for call, text in (
            (lambda: simulation.add_force("bxo", [0, 0, 0]), "there is no body `bxo` .did you mean `box`"),
            (lambda: simulation.add_force("box", [0, 0]), "a force has 2 numbers: give 3"),
            (lambda: simulation.add_force("driven", [0, 0, 1]), "`driven` takes no force: it is not dynamic"),
            (lambda: simulation.set_target("box", position=[0, 0, 0]), "it is not kinematic"),
            (lambda: simulation.set_target("driven", position=[0, 0, np.nan]), "give finite numbers"),
            (lambda: simulation.set_target("driven", orientation=[0, 0, 0]), "an orientation has 4 numbers"),
            (lambda: simulation.release("driven"), "give a density"),
        ):
            with self.assertRaisesRegex(duet.Error, text):
                call()
        with self.assertRaises(TypeError):
            simulation.set_target("hinge")


if __name__ == "__main__":
    unittest.main()
