#!/usr/bin/env python3
"""bench/guard against programs that print what a benchmark would: guard_test.py SOURCE_DIR"""
import json
import pathlib
import stat
import subprocess
import sys
import tempfile

guard = pathlib.Path(sys.argv[1]) / "bench/guard"
folder = pathlib.Path(tempfile.mkdtemp())
failures = 0


def program(name, benchmarks, code=0):
    path = folder / name
    text = json.dumps({"context": {}, "benchmarks": benchmarks})
    path.write_text(f"#!/bin/sh\ncat <<'END'\n{text}\nEND\nexit {code}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def result(name, ms, cpu=None, **more):
    return {"name": name, "run_type": "iteration", "real_time": ms * 1e6, "cpu_time": (cpu or ms) * 1e6, "time_unit": "ns", "iterations": 3, **more}


def expect(code, what, base, head, *options):
    global failures
    done = subprocess.run([str(guard), base, head, "--rounds", "2", *options], capture_output=True, text=True)
    if done.returncode == code:
        return done.stdout
    failures += 1
    print(f"{what}: exit {done.returncode} instead of {code}\n{done.stdout}{done.stderr}")
    return ""


base = program("base", [result("a", 100), result("b", 2)])
expect(0, "the same", base, program("same", [result("a", 100), result("b", 2)]))
expect(0, "a little slower", base, program("little", [result("a", 109), result("b", 2)]))
out = expect(1, "slower", base, program("slower", [result("a", 115), result("b", 2)]))
if "| a | 100.000 | 115.000 | +15.000 | +15.0 % | **slower** |" not in out:
    failures += 1
    print("the table does not say what is slower:\n" + out)
expect(0, "faster", base, program("faster", [result("a", 50), result("b", 1)]))
expect(0, "much in percent, little in time", base, program("short", [result("a", 100), result("b", 2.9)]))
expect(1, "the same with a smaller limit of time", base, str(folder / "short"), "--milliseconds", "0.5")
expect(0, "a larger limit of percent", base, str(folder / "slower"), "--percent", "20")
expect(0, "slower by the clock only", base, program("waits", [result("a", 300, 100), result("b", 2)]), "--cpu")
expect(1, "slower on the processor only", base, program("works", [result("a", 100, 300), result("b", 2)]), "--cpu")
memory = program("memory", [result("a", 100, **{"anonymous bytes/facet": 50.0, "bytes/s": 1.0})])
expect(1, "more memory", memory, program("more", [result("a", 100, **{"anonymous bytes/facet": 60.0, "bytes/s": 1.0})]))
expect(0, "less memory", str(folder / "more"), memory)
expect(2, "one is missing", base, program("fewer", [result("a", 100)]))
expect(2, "none", base, program("none", []))
expect(2, "a program that fails", base, program("fails", [result("a", 100), result("b", 2)], 3))
expect(2, "a benchmark that fails", base, program("wrong", [result("a", 100, error_occurred=True, error_message="no input"), result("b", 2)]))
expect(2, "one program only", base, base)
print(f"{failures} failed")
sys.exit(1 if failures else 0)
