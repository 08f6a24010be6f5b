#!/usr/bin/env python3
"""bench/reproduce against commands that print what a table says, or something else: reproduce_test.py SOURCE_DIR"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

source = pathlib.Path(sys.argv[1])
failures = 0

TABLE = """| part | minutes | CPU s |
|---|---|---|
| a | 12.5 | 3 |
| b | −0.4 % | 4 |

Both make 2 parts."""


def told(printed, kind="computed", **more):
    """Exit status and output of a copy that has this table, and whose command prints `printed`."""
    with tempfile.TemporaryDirectory() as folder:
        bench = pathlib.Path(folder) / "bench"
        bench.mkdir()
        shutil.copy(source / "bench/reproduce", bench)
        (bench / "printed").write_text(printed)
        keys = {"name": "x", "kind": kind, "command": "cat bench/printed", "about_minutes": 1, "commit": "abc", "date": "2026-01-01", **more}
        (bench / "figures.toml").write_text("[[figure]]\n" + "".join(f"{key} = {value!r}\n" for key, value in keys.items()))
        (bench / "RESULTS.md").write_text(f"# All\n\n<!-- x -->\nAt abc, 2026-01-01:\n\n{TABLE}\n\n<!-- end -->\n")
        options = ["--measured"] if kind == "measured" else []
        done = subprocess.run([bench / "reproduce", *options], capture_output=True, text=True)
        return done.returncode, done.stdout + done.stderr


def expect(code, words, what, printed, **more):
    global failures
    status, text = told(printed, **more)
    if status != code or words not in text:
        failures += 1
        print(f"{what}: exit {status} instead of {code}\n{text}")


expect(0, "as bench/RESULTS.md says", "the same", TABLE)
expect(0, "", "processor time of another machine", TABLE.replace("| 3 |", "| 9 |"))
expect(1, "a, minutes: 12.6, bench/RESULTS.md says 12.5", "another number", TABLE.replace("12.5", "12.6"))
expect(1, "b, minutes", "another sign", TABLE.replace("−0.4", "0.4"))
expect(1, "row", "another name", TABLE.replace("| a |", "| c |"))
expect(1, "Both make 3", "another sentence", TABLE.replace("2 parts", "3 parts"))
expect(1, "6 lines", "a line more", TABLE + "\nAnd more.")
expect(0, "", "a speed within its factor", TABLE.replace("12.5", "14"), kind="measured", within=1.2)
expect(1, "a, minutes", "a speed beyond it", TABLE.replace("12.5", "16"), kind="measured", within=1.2)
expect(2, "ended with 1", "a command that fails", TABLE, command="false")
expect(2, "has the blocks", "a block without a command", TABLE, name="y")
expect(2, "does not say", "a stamp of another commit", TABLE, commit="abd")
sys.exit(1 if failures else 0)
