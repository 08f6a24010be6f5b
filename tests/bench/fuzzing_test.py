#!/usr/bin/env python3
"""bench/fuzzing and tools/fuzz: lines of the ledger from what libFuzzer prints, and their totals: fuzzing_test.py SOURCE_DIR"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

source = pathlib.Path(sys.argv[1])
script = source / "bench/fuzzing"
failures = 0

LOG = """INFO: Loaded 1 modules   (4321 inline 8-bit counters): 4321 [0x1, 0x2),
#2      INITED cov: 17 ft: 18 corp: 1/1b exec/s: 0 rss: 30Mb
#900    DONE   cov: 170 ft: 205 corp: 9/90b lim: 4 exec/s: 0 rss: 31Mb
stat::number_of_executed_units: 900
stat::slowest_unit_time_sec:    3
"""
FORKED = """INFO: Loaded 1 modules   (4321 inline 8-bit counters): 4321 [0x1, 0x2),
#500: cov: 100 ft: 110 corp: 5 exec/s: 100 oom/timeout/crash: 0/0/0 time: 5s
#1400: cov: 180 ft: 210 corp: 6 exec/s: 100 oom/timeout/crash: 0/0/0 time: 14s
"""


def expect(true, what):
    global failures
    if not true:
        failures += 1
        print(what)


def ran(*options, log=""):
    done = subprocess.run([script, *options], input=log, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


with tempfile.TemporaryDirectory() as folder:
    ledger = pathlib.Path(folder) / "ledger.tsv"

    def add(target, log, finds="0"):
        return ran("--ledger", ledger, "--add", target, "--commit", "abc", "--wall", "60", "--cpu", "1800", "--finds", finds, log=log)

    status, text = ran("--ledger", ledger)
    expect(status == 2 and "is missing" in text, f"a ledger that is missing: {status} {text}")
    expect(add("job", LOG)[0] == 0 and add("job", FORKED, "1")[0] == 0 and add("gcode", LOG)[0] == 0, "lines are added")
    lines = [line.split("\t") for line in ledger.read_text().splitlines()]
    expect(len(lines) == 4 and lines[1][1:] == ["abc", "job", "900", "60", "1800", "170", "4321", "205", "3", "0"], f"a line: {lines}")
    expect(lines[2][3:] == ["1400", "60", "1800", "180", "4321", "210", "0", "1"], f"a line of a run in several processes: {lines[2]}")
    status, text = ran("--ledger", ledger)
    expect("| job | 2300 | 1.00 | 180 | 4321 | 210 | 3 | 1 |" in text, f"a target's total: {text}")
    expect("3200 executions in 1.50 hours of processor time, 0.05 of the clock" in text and "; 1 finds" in text, f"the sum: {text}")
    kept = ledger.read_text()
    status, text = add("job", "stopped before it said a thing")
    expect(status == 2 and "did not say" in text and ledger.read_text() == kept, f"a log without figures: {status} {text}")
    ledger.write_text(kept + "2026-01-01\tabc\tjob\tmany\n")
    status, text = ran("--ledger", ledger)
    expect(status == 2 and ":5:" in text, f"a line that is none: {status} {text}")

# ---- tools/fuzz with a target that only prints, and leaves a find behind; nothing is built
with tempfile.TemporaryDirectory() as folder:
    root = pathlib.Path(folder)
    for part in ("tools", "bench", "bin", "tests/fuzz", "build/asan"):
        (root / part).mkdir(parents=True)
    shutil.copy(source / "tools/fuzz", root / "tools")
    shutil.copy(script, root / "bench")
    (root / "tests/fuzz/job_fuzz.cpp").write_text("")
    (root / "log").write_text(LOG)

    def program(path, text):
        (root / path).write_text("#!/bin/sh\n" + text)
        (root / path).chmod(0o755)

    def fuzz():
        return subprocess.run([root / "tools/fuzz", "job", "--minutes", "0.02", "--ledger", "ledger.tsv"], capture_output=True, text=True,
                              env={**os.environ, "PATH": f"{root / 'bin'}:{os.environ['PATH']}"})

    program("bin/cmake", "exit 0\n")
    program("build/asan/job_fuzz", "cat log; echo x >build/fuzz/job.finds/slow-unit-1\n")  # no find: the machine may be busy
    clean = fuzz()
    expect(clean.returncode == 0 and "900 executions" in clean.stdout and "clean" in clean.stdout, f"a clean run: {clean}")
    program("build/asan/job_fuzz", "cat log; echo x >build/fuzz/job.finds/crash-1; kill -ABRT $$\n")
    found = fuzz()
    expect(found.returncode == 1 and "FOUND SOMETHING: crash-1" in found.stdout, f"a run that finds something: {found}")
    rows = [line.split("\t") for line in (root / "ledger.tsv").read_text().splitlines()]
    expect([row[2] for row in rows[1:]] == ["job", "job"] and [row[-1] for row in rows[1:]] == ["0", "1"], f"the ledger of two runs: {rows}")
sys.exit(1 if failures else 0)
