"""Failing calls: compiles inject.c, and runs the program with it preloaded."""
import errno
import subprocess

from program import FOLDER


class Injection:
    """The preloaded library, for calls that concern files below the bench's scratch folder."""

    def __init__(self, bench):
        self.bench = bench
        self.library = bench.path("inject.so")
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", self.library, FOLDER / "inject.c", "-ldl"], check=True)

    def run(self, words, kinds, number, mode="once", error=errno.EIO, log=None):
        """Runs the program; its call `number` of these kinds fails. 0: none fails."""
        variables = {"LD_PRELOAD": str(self.library), "FAULT_ROOT": str(self.bench.root) + "/", "FAULT_CALLS": kinds,
                     "FAULT_NUMBER": str(number), "FAULT_MODE": mode, "FAULT_ERROR": str(error)}
        if log:
            variables["FAULT_LOG"] = str(log)
        return self.bench.run(words, variables)

    def calls(self, words, kinds):
        """Returns the calls of these kinds that the program makes undisturbed, as "rename mesh/0000.obj"."""
        log = self.bench.path("calls.log")
        log.unlink(missing_ok=True)
        result = self.run(words, kinds, 0, log=log)
        if result.status != 0:
            raise SystemExit(f"{words} failed with the library and no failing call: {result.said}")
        calls = [line.split(" ", 1)[1] for line in log.read_text().splitlines()]
        if not calls:
            raise SystemExit(f"{words}: the library saw no call")
        return [call.replace(str(self.bench.root) + "/", "") for call in calls]
