#!/usr/bin/env python3
"""Tests that no fault loses or falsifies a run: kills, failing calls, damaged files, limits, two writers.

  tests/faults/faults.py KIND --duet build/duet [--full] [--seed N] [--keep FOLDER]
    KIND      kills, calls, damage, limits, writers
    --full    the long form: all calls, 50 kills, 3,000 damaged files
    --seed    of the random choices; each fault is printed with it
    --keep    work in this folder, which must not exist, and leave it there

Prints every fault that it finds, and ends with status 1 if there is one.
"""
import argparse
import importlib
import pathlib
import sys
import tempfile
import time

sys.dont_write_bytecode = True

from program import Bench  # noqa: E402

MODULES = {"kills": "kills", "calls": "calls", "damage": "damage", "limits": "limits", "writers": "writers"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=MODULES)
    parser.add_argument("--duet", required=True)
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--seed", type=int, default=47)
    parser.add_argument("--keep")
    options = parser.parse_args()
    begin = time.time()
    with tempfile.TemporaryDirectory(prefix="duet-faults-") as scratch:
        if options.keep:
            scratch = options.keep
            pathlib.Path(scratch).mkdir(parents=True)
        bench = Bench(options.duet, scratch, options.seed, options.full)
        importlib.import_module(MODULES[options.kind]).test(bench)
        return bench.close(options.kind, begin)


if __name__ == "__main__":
    sys.exit(main())
