"""Runs the program with little memory and with a bound on the size of files: it must end with a sentence, and what it
leaves must be whole and go on to the right bits."""
import resource

from kills import begin, check_end, check_finished, commands, content
from program import SCENE

MEGABYTE = 1 << 20


def limited(bench, name, limits, what, expected):
    """Runs a command under limits, then finishes it without them."""
    words, _ = commands(bench)[name]
    begin(bench, name)
    result = bench.run(words, limits=limits)
    bench.cases += 1
    where = f"{name} with {what}"
    check_end(bench, name, where, result, expected)
    if result.status == 0:
        return result.status
    if bench.path("run/checkpoint/0000.bin").exists():
        verified = bench.run(["verify", str(bench.path("run"))])
        if verified.status != 0:
            bench.fail(f"{where}: leaves damage", verified)
    check_finished(bench, name, where, expected)
    return result.status


def needed(bench, words):
    """Returns the address space in MB with which a command that changes nothing succeeds, by bisection."""
    low, high = 8, 16384
    while high - low > max(4, low // 16):
        middle = (low + high) // 2
        status = bench.run(words, limits=[(resource.RLIMIT_AS, middle * MEGABYTE)]).status
        low, high = (low, middle) if status == 0 else (middle, high)
    return high


def memory(bench, names, count):
    """Gives the commands address space from what `duet --version` needs to twice that. With less, libraries end the
    program before it begins: log4cplus, which OpenVDB uses, starts threads while it is loaded."""
    least = needed(bench, ["--version"])
    for name in names:
        begin(bench, name)
        bench.must(commands(bench)[name][0])
        expected = content(bench, name)
        choice = bench.random("memory", name)
        failed = 0
        for i in range(count):
            size = int(least * (1 + (i + choice.random()) / count))
            failed += limited(bench, name, [(resource.RLIMIT_AS, size * MEGABYTE)], f"{size} MB of memory", expected) != 0
        if failed == 0:
            bench.fail(f"{name}: no limit was low enough to fail")


def file_sizes(bench, name, sizes):
    """Bounds the size of files, which stands for a full disk."""
    begin(bench, name)
    bench.must(commands(bench)[name][0])
    expected = content(bench, name)
    for size in sizes:
        if limited(bench, name, [(resource.RLIMIT_FSIZE, size)], f"files of {size} bytes at most", expected) == 0:
            bench.fail(f"{name}: writes files of more than {size} bytes in spite of the limit")


def test(bench):
    bench.must(["sim", SCENE, "--out", "whole-sim", "--quiet"])
    file_sizes(bench, "sim", [0, 1, 100, 1000, 2000, 4000, 20_000, 100_000, 250_000, 300_000] if bench.is_full
               else [100, 250_000])
    if bench.is_full:
        file_sizes(bench, "run", [0, 1000, 2000, 300_000])
        file_sizes(bench, "export", [0, 1000, 20_000])
    memory(bench, ("sim", "run", "render", "export") if bench.is_full else ("sim",), 24 if bench.is_full else 6)
