"""The program under test, what its runs hold, and what a test of faults has found."""
import dataclasses
import json
import os
import pathlib
import random
import resource
import shlex
import shutil
import signal
import subprocess
import time

FOLDER = pathlib.Path(__file__).resolve().parent
REPOSITORY = FOLDER.parent.parent
SCENE = "faults.toml"
LAST = 3  # last frame of the scene

# Texts that no user should see: of the C++ library when an exception ends a program, and of failed assertions.
UNCLEAR = ("terminate called", "what():", "internal error", "Assertion", "std::", "basic_string", "core dumped",
           "AddressSanitizer", "runtime error")


@dataclasses.dataclass
class Result:
    """How a program ended."""
    words: list
    status: int  # exit status, or minus the signal
    output: str
    errors: str

    @property
    def said(self):
        return self.output + self.errors

    def trouble(self):
        """Returns why a user would not understand this end; empty if the program said why it failed, or succeeded."""
        if self.status < 0:
            return f"ended by {signal.Signals(-self.status).name}"
        for text in UNCLEAR:
            if text in self.said:
                return f"said `{text}`"
        if self.status in (0, 75):
            return ""
        if self.status == 127 and "error while loading shared libraries" in self.errors:
            return ""  # the loader says what it lacks before the program begins
        if self.status not in (1, 2, 3, 4):
            return f"status {self.status}"
        if not any(len(line) > 20 and ": " in line for line in self.said.splitlines()):
            return f"status {self.status} without a sentence"
        return ""


class Bench:
    """A scratch folder with the scene, in which the program runs. The folder is removed at the end."""

    def __init__(self, duet, scratch, seed, is_full):
        self.duet = str(pathlib.Path(duet).resolve())
        self.root = pathlib.Path(scratch).resolve()
        self.seed = seed
        self.is_full = is_full
        self.cases = 0
        self.failures = []
        self.processes = 0
        for name in (SCENE, "tetrahedron.obj"):
            shutil.copy(FOLDER / name, self.root / name)

    def path(self, name):
        return self.root / name

    def random(self, *words):
        """Returns a generator of random numbers that depends on the seed and the words alone."""
        return random.Random(" ".join(map(str, (self.seed, *words))))

    def start(self, words, environment=None, limits=None, program=None):
        """Starts the program. `limits` are pairs (resource.RLIMIT_..., value)."""
        def prepare():
            for what, value in limits or ():
                resource.setrlimit(what, (value, value))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        self.processes += 1
        variables = dict(os.environ, DUET_CACHE="off", **(environment or {}))
        return subprocess.Popen([program or self.duet, *words], cwd=self.root, env=variables, preexec_fn=prepare,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    @staticmethod
    def end(process, words, seconds=300):
        """Waits for the end of a started program; one that hangs is killed, and counts as ended by SIGKILL."""
        try:
            output, errors = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            output, errors = process.communicate()
        return Result(words, process.returncode, output.decode(errors="replace"), errors.decode(errors="replace"))

    def run(self, words, environment=None, limits=None, program=None):
        return self.end(self.start(words, environment, limits, program), words)

    def must(self, words):
        """Runs a command that no fault disturbs, and ends the test if it fails."""
        result = self.run(words)
        if result.status != 0:
            raise SystemExit(f"{shlex.join(['duet', *words])} failed undisturbed: {result.said}")
        return result

    def fail(self, what, result=None):
        """Notes that a case went wrong."""
        text = what
        if result is not None:
            text += f"\n    {shlex.join(['duet', *result.words])} -> {result.status}"
            text += "".join(f"\n      {line}" for line in result.said.strip().splitlines()[-4:])
        self.failures.append(text)
        print(f"FAULT (seed {self.seed}): {text}", flush=True)

    def close(self, kind, begin):
        """Prints the totals. Returns the exit status."""
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(f"{kind}: {self.cases} cases, {len(self.failures)} faults, {self.processes} programs, seed {self.seed}, "
              f"{used.ru_utime + used.ru_stime:.1f} s of processor time, {time.time() - begin:.0f} s")
        return 1 if self.failures or self.cases == 0 else 0


def without_times(line):
    """Returns a line of statistics without its times, which differ from run to run."""
    stats = json.loads(line)
    del stats["seconds"], stats["processor_seconds"]
    for stage in stats["stages"].values():
        del stage["seconds"]
    return stats


def comparable(name, data):
    """Returns what of a run's file must be the same in every run of the scene."""
    if name.endswith(".vdb"):
        return data[:21] + data[57:]  # bytes 21 to 56 are a random identifier
    try:
        if name == "stats.jsonl":
            return [without_times(line) for line in data.decode().splitlines()]
        if name == "hashes.jsonl":
            # The first line after a --resume states all hashes anew, also of contacts of the step before, which a
            # checkpoint does not keep: the stages are compared, and the state by all other files.
            return [[record.get(key) for key in ("frame", "step", "stage")] for record in
                    map(json.loads, data.decode().splitlines())]
        if name == "manifest.json":
            return dict(json.loads(data), command="")
    except (ValueError, KeyError, TypeError):
        pass
    return data


def content_of(run):
    """Returns the comparable content of a run's files by their names. The journal and checkpoints, which contain times,
    and what does not belong to the run are left out."""
    content = {}
    for path in sorted(run.rglob("*")):
        name = path.relative_to(run).as_posix()
        outside = name.split("/")[0] in ("checkpoint", "claim", "journal", "journal.jsonl", "export")
        if not outside and path.is_file() and ".tmp" not in name:
            content[name] = comparable(name, path.read_bytes())
    return content


def differences(content, expected):
    """Returns the names of files that differ or are on one side only."""
    return sorted(name for name in content.keys() | expected.keys() if content.get(name) != expected.get(name))


def temporaries(run):
    return [path.name for path in run.rglob("*.tmp*")]
