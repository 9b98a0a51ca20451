"""Frames of a simulation: bits, views, lifetimes, threads and interrupts."""

import gc
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import duet

SCENE = {
    "frames": 6,
    "ground": {"height": 0},
    "materials": {"rubber": {"density": 900, "youngs_modulus": 1e5}},
    "rigid": [
        {"name": "box", "shape": {"box": [0.5, 0.5, 0.5]}, "position": [0, 0.25, 0], "density": 500,
         "velocity": [1, 0, 0], "angular_velocity": [0, 1, 0]},
        {"name": "wall", "shape": {"box": [1, 1, 1]}, "position": [9, 0.5, 0], "static": True},
    ],
    "deformable": [
        {"name": "jelly", "shape": {"box": [1, 1, 1], "cells": [2, 2, 2]}, "position": [3, 0.5, 0],
         "material": "rubber"}
    ],
}


class Bits(unittest.TestCase):
    def test_are_those_of_the_program(self):
        for name in ("friction", "maggot", "hard/ropes", "hard/shapes", "hard/kinematic"):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                out = Path(folder, "run")
                subprocess.run([duet.program_path(), "sim", name, "--frames", "2", "--stats-only", "--quiet",
                                "--out", out, "--threads", "1"],
                               check=True, cwd=Path(duet.Scene(name)._path).resolve().parents[name.count("/") + 1])
                lines = [json.loads(line) for line in (out / "stats.jsonl").read_text().splitlines()]
                hashes = [frame.hash for frame in duet.Scene(name).simulate(frames=2, threads=2)]
                self.assertEqual(hashes, [line["hash"] for line in lines])

    def test_states_go_on_to_the_same_bits(self):
        simulation = duet.Scene(SCENE).simulate()
        frames = [next(simulation) for _ in range(3)]
        state = simulation.save_state()
        frames += list(simulation)
        self.assertEqual(len(frames), 7)
        other = duet.Scene(SCENE).simulate()
        self.assertEqual(other.load_state(state).hash, frames[2].hash)
        self.assertEqual([frame.hash for frame in other], [frame.hash for frame in frames[3:]])
        with self.assertRaises(duet.Error):
            other.load_state(state[:-1])


