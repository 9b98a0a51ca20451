"""Kills the program at random moments and at exact calls of the C library; --resume must give the undisturbed bits."""
import shutil
import time

from injection import Injection
from program import SCENE, content_of, differences, temporaries

KINDS = "open,write,close,rename,link,remove,folder,truncate"  # calls that change files


def commands(bench):
    """Returns what is killed: name, words that begin it, words that finish it, and the folder that counts."""
    out = str(bench.path("run"))
    return {
        "sim": (["sim", SCENE, "--out", out, "--hash-stages", "--quiet"], ["--resume"]),
        "run": (["run", SCENE, "--out", out, "--quiet"], ["--resume"]),
        "render": (["render", out, "--quiet"], []),
        "export": (["export", out, "--to", "usd", "--quiet"], ["--overwrite"]),
    }


def begin(bench, name):
    """Makes the folder as it is before the command."""
    shutil.rmtree(bench.path("run"), ignore_errors=True)
    if name in ("render", "export"):
        shutil.copytree(bench.path("whole-sim"), bench.path("run"))


def content(bench, name):
    return content_of(bench.path("run/export/usd")) if name == "export" else content_of(bench.path("run"))


def undisturbed(bench):
    """Returns for each command the content that it leaves undisturbed, and the seconds that it takes."""
    bench.must(["sim", SCENE, "--out", "whole-sim", "--quiet"])
    expected = {}
    for name, (words, _) in commands(bench).items():
        begin(bench, name)
        start = time.time()
        bench.must(words)
        expected[name] = content(bench, name), time.time() - start
    return expected


def check_end(bench, name, where, result, expected):
    """Reports a program that ended without a sentence, or with status 0 and files that are not right."""
    if trouble := result.trouble():
        bench.fail(f"{where}: {trouble}", result)
    if result.status == 0 and (wrong := differences(content(bench, name), expected)):
        bench.fail(f"{where}: status 0, and {', '.join(wrong)} are not right", result)


def check_finished(bench, name, where, expected):
    """Finishes a command that was disturbed, and reports what then is not as an undisturbed one leaves it. Returns how
    the finishing program ended, or None after a report."""
    words, more = commands(bench)[name]
    finished = bench.run(words + more)
    if finished.status != 0:
        return bench.fail(f"{where}: cannot be finished", finished)
    if wrong := differences(content(bench, name), expected):
        return bench.fail(f"{where}: {', '.join(wrong)} differ after it was finished", finished)
    verified = bench.run(["verify", str(bench.path("run"))])
    if verified.status != 0:
        return bench.fail(f"{where}: damaged after it was finished", verified)
    return finished


def check(bench, name, what, expected):
    """Checks the folder of a killed program, finishes its work, and compares the result with the undisturbed one."""
    where = f"{name} killed {what}"
    if bench.path("run/journal.jsonl").exists():
        verified = bench.run(["verify", str(bench.path("run"))])
        # A run that was killed before it listed a file has an empty journal.
        if verified.status != 0 and bench.path("run/checkpoint/0000.bin").exists():
            bench.fail(f"{where}: `verify` finds damage", verified)
    finished = check_finished(bench, name, where, expected[name][0])
    if finished and name in ("sim", "run") and (left := temporaries(bench.path("run"))):
        bench.fail(f"{where}: left {left}", finished)


def kill_after(bench, name, seconds):
    """Kills the command after a time."""
    words, _ = commands(bench)[name]
    process = bench.start(words)
    time.sleep(seconds)
    process.kill()
    return bench.end(process, words)


def kill_at_calls(bench, injection, name, count, expected):
    """Kills the command at `count` calls, which are spread over all that it makes."""
    words, _ = commands(bench)[name]
    begin(bench, name)
    calls = injection.calls(words, KINDS)
    choice = bench.random("calls", name)
    for i in range(count):
        call = min(len(calls), int((i + choice.random()) * len(calls) / count) + 1)
        mode = choice.choice(["kill", "half"])
        begin(bench, name)
        killed = injection.run(words, KINDS, call, mode=mode)
        what = f"at call {call} of {len(calls)} ({calls[call - 1]}, {mode})"
        bench.cases += 1
        if killed.status != -9:
            bench.fail(f"{name} was not killed {what}", killed)
            continue
        check(bench, name, what, expected)


def kill_at_times(bench, name, count, expected):
    """Kills the command at random moments; a finished one is tried again earlier."""
    choice = bench.random("times", name)
    for _ in range(count):
        begin(bench, name)
        seconds = expected[name][1] * (0.15 + 0.8 * choice.random())
        for _ in range(8):
            killed = kill_after(bench, name, seconds)
            if killed.status == -9:
                break
            begin(bench, name)
            seconds *= 0.7
        bench.cases += 1
        if killed.status != -9:
            bench.fail(f"{name} ended before it could be killed", killed)
        else:
            check(bench, name, f"after {seconds:.3f} s", expected)


def test(bench):
    injection = Injection(bench)
    expected = undisturbed(bench)
    at_calls = {"sim": 12, "run": 12, "render": 4, "export": 2} if bench.is_full else {"sim": 2, "run": 1, "export": 1}
    at_times = {"sim": 8, "run": 8, "render": 2, "export": 2} if bench.is_full else {"sim": 1}
    for name, count in at_calls.items():
        kill_at_calls(bench, injection, name, count, expected)
    for name, count in at_times.items():
        kill_at_times(bench, name, count, expected)
