"""Lets every call on files of a run fail once: the program must say so or end right, and --resume give the right bits."""
import errno
import shutil

from injection import Injection
from kills import begin, check_end, check_finished, commands, content
from program import content_of, differences

# Errors that a call can end with, by its kind. Those of other kinds are EIO.
ERRORS = {
    "open": [errno.EIO, errno.EMFILE, errno.EACCES],
    "write": [errno.ENOSPC, errno.EIO],
    "rename": [errno.EIO, errno.ENOSPC],
    "folder": [errno.ENOSPC],
    "list": [errno.EIO, errno.EMFILE],
    "stat": [errno.EIO, errno.EACCES],
    "close": [errno.ENOSPC],
}
KINDS = "open,read,write,close,sync,rename,link,remove,folder,truncate,stat,list"


def expected_of(bench, name):
    begin(bench, name)
    bench.must(commands(bench)[name][0])
    return content(bench, name)


def damaged(bench, name, expected, before):
    """Returns the files whose bytes are neither those of an undisturbed run nor those `before` the command; a run may
    lack files."""
    found = content(bench, name)
    wrong = []
    for file in differences(found, expected):
        if file not in found or (file in before and found[file] == before[file]):
            continue
        whole = expected.get(file)
        # Files that grow line by line may have fewer lines.
        if isinstance(whole, list) and isinstance(found[file], list) and found[file] == whole[:len(found[file])]:
            continue
        wrong.append(file)
    return wrong


def check(bench, name, what, result, expected, before=None):
    """Checks how a program with a failing call ended, what it left, and what --resume makes of it."""
    where = f"{name}: {what}"
    check_end(bench, name, where, result, expected)
    run = bench.path("run")
    if result.status != 0 and name != "export" and (wrong := damaged(bench, name, expected, before or {})):
        verified = bench.run(["verify", str(run)])
        if unnamed := [file for file in wrong if file not in verified.said]:
            bench.fail(f"{where}: {', '.join(unnamed)} are damaged, and `verify` does not say so", verified)
    check_finished(bench, name, where, expected)


def cases(bench, calls, name):
    """Returns pairs (number of a call, errno): all in the long form; a few in the short one, one of each kind first."""
    everything = [(i + 1, error) for i, call in enumerate(calls)
                  for error in ERRORS.get(call.split()[0], [errno.EIO])]
    if bench.is_full:
        return everything
    choice = bench.random("cases", name)
    choice.shuffle(everything)
    kinds = set()
    first, others = [], []
    for case in everything:
        kind = calls[case[0] - 1].split()[0]
        (others if kind in kinds else first).append(case)
        kinds.add(kind)
    return (first + others)[:{"sim": 14, "export": 4}[name]]


def fail_each(bench, injection, name):
    expected = expected_of(bench, name)
    words, _ = commands(bench)[name]
    begin(bench, name)
    calls = injection.calls(words, KINDS)
    for number, error in cases(bench, calls, name):
        begin(bench, name)
        result = injection.run(words, KINDS, number, error=error)
        bench.cases += 1
        check(bench, name, f"call {number} of {len(calls)} ({calls[number - 1]}) fails with {errno.errorcode[error]}",
              result, expected)


def fail_resuming(bench, injection):
    """Lets calls of --resume fail, which reads what is there."""
    name = "sim"
    expected = expected_of(bench, name)
    words, more = commands(bench)[name]
    shutil.rmtree(bench.path("run"))
    bench.must(words + ["--frames", "1"])
    shutil.rmtree(bench.path("begun"), ignore_errors=True)
    shutil.copytree(bench.path("run"), bench.path("begun"))
    before = content(bench, name)
    calls = injection.calls(words + more, KINDS)
    everything = cases(bench, calls, name)
    for number, error in everything if bench.is_full else everything[:4]:
        shutil.rmtree(bench.path("run"))
        shutil.copytree(bench.path("begun"), bench.path("run"))
        result = injection.run(words + more, KINDS, number, error=error)
        bench.cases += 1
        check(bench, name, f"call {number} of {len(calls)} of --resume ({calls[number - 1]}) fails with "
              f"{errno.errorcode[error]}", result, expected, before)


def fail_threads(bench, injection):
    """Refuses a thread: the program must say so."""
    for name, more in (("sim", ["--threads", "3"]), ("run", [])) if bench.is_full else (("sim", ["--threads", "3"]),):
        expected = expected_of(bench, name)
        words = commands(bench)[name][0] + more
        begin(bench, name)
        count = len(injection.calls(words, "thread"))
        for number in range(1, count + 1):
            begin(bench, name)
            result = injection.run(words, "thread", number, error=errno.EAGAIN)
            bench.cases += 1
            check(bench, name, f"thread {number} of {count} is refused", result, expected)


def fill_disk(bench, injection, name, count):
    """From some write on, no write succeeds: a full disk. What is there must stay whole."""
    expected = expected_of(bench, name)
    words, _ = commands(bench)[name]
    begin(bench, name)
    writes = injection.calls(words, "write")
    for i in range(count):
        number = 1 + i * len(writes) // count
        begin(bench, name)
        result = injection.run(words, "write", number, mode="stay", error=errno.ENOSPC)
        bench.cases += 1
        what = f"no space from write {number} of {len(writes)} on ({writes[number - 1]})"
        if result.status == 0 or "No space left on device" not in result.said:
            bench.fail(f"{name}: {what}: does not say so", result)
        check(bench, name, what, result, expected)


def read_damage(bench, injection):
    """Lets each call of `verify` fail: it must say so, or try again and find what it finds undisturbed."""
    bench.must(["sim", "faults.toml", "--out", "whole-sim", "--quiet", "--overwrite"])
    words = ["verify", str(bench.path("whole-sim"))]
    whole = bench.must(words).output
    calls = injection.calls(words, KINDS)
    everything = cases(bench, calls, "sim")
    for number, error in everything if bench.is_full else everything[:6]:
        result = injection.run(words, KINDS, number, error=error)
        bench.cases += 1
        what = f"verify: call {number} ({calls[number - 1]}) fails with {errno.errorcode[error]}"
        if trouble := result.trouble():
            bench.fail(f"{what}: {trouble}", result)
        elif result.status == 0 and result.output != whole:
            bench.fail(f"{what}: not said", result)


def test(bench):
    injection = Injection(bench)
    bench.must(["sim", "faults.toml", "--out", "whole-sim", "--quiet"])
    for name in ("sim", "render", "export", "run") if bench.is_full else ("sim", "export"):
        fail_each(bench, injection, name)
    fail_resuming(bench, injection)
    fail_threads(bench, injection)
    fill_disk(bench, injection, "sim", 40 if bench.is_full else 3)
    read_damage(bench, injection)
    if bench.is_full:
        fill_disk(bench, injection, "export", 20)
        assert content_of(bench.path("whole-sim"))
