#!/usr/bin/env python3
"""tools/mutants on a project of one small file, and the kept list of survivors: mutants_test.py SOURCE_DIR"""
import importlib.machinery
import importlib.util
import pathlib
import subprocess
import sys
import tempfile

source = pathlib.Path(sys.argv[1])
script = source / "tools/mutants"
failures = 0


def expect(true, what):
    global failures
    if not true:
        failures += 1
        print(what)


# ---- The places, by the functions themselves
loader = importlib.machinery.SourceFileLoader("mutants", str(script))
spec = importlib.util.spec_from_loader("mutants", loader)
mutants = importlib.util.module_from_spec(spec)
sys.dont_write_bytecode = True
loader.exec_module(mutants)


def changed(line, previous="{"):
    """What a line can become."""
    code = mutants.code_only(line)
    return {line[:start] + (new or f"!({line[start:end]})") + line[end:] for _, start, end, new in mutants.changes_of(code, previous)}


def expect_changes(line, *expected, previous="{"):
    expect(changed(line, previous) == set(expected), f"{line!r} becomes {sorted(changed(line, previous))}, not {sorted(expected)}")


expect_changes("    if (a < b && c) {", "    if (a <= b && c) {", "    if (a < b || c) {", "    if (!(a < b && c)) {")
expect_changes("    return x - .5;", "    return x + .5;", "    return x - 0.505;")
expect_changes("    return 1e-9 * n;", "    return 1e-06 * n;", "    return 1e-9 / n;")
expect_changes("    const int n = 0;", "    const int n = 1;")
expect_changes("    total += 1;", "    total -= 1;", "    total += 0;", "    ;")
expect_changes("    lay(out, a[3]);", "    lay(out, a[4]);", "    ;")
expect_changes("    lay(out);", previous="    const Line line =")
expect_changes("    bool open = true;  // 1 < 2", "    bool open = false;  // 1 < 2")
expect_changes('    note("a < b == 1", \'7\');', "    ;")
expect_changes("    std::vector<int>& rows(const T&& a, int* b);")
expect_changes("    bool operator < (Point other) const;")
for nothing in ("#if N > 1", "template <int N = 1>", "    static_assert(1 + 1 == 2);", "    void f(int a = 1) noexcept(true);",
                "    case 3:", "    rows.reserve(2 * n);", "    return rows1[i];"):
    expect_changes(nothing)
expect_changes("    parallel_for(context, rows(a), 64, [&](std::size_t i) {")
expect(mutants.code_only('a /* 1\n2 */ "3\\"4" R"(5\n6)" 1\'000 // 7') == "a     \n     xxxxxx xxxx\nxxx 1'000     ",
       "comments and texts are not blanked: " + repr(mutants.code_only('a /* 1\n2 */ "3\\"4" R"(5\n6)" 1\'000 // 7')))

# ---- A whole run: what a test holds is killed, what nothing looks at survives
root = pathlib.Path(tempfile.mkdtemp())
for folder in ("kernels", "tests/mutants", "engine", "io"):
    (root / folder).mkdir(parents=True)
(root / "kernels/area.h").write_text("#pragma once\nint area(int a, int b);\nint spare(int a);\ninline int twice(int a) { return a + a; }\n")
(root / "kernels/area.cpp").write_text("""#include "kernels/area.h"
int area(int a, int b) {
    return a * b;
}
int spare(int a) {
    return a - 7;
}
""")
(root / "tests/area_test.cpp").write_text("""#include <cstdio>
#include "kernels/area.h"
int none();
int main() {
    std::puts("[ RUN      ] Area.OfARectangle");
    const bool well = area(6, 3) == 18 && twice(3) == 6 && spare(none()) < 0;
    std::puts(well ? "[       OK ] Area.OfARectangle (0 ms)" : "[  FAILED  ] Area.OfARectangle (0 ms)");
    return well ? 0 : 1;
}
""")
(root / "tests/support.cpp").write_text("int none() { return 0; }\n")
(root / "CMakeLists.txt").write_text("""cmake_minimum_required(VERSION 3.25)
project(area LANGUAGES CXX)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
add_library(kernels STATIC kernels/area.cpp)
target_include_directories(kernels PUBLIC ${PROJECT_SOURCE_DIR})
add_library(support OBJECT tests/support.cpp)
add_executable(area_test tests/area_test.cpp)
target_link_libraries(area_test PRIVATE kernels support)
""")