class Views(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.frames = list(duet.Scene(SCENE).simulate())

    def test_are_no_copies(self):
        frame = self.frames[-1]
        for name in ("points", "velocities", "particles", "transforms", "positions", "triangles", "tetrahedra"):
            first, second = getattr(frame, name), getattr(frame, name)
            self.assertIsNot(first, second)
            self.assertEqual(first.ctypes.data, second.ctypes.data, name)
        start = frame.points.ctypes.data
        offset = len(frame["box"].points) + len(frame["wall"].points)
        self.assertEqual(frame["jelly"].points.ctypes.data, start + offset * 3 * 8)
        self.assertEqual(frame["wall"].transform.ctypes.data, frame.transforms[1].ctypes.data)

    def test_are_read_only(self):
        for array in (self.frames[0].points, self.frames[0]["box"].position, self.frames[1].contacts.impulses):
            with self.assertRaises(ValueError):
                array[...] = 0
            with self.assertRaises(ValueError):
                array.flags.writeable = True

    def test_outlive_frame_simulation_and_scene(self):
        simulation = duet.Scene(SCENE).simulate()
        next(simulation)
        points = next(simulation)["jelly"].points
        before = points.copy()
        list(simulation)
        del simulation
        gc.collect()
        trash = [np.full(points.size, 7.0) for _ in range(50)]
        np.testing.assert_array_equal(points, before)
        self.assertEqual(len(trash), 50)

    def test_frames_keep_their_values(self):
        x = [frame["box"].position[0] for frame in self.frames]
        self.assertTrue(all(a < b for a, b in zip(x, x[1:])), x)

    def test_shapes_and_types(self):
        frame = self.frames[-1]
        n, particles = len(frame.points), len(frame.particles)
        self.assertEqual(frame.names, ["box", "wall", "jelly"])
        self.assertEqual([body.kind for body in frame], ["rigid", "static", "deformable"])
        for array, shape, kind in (
            (frame.points, (n, 3), "f8"), (frame.velocities, (n, 3), "f8"), (frame.strain, (n,), "f4"),
            (frame.stress, (n,), "f4"), (frame.energy_density, (n,), "f4"), (frame.contact_pressure, (n,), "f4"),
            (frame.contact_force, (n, 3), "f4"), (frame.contact_forces, (2, 3), "f8"),
            (frame.contact_torques, (2, 3), "f8"), (frame["box"].net_contact_force, (3,), "f8"),
            (frame["jelly"].contact_force, (len(frame["jelly"].points), 3), "f4"),
            (frame.triangles, (len(frame.triangles), 3), "i4"), (frame.particles, (27, 3), "f8"),
            (frame.particle_velocities, (particles, 3), "f8"), (frame.tetrahedra, (40, 4), "i4"),
            (frame.transforms, (2, 4, 4), "f8"), (frame.orientations, (2, 4), "f8"),
            (frame.linear_velocities, (2, 3), "f8"), (frame.angular_velocities, (2, 3), "f8"),
            (frame["jelly"].tetrahedra, (40, 4), "i4"), (frame["box"].particles, (0, 3), "f8"),
            (frame["box"].orientation, (4,), "f8"),
        ):
            self.assertEqual((array.shape, array.dtype.str[1:]), (shape, kind))
        self.assertLess(frame.triangles.max(), n)
        self.assertLess(frame["jelly"].triangles.max(), len(frame["jelly"].points))

    def test_values_fit_each_other(self):
        frame = self.frames[-1]
        box = frame["box"]
        corners = np.linalg.inv(box.transform) @ np.c_[box.points, np.ones(len(box.points))].T
        np.testing.assert_allclose(np.abs(corners[:3]).max(axis=1), 0.25, atol=1e-12)
        w, *v = box.orientation
        x = np.array([0.1, 0.2, 0.3])
        np.testing.assert_allclose(box.transform[:3, :3] @ x, x + 2 * np.cross(v, np.cross(v, x) + w * x), atol=1e-12)
        np.testing.assert_allclose(
            box.velocities, box.velocity + np.cross(box.angular_velocity, box.points - box.position), atol=1e-12)
        self.assertAlmostEqual(frame.energies["total"],
                               sum(frame.energies[kind] for kind in ("kinetic", "potential", "elastic")))
        self.assertEqual(frame.statistics["frame"], 6)
        self.assertEqual(frame.statistics["stages"]["I.1 advance velocity"]["calls"], frame.statistics["substeps"])
        jelly = frame["jelly"]
        edges = jelly.particles[jelly.tetrahedra[:, 1:]] - jelly.particles[jelly.tetrahedra[:, :1]]
        self.assertAlmostEqual(np.linalg.det(edges).sum() / 6, 1, delta=0.02)

    def test_contacts_carry_the_weight(self):
        frame = self.frames[-1]
        contacts = frame.contacts
        on_box = (contacts.bodies == [frame.names.index("box"), -1]).all(axis=1)
        self.assertGreater(on_box.sum(), 2)
        np.testing.assert_allclose(contacts.normals[on_box], [[0, 1, 0]] * on_box.sum(), atol=1e-9)
        np.testing.assert_allclose(contacts.positions[on_box][:, 1], 0, atol=1e-3)
        weight = 0.125 * 500 * 9.8
        impulse = contacts.impulses[on_box][:, 1].sum()
        self.assertAlmostEqual(impulse / frame.statistics["dt_max"] / weight, 1, delta=0.6)

    def test_deformable_bodies_have_no_pose(self):
        with self.assertRaisesRegex(AttributeError, "`jelly` is deformable"):
            self.frames[0]["jelly"].transform
        with self.assertRaisesRegex(KeyError, "there is no body `jely`"):
            self.frames[0]["jely"]


class Threads(unittest.TestCase):
    def test_other_threads_run_while_it_steps(self):
        count = 0
        stop = threading.Event()

        def work():
            nonlocal count
            while not stop.is_set():
                count += 1
                time.sleep(0)

        thread = threading.Thread(target=work)
        simulation = duet.Scene("hard/cloth_on_ball").simulate(frames=2, threads=1)
        next(simulation)
        thread.start()
        before = count
        simulation._core.advance()  # one call without the lock
        stepped = count - before
        stop.set()
        thread.join()
        self.assertGreater(stepped, 10)

    def test_simulations_of_several_threads_agree(self):
        hashes: list[str] = []

        def work():
            *_, last = duet.Scene(SCENE).simulate()
            hashes.append(last.hash)

        threads = [threading.Thread(target=work) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(hashes), 3)
        self.assertEqual(len(set(hashes)), 1)

    def test_forked_processes_simulate(self):
        *_, last = duet.Scene(SCENE).simulate(threads=2)
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                *_, own = duet.Scene(SCENE).simulate()
                os.write(writer, own.hash.encode())
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        self.assertEqual(os.read(reader, 100).decode(), last.hash)

    def test_interrupts_end_the_step(self):
        program = (
            "import duet, sys\n"
            "simulation = duet.Scene('hard/cloth_on_ball').simulate(frames=100000, threads=1)\n"
            "next(simulation)\n"
            "print('begins', flush=True)\n"
            "try:\n"
            "    for frame in simulation: pass\n"
            "except KeyboardInterrupt:\n"
            "    number = simulation.frame.number\n"
            "    assert next(simulation).number == number + 1\n"
            "    print('stopped', flush=True)\n"
        )
        process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        self.assertEqual(process.stdout.readline(), "begins\n")
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.communicate(timeout=120)[0], "stopped\n")
        self.assertEqual(process.returncode, 0)

    def test_numbers_of_threads(self):
        duet.set_thread_count(2)
        self.assertEqual(duet.thread_count(), 2)
        with self.assertRaises(ValueError):
            duet.Scene(SCENE).simulate(frames=-1)


