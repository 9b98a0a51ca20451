"""The examples run, and say what they should."""

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

EXAMPLES = Path(os.environ.get("DUET_EXAMPLES", Path(__file__).resolve().parents[1] / "examples"))
HAS_MATPLOTLIB = importlib.util.find_spec("matplotlib") is not None
needs_matplotlib = unittest.skipUnless(HAS_MATPLOTLIB, "needs the package python3-matplotlib")


class Examples(unittest.TestCase):
    def run_example(self, name, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run([sys.executable, EXAMPLES / name, *arguments], cwd=folder, text=True,
                                    capture_output=True, env={**os.environ, "MPLBACKEND": "Agg"}, check=False)
            self.assertEqual(result.returncode, 0, result.stderr)
            return result.stdout, {file.name: file.read_bytes() for file in Path(folder).iterdir()}

    def number(self, pattern, text):
        found = re.search(pattern, text)
        self.assertIsNotNone(found, text)
        return float(found.group(1))

    def test_all_are_short(self):
        files = sorted(EXAMPLES.glob("*.py"))
        self.assertEqual(len(files), 6)
        for file in files:
            self.assertLessEqual(len(file.read_text().splitlines()), 40, file)

    @needs_matplotlib
    def test_sweep(self):
        output, files = self.run_example("sweep.py")
        self.assertLess(self.number("largest difference: (.*) m", output), 0.01)
        self.assertEqual(files["sweep.png"][:4], b"\x89PNG")

    @needs_matplotlib
    def test_drive(self):
        output, files = self.run_example("drive.py")
        self.assertGreater(self.number("speed of the ball: (.*) m/s", output), 0.5)
        self.assertEqual(files["drive.png"][:4], b"\x89PNG")

    def test_stop_at_event(self):
        output, _ = self.run_example("stop_at_event.py")
        self.assertIn("the rope breaks at 0.4", output)
        self.assertGreater(self.number(r"has (\S+) m/s", output), 4)

    def test_batch(self):
        output, _ = self.run_example("batch.py")
        strains = [float(one) for one in re.findall(r"strain (\S+)", output)]
        self.assertEqual(len(strains), 5)
        self.assertLess(2 * strains[0], strains[-1])

    def test_mesh_from_arrays(self):
        output, files = self.run_example("mesh_from_arrays.py")
        self.assertGreater(self.number(r"(\d+) tetrahedra", output), 100)
        self.assertIn("ring.npz", files)

    @needs_matplotlib
    def test_frames_to_matplotlib(self):
        _, files = self.run_example("frames_to_matplotlib.py", "frames.png", "2")
        self.assertEqual(files["frames.png"][:4], b"\x89PNG")


if __name__ == "__main__":
    unittest.main()