def run(*options):
    done = subprocess.run([str(script), "--root", str(root), "--build", str(root / "build"), *options], capture_output=True, text=True)
    expect(done.returncode == 0, f"{options}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


for command in (["cmake", "-G", "Ninja", "-S", root, "-B", root / "build"], ["cmake", "--build", root / "build"]):
    made = subprocess.run(command, capture_output=True, text=True)
    expect(made.returncode == 0, made.stdout + made.stderr)
before = (root / "kernels/area.cpp").read_text()
listed = run("--list", "--seed", "3", "--count", "9")
expect(sorted(line.split("\t")[0] for line in listed.splitlines()) == ["kernels/area.cpp:3", "kernels/area.cpp:6", "kernels/area.h:4"],
       f"the places are\n{listed}")
expect(listed == run("--list", "--seed", "3", "--count", "9"), "a seed does not draw the same places")
out = run("--seed", "3", "--count", "9")
outcomes = {line.split("\t")[0]: line.split("\t")[3:5] for line in out.splitlines() if "\t" in line}
expect(outcomes.get("kernels/area.cpp:3") == ["killed", "area_test: Area.OfARectangle"], f"a change that a test notices\n{out}")
expect(outcomes.get("kernels/area.h:4") == ["killed", "area_test: Area.OfARectangle"], f"a change of a header\n{out}")
survivor = (root / "tests/mutants/survivors.tsv")
expect(out.rstrip().splitlines()[-1].startswith("killed "), f"no sum\n{out}")
expect((root / "kernels/area.cpp").read_text() == before, "the tree was changed")
# `a - 7` with 8 for 7 is negative still; `a + 7` is not. Whichever was drawn, its own line of the list says so.
again = run("--again", "--work", str(root / "again"))
survivor.write_text("place\tchange\tline\tverdict\nkernels/area.cpp:1\t7 to 8\treturn a - 7;\topen\n"
                    "kernels/area.cpp:9\t- to +\treturn a - 7;\topen\nkernels/area.cpp:3\t* to /\treturn a * b;\tequal: by decree\n")
again = run("--again", "--work", str(root / "again"))
expect("kernels/area.cpp:6\t7 to 8\treturn a - 7;\tsurvived\t1 tests: area_test" in again, f"a change that nothing looks at\n{again}")
expect("kernels/area.cpp:6\t- to +\treturn a - 7;\tkilled" in again, f"a listed change that a test notices\n{again}")
expect(again.rstrip().splitlines()[-1] == "killed 1 of 2 (50.0 %)", f"the sum of those again\n{again}")
# ---- A ledger: what was killed stands in it too, files that it names are passed over, verdicts of the list count
ledger = root / "ledger.tsv"
run("--seed", "3", "--count", "1", "--only", "kernels/area.h", "--ledger", str(ledger), "--work", str(root / "kept"))
expect(ledger.read_text().startswith("place\tchange\tline\toutcome\tby\nkernels/area.h:4\t"), f"the ledger\n{ledger.read_text()}")
fresh = run("--list", "--seed", "3", "--count", "9", "--new-files", "--ledger", str(ledger))
expect(fresh == "", f"files that the list or the ledger names are drawn from again\n{fresh}")
survivor.write_text("place\tchange\tline\tverdict\n")
fresh = run("--list", "--seed", "3", "--count", "9", "--new-files", "--ledger", str(ledger))
expect(fresh.count("\n") == 1 and fresh.startswith("kernels/area.cpp:"), f"one line in each new file\n{fresh}")
survivor.write_text("place\tchange\tline\tverdict\nio/b.cpp:1\t0 to 1\tb = 0;\tkilled by b_test: B.B\n"
                    "io/b.cpp:1\t1 to 0\tb = 1;\tequal: by decree\nio/b.cpp:1\t2 to 3\tb = 2;\topen: for now\n")
ledger.write_text("place\tchange\tline\toutcome\tby\n" + "".join(f"io/b.cpp:9\t{change}\tb = {change[0]};\tsurvived\t1 tests: b\n"
                                                                 for change in ("0 to 1", "1 to 0", "2 to 3", "2 to 3", "3 to 4"))
                  + "io/a.cpp:1\t0 to 1\ta = 0;\tkilled\tb_test: B.B\n")
told = run("--score", str(ledger))
expect("| io | 2 | 5 | 1 | 1 | 1 | 2 | 50.0 % |" in told and "| kernels | 0 | 0 |" in told, f"a ledger's score\n{told}")
ledger.write_text(ledger.read_text() + "io/a.cpp:1\t0 to 1\n")
bad = subprocess.run([str(script), "--root", str(root), "--score", str(ledger)], capture_output=True, text=True)
expect(bad.returncode == 2 and ":8 is no line" in bad.stderr, f"a line that is none: {bad.returncode} {bad.stderr}")

(root / "kernels/area.cpp").write_text(before + "int broken(\n")
broken = subprocess.run([str(script), "--root", str(root), "--build", str(root / "build")], capture_output=True, text=True)
expect(broken.returncode == 2 and "do not build" in broken.stderr, f"code that does not build: {broken.returncode} {broken.stderr}")

# ---- The kept list: each row is read, and has a verdict
kept = source / "tests/mutants/survivors.tsv"
for place, change, line, verdict in mutants.read_list(kept):
    file = place.rsplit(":", 1)[0]
    expect((source / file).exists(), f"{kept}: {file} is gone; strike its rows")
    expect(verdict.startswith(("equal: ", "killed by ", "open: ")) and len(verdict) > 12, f"{kept}: {place} has the verdict {verdict!r}")

# ---- Refusals that no test reaches: each is a line that still stands, with a reason
for row in (source / "tests/unreached_errors.tsv").read_text().splitlines()[1:]:
    file, line, why = row.split("\t")
    stands = any(text.strip() == line for text in (source / file).read_text().splitlines()) if (source / file).exists() else False
    expect(stands and len(why) > 12, f"tests/unreached_errors.tsv: {file}: {line}: the line is gone, or has no reason")

print(f"{failures} failed")
sys.exit(1 if failures else 0)
