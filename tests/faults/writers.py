"""Starts programs that write to one run directory at the same time: each works or is refused with a sentence, and the
files are those of one undisturbed program."""
import shutil

from program import SCENE, content_of, differences

OUT = "run"
SIM = ["sim", SCENE, "--out", OUT, "--quiet"]
RESUME = [*SIM, "--resume"]
DRAW = ["render", OUT, "--quiet"]
MISSING = [*DRAW, "--missing"]

# What runs at once, and what is in the folder before: nothing, a simulation of one frame, or all of it.
GROUPS = {
    "two simulations": ("nothing", [SIM, SIM]),
    "two simulations, one waits": ("nothing", [SIM, [*RESUME, "--wait", "60"]]),
    "three continue": ("begun", [RESUME, RESUME, RESUME]),
    "two draw": ("whole", [DRAW, DRAW]),
    "three draw what is missing": ("whole", [MISSING, MISSING, MISSING]),
    "one simulates, one draws": ("begun", [RESUME, [*MISSING, "--wait", "60"]]),
    "two runs": ("begun", [["run", *RESUME[1:]], ["run", *RESUME[1:]]]),
    "one replaces, one continues": ("begun", [[*SIM, "--overwrite"], RESUME]),
}
SHORT = ("two simulations", "three continue", "one simulates, one draws")


def together(bench, name, before, commands, expected):
    """Starts the commands at once, and finishes what they left."""
    shutil.rmtree(bench.path(OUT), ignore_errors=True)
    if before != "nothing":
        shutil.copytree(bench.path(before), bench.path(OUT))
    started = [(bench.start(words), words) for words in commands]
    results = [bench.end(process, words) for process, words in started]
    bench.cases += 1
    for result in results:
        if trouble := result.trouble():
            bench.fail(f"{name}: {trouble}", result)
    if all(result.status != 0 for result in results):
        bench.fail(f"{name}: none of them finished", results[0])
    verified = bench.run(["verify", OUT])
    if verified.status != 0:
        bench.fail(f"{name}: leave damage", verified)
    finished = bench.run(["run", SCENE, "--out", OUT, "--quiet", "--resume"])
    if finished.status != 0:
        bench.fail(f"{name}: cannot be finished", finished)
    elif wrong := differences(content_of(bench.path(OUT)), expected):
        bench.fail(f"{name}: {', '.join(wrong)} differ from an undisturbed run", finished)
    verified = bench.run(["verify", OUT])
    if verified.status != 0:
        bench.fail(f"{name}: damaged after it was finished", verified)


def test(bench):
    bench.must(["run", SCENE, "--out", "undisturbed", "--quiet"])
    expected = content_of(bench.path("undisturbed"))
    bench.must(["sim", SCENE, "--out", "whole", "--quiet"])
    bench.must(["sim", SCENE, "--out", "begun", "--frames", "1", "--quiet"])
    for round_ in range(5 if bench.is_full else 1):
        for name, (before, commands) in GROUPS.items():
            if bench.is_full or name in SHORT:
                together(bench, f"{name} (round {round_})", before, commands, expected)
