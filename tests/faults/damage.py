"""Truncates files of a run and flips bits in them: `verify` names each, and no reader shows wrong data silently."""
import fnmatch
import re
import shutil
import subprocess

from program import LAST, REPOSITORY, SCENE, content_of

# Readers by their names: the words that start them, and where their output is; None: what they print.
READERS = {
    "render": (["render", "run", "--out", "drawn", "--quiet"], "drawn"),
    "report": (["report", "run"], "run/report"),
    "export": (["export", "run", "--to", "obj", "--out", "exported", "--quiet"], "exported"),
    "view": (["view", "run", "--out", "view.html", "--quiet"], "view.html"),
    "compare": (["compare", "run", "whole"], None),
    "overlaps": (["overlaps", SCENE, "--out", "run"], None),
    "stages": (["hashes", "--stages", "run", "whole"], None),
    "encode": (["encode", "run", "--quiet"], "run/faults.mp4"),
    "resume": (["sim", "run", "--frames", str(LAST + 1), "--hash-stages", "--ledger", "--quiet", "--resume"], "run"),
    "plot-ledger": (["run", "ledger.png"], "ledger.png"),
}
# Readers of each kind of file, those that take long last.
KINDS = {
    "checkpoint/*.bin": ["overlaps", "resume"],
    "stats.jsonl": ["report", "view", "resume", "plot-ledger"],
    "hashes.jsonl": ["stages"],
    "mesh/*.obj": ["render", "resume"],
    "levelset/*.vdb": ["resume"],
    "values/*.npy": ["export", "view", "resume"],
    "image/*.png": ["compare", "encode", "report"],
    "manifest.json": ["export", "view", "report", "compare", "resume", "render"],
    "scene.toml": ["export", "view", "report", "render"],
    "source/*": ["resume"],
    "faults.mp4": ["encode"],
    "journal.jsonl": ["report", "export", "view", "compare", "overlaps", "encode", "resume", "render"],
}


def clear(bench, *names):
    for name in names:
        path = bench.path(name)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def restore(bench):
    """Makes run/ a copy of whole/, and removes what readers wrote."""
    clear(bench, "run", *(output.split("/")[0] for _, output in READERS.values() if output))
    shutil.copytree(bench.path("whole"), bench.path("run"))


def read(bench, reader):
    """Starts a reader. Returns its result and its output, in which nothing differs from one time to the next."""
    words, output = READERS[reader]
    program = str(REPOSITORY / "tools/plot-ledger") if reader == "plot-ledger" else None
    result = bench.run(words, program=program)
    if reader == "plot-ledger":
        result.words = ["plot-ledger", *words]
    if output is None:
        return result, result.output
    path = bench.path(output)
    if path.is_dir():
        return result, content_of(path)
    return result, path.read_bytes() if path.exists() else None


def damaged_bytes(data, choice):
    """Returns the bytes with a flipped bit, or truncated, and what was done."""
    if choice.random() < 0.35:
        size = choice.choice([0, len(data) - 1, len(data) // 2, choice.randrange(len(data)),
                              data.rfind(b"\n", 0, choice.randrange(len(data))) + 1])
        return data[:size], f"truncated to {size} of {len(data)} bytes"
    place, bit = choice.randrange(len(data)), choice.randrange(8)
    changed = bytearray(data)
    changed[place] ^= 1 << bit
    return bytes(changed), f"bit {bit} of byte {place} flipped"


def is_named(name, result):
    """Returns whether the program names the file: by its path, or the picture of a frame by its number."""
    frame = re.fullmatch(r"image/0*(\d+)\.png", name)
    return name in result.said or (frame is not None and
                                   re.search(rf"\bframes? (.*\b)?{frame[1]}\b", result.said) is not None)


def same(name, output, expected):
    """Returns whether a reader of a damaged file wrote what it writes of a whole one. A run that goes on without a word
    keeps a damaged source, which it does not read, and may have a damaged checkpoint that it replaces or removes."""
    if isinstance(output, dict) and name.startswith("source/"):
        output, expected = ({key: value for key, value in one.items() if key != name} for one in (output, expected))
    return output == expected


def judge(bench, reader, name, what, expected):
    """Lets a reader read the run with a damaged file. Returns whether it was silently wrong."""
    result, output = read(bench, reader)
    where = f"{name} {what}, {reader}"
    if trouble := result.trouble():
        bench.fail(f"{where}: {trouble}", result)
    if result.status != 0 or is_named(name, result):
        return False
    if same(name, output, expected):
        return False
    bench.fail(f"{where}: silently wrong", result)
    return True


def verify(bench, name, what):
    """Checks that `verify` names the damaged file. Returns whether it did not."""
    result = bench.run(["verify", "run"])
    if trouble := result.trouble():
        bench.fail(f"{name} {what}, verify: {trouble}", result)
    if result.status == 4 and is_named(name, result):
        return False
    if name == "journal.jsonl":
        if result.status == 4 or "journal.jsonl" in result.said:
            return False  # a line that was changed accuses the file that it is about
        if entries(bench.path("run")) == entries(bench.path("whole")):
            return False  # a later line about the same file counts
    bench.fail(f"{name} {what}: `verify` does not name it", result)
    return True


def entries(run):
    """Returns what the journal of a run lists, as tools/journaled prints it."""
    listed = subprocess.run([REPOSITORY / "tools/journaled", "--list", run], capture_output=True, check=True)
    return listed.stdout


def plan(bench, names):
    """Returns triples (file, number of the damage, readers)."""
    choice = bench.random("plan")
    cases = []
    count = 250 if bench.is_full else 5
    for pattern, readers in KINDS.items():
        files = [name for name in names if fnmatch.fnmatch(name, pattern)]
        slow = ("plot-ledger", "render")
        for i in range(count):
            # Slow readers, which are the last ones, have few cases: one of a kind in the short form.
            few = [reader for reader in readers if reader not in slow] or readers
            reader = readers[-1] if i % 25 == count % 25 - 1 else choice.choice(few)
            cases.append((choice.choice(files), i, reader if bench.is_full or i % 2 == 0 else None))
    choice.shuffle(cases)
    return cases


def test(bench):
    bench.must(["run", SCENE, "--out", "whole", "--hash-stages", "--ledger", "--quiet"])
    names = [path.relative_to(bench.path("whole")).as_posix() for path in bench.path("whole").rglob("*")
             if path.is_file()]
    expected, silent = {}, 0
    for name, number, reader in plan(bench, names):
        if reader and reader not in expected:
            restore(bench)
            result, expected[reader] = read(bench, reader)
            if result.status != 0:
                raise SystemExit(f"{reader} fails undamaged: {result.said}")
        restore(bench)
        path = bench.path("run") / name
        data = path.read_bytes()
        changed, what = damaged_bytes(data, bench.random(name, number))
        if changed == data:
            continue  # truncated at its end
        path.write_bytes(changed)
        bench.cases += 1
        wrong = verify(bench, name, what)
        if reader:
            wrong |= judge(bench, reader, name, what, expected[reader])
        silent += wrong
        if bench.cases % 250 == 0:
            print(f"damage: {silent} of {bench.cases} silent so far", flush=True)
    print(f"damage: {silent} of {bench.cases} silent")