class Memory(unittest.TestCase):
    def test_dropped_scenes_leave_nothing(self):
        def resident():
            return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        def make(count):
            for _ in range(count):
                simulation = duet.Scene(SCENE).simulate(frames=1)
                kept = [frame["jelly"].points for frame in simulation]
                del simulation, kept
            gc.collect()

        count = 1000 if os.environ.get("DUET_FULL") else 100
        make(count // 2)
        before = resident()
        make(count)
        self.assertLess((resident() - before) / count, 2e3)  # bytes a scene; one holds more than 1e5

    @unittest.skipUnless(os.environ.get("DUET_FULL"), "part of tools/test --full")
    def test_dropped_scenes_leak_nothing(self):
        """LeakSanitizer, which comes with g++, finds no memory of the module that nothing refers to any more."""
        library = shutil.which("g++") and subprocess.run(
            ["g++", "-print-file-name=liblsan.so"], capture_output=True, text=True, check=True).stdout.strip()
        if not library or not os.path.isabs(library):
            self.skipTest("needs g++ with its LeakSanitizer")
        script = """if True:
            import ctypes, gc, sys
            import duet
            from test_simulation import SCENE
            for i in range(int(sys.argv[1])):
                scene = duet.Scene(SCENE)
                simulation = scene.simulate(frames=1, threads=1)
                kept = [frame["jelly"].points for frame in simulation]
                if sys.argv[2] == "leak" and i == 0:
                    ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept[0]))
            del scene, simulation, kept
            gc.collect()
            """

        def leaks_of_module(count, what):
            environment = dict(os.environ, LD_PRELOAD=library, PYTHONMALLOC="malloc", LSAN_OPTIONS="exitcode=0")
            environment["PYTHONPATH"] = os.pathsep.join([str(Path(duet.__file__).parents[1]), str(Path(__file__).parent)])
            report = subprocess.run([sys.executable, "-c", script, str(count), what], env=environment, check=True,
                                    capture_output=True, text=True).stderr
            if "LeakSanitizer has encountered a fatal error" in report:
                self.skipTest("LeakSanitizer does not work here (under a debugger?)")
            return [part for part in report.split("\n\n") if "_core" in part]

        self.assertTrue(leaks_of_module(2, "leak"), "the check finds a frame that is never released")
        self.assertEqual(leaks_of_module(1000, "none"), [])


if __name__ == "__main__":
    unittest.main()
