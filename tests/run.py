#!/usr/bin/env python3
"""Run test suites and end with one line `N passed, N failed, N skipped`.

usage: tests/run.py [--summary FILE.json] SUITE...

Suites: unit codec c99 headers symbols linux mavlink unit-sanitize codec-sanitize tools make
unit-campaign tools-campaign linux-campaign tools-sanitize linux-sanitize tsan processors can
firmware install python docs instructions visits fuzz lint; `base` is the first eleven, `extra` the
rest.
Called by make, which builds what they need first. A failure is printed with its output, a skip with
its reason. Exit code 1 if anything failed or nothing passed.
Environment: SEED fixes the random tests (they read GPOM_SEED), EXEC goes before the unit test
program (valgrind, say; not before the one with sanitizers, which would not bear it). FUZZ_RUNS is
the number of inputs each fuzzer tries, from its fixed seed; FUZZ_SECONDS, if given, makes it run so
long instead, from the tests' seed.
"""
import argparse
import glob
import json
import os
import re
import secrets
import shlex
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RESULTS = "build/test-results"
SKIP_EXIT_CODE = 77
TIMEOUT_S = 3600  # a whole suite on a slow machine; its tests have shorter ones
# What a change breaks first runs first. What takes long is a campaign, which `extra` runs: pytest's
# mark, and doctest's suites. "sanitized campaign" is one for the sanitizers alone, with which
# arithmetic takes up to twenty times as long; without them the same tests belong to `base`.
BASE = ["unit", "codec", "c99", "headers", "symbols", "linux", "mavlink", "unit-sanitize",
        "codec-sanitize", "tools", "make"]
EXTRA = ["unit-campaign", "tools-campaign", "linux-campaign", "tools-sanitize", "linux-sanitize",
         "tsan", "processors", "can", "firmware", "install", "python",
         "docs", "instructions", "visits", "fuzz", "lint"]
BASE_JOBS = 2  # suites of `base` side by side: the daemon's tests mostly wait
FUZZ_SEED = 1
FUZZ_RUNS = 100_000

HOST = "build/host-release"
SANITIZE = "build/host-sanitize"
THREAD = "build/host-thread"
ARM64 = "build/aarch64-linux-gnu-armv8-a"
HEADER_CHECKS = {
    "C99": "cc -std=c99 -pedantic-errors -Wall -Wextra -Werror -x c",
    "C++17": "c++ -std=c++17 -pedantic-errors -Wall -Wextra -Werror -x c++",
}


class Results:
    def __init__(self):
        self.passed = self.failed = self.skipped = 0

    def ok(self):
        self.passed += 1

    def fail(self, name, output):
        self.failed += 1
        print(f"FAILED  {name}\n{indented(output)}")

    def skip(self, name, reason):
        self.skipped += 1
        print(f"skipped {name}: {reason}")

    def add(self, other):
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped

    def line(self):
        return f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped"


def indented(text):
    return "\n".join("        " + line for line in text.rstrip().splitlines())


def run(command, timeout_s=TIMEOUT_S):
    """(exit code, output) of a command; a hang is a failure."""
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired as late:
        output = (late.stdout or b"").decode(errors="replace")
        return 1, output + f"\nstopped after {timeout_s} s"
    except OSError as error:
        return 1, str(error)
    return done.returncode, done.stdout.decode(errors="replace")


def run_junit(results, suite, command, report):
    """Run a program that writes JUnit results; count its test cases."""
    os.makedirs(RESULTS, exist_ok=True)
    if os.path.exists(report):
        os.remove(report)
    count_junit(results, suite, *run(command), report)


def count_junit(results, suite, code, output, report):
    """Count the test cases of a program's results."""
    try:
        cases = list(ElementTree.parse(report).iter("testcase"))
    except (OSError, ElementTree.ParseError):
        results.fail(suite, f"exit code {code}, no results written\n{output}")
        return
    failed_before = results.failed
    for case in cases:
        count_case(results, suite, case)
    if not cases:
        results.fail(suite, f"exit code {code}, no test case ran\n{output}")
    elif code != 0 and results.failed == failed_before:
        results.fail(suite, f"exit code {code} though no test case failed\n{output}")


def count_case(results, suite, case):
    name = f"{suite}: {case.get('name')}"
    faults = case.findall("failure") + case.findall("error")
    skipped = case.find("skipped")
    if faults:
        results.fail(name, "\n".join(f"{fault.get('message') or ''}\n{fault.text or ''}"
                                     for fault in faults))
    elif skipped is not None:
        results.skip(name, skipped.get("message") or "no reason given")
    else:
        results.ok()


def run_check(results, name, command, show=False):
    """Run a command as one test case: exit code 0 passes, 77 skips, all else fails."""
    code, output = run(command)
    if code == 0:
        results.ok()
        if show:
            print(f"ok      {name}\n{indented(output)}" if output.strip() else f"ok      {name}")
    elif code == SKIP_EXIT_CODE:
        lines = output.strip().splitlines()
        results.skip(name, lines[-1] if lines else "no reason given")
    else:
        results.fail(name, f"exit code {code}: {shlex.join(command)}\n{output}")


def run_doctest(results, suite, program, before="", choice=()):
    report = f"{RESULTS}/{suite}.xml"
    command = [program, "--reporters=junit", f"--out={report}", *choice]
    run_junit(results, suite, shlex.split(before) + command, report)


def run_unit(results):
    run_doctest(results, "unit", f"{HOST}/unit_tests", os.environ.get("EXEC", ""),
                ["--test-suite-exclude=campaign"])


def run_unit_sanitize(results):
    run_doctest(results, "unit-sanitize", f"{SANITIZE}/unit_tests",
                choice=["--test-suite-exclude=*campaign"])


def run_unit_campaign(results):
    run_doctest(results, "unit-campaign", f"{HOST}/unit_tests", choice=["--test-suite=campaign"])
    run_doctest(results, "unit-campaign-sanitize", f"{SANITIZE}/unit_tests",
                choice=["--test-suite=*campaign"])


def run_tools(results):
    run_doctest(results, "tools-unit", f"{HOST}/tool_tests", os.environ.get("EXEC", ""))
    run_pytest(results, "tools", "tests/tools", mark="not campaign")


def run_c99(results):
    run_check(results, "c99: a C99 program needs no C++ runtime and runs", [f"{HOST}/api_c99"])
    run_check(results, "c99: the template's unit test, a device with a virtual clock",
              [f"{HOST}/template_test"])
    run_check(results, "c99: the same with sanitizers", [f"{SANITIZE}/template_test"])


def run_headers(results):
    headers = sorted(glob.glob("include/gpom/*.h"))
    if not headers:
        results.fail("headers", "include/gpom holds no header")
    for header in [*headers, *sorted(glob.glob("ports/codec/*.h")),
                   *sorted(glob.glob("ports/mavlink/*.h")),
                   *sorted(glob.glob("ports/can/**/*.h", recursive=True))]:
        for language, compiler in HEADER_CHECKS.items():
            run_check(results, f"headers: {header} compiles alone as {language}",
                      compiler.split() + ["-fsyntax-only", "-Iinclude", "-I.", "-include", header,
                                          "/dev/null"])
    run_check(results, "headers: README's example compiles as C99",
              HEADER_CHECKS["C99"].split() + ["-fsyntax-only", "-Iinclude", readme_example()])


def readme_example():
    """Path of a file with the C block of README.md."""
    with open("README.md", encoding="utf-8") as readme:
        block = re.search(r"```c\n(.*?)```", readme.read(), re.DOTALL)
    os.makedirs(RESULTS, exist_ok=True)
    path = f"{RESULTS}/readme_example.c"
    with open(path, "w", encoding="utf-8") as file:
        file.write(block.group(1) if block else "#error no C block in README.md")
    return path


def run_symbols(results):
    run_check(results, "symbols: the library has no heap, libc or global state",
              ["tools/dev/check_symbols.py", "--sparse", f"{HOST}/libgpom.a"])
    run_check(results, "symbols: the codec has no heap, libc or global state",
              ["tools/dev/check_symbols.py", f"{HOST}/libgpom_codec.a"])
    run_check(results, "symbols: MAVLink's part has no heap, libc or global state",
              ["tools/dev/check_symbols.py", "--port", f"{HOST}/libgpom_mavlink.a"])
    run_check(results, "symbols: the shared library exports gpom_* and nothing else",
              ["tools/dev/check_symbols.py", "--exports", f"{HOST}/libgpom.so"])


def run_pytest(results, suite, paths, before=(), mark=""):
    report = f"{RESULTS}/{suite}.xml"
    run_junit(results, suite, [*before, *pytest_words(paths), "-m", mark, f"--junitxml={report}"],
              report)


def pytest_words(paths):
    return ["build/venv/bin/python", "-m", "pytest", "-q", "-p", "no:cacheprovider", *paths.split()]


def as_root():
    """Root of a user namespace of its own may give each test a network of its own."""
    words = ["unshare", "-r"]
    return words if os.getuid() != 0 and run([*words, "true"])[0] == 0 else []


def run_linux(results):
    run_doctest(results, "linux-unit", f"{HOST}/linux_tests")
    run_pytest(results, "linux", "tests/linux", as_root(), "not campaign")


def run_linux_sanitize(results):
    """The daemon alone is built with ASan and UBSan; what they find is its exit code."""
    run_doctest(results, "linux-unit-sanitize", f"{SANITIZE}/linux_tests")
    run_pytest(results, "linux-sanitize", "tests/linux/test_gpomd.py tests/linux/test_datagrams.py "
               "tests/linux/test_mavlink.py",
               [*as_root(), "env", f"GPOMD={SANITIZE}/gpomd"])


def run_can(results):
    """Frames here; gpomd on vcan where this kernel has it, else in a guest whose kernel does."""
    run_doctest(results, "can-unit", f"{HOST}/can_tests")
    run_doctest(results, "can-unit-sanitize", f"{SANITIZE}/can_tests")
    run_pytest(results, "can", "tests/can")
    has_vcan = run(["unshare", "-n", "ip", "link", "add", "vcan0", "type", "vcan"])[0] == 0
    if has_vcan:
        run_pytest(results, "can_bus", "tests/can_bus")
        return
    work = f"{RESULTS}/can-guest"
    environment = [f"{name}={os.environ[name]}" for name in ("GPOM_SEED", "GPOM_BUILD")
                   if name in os.environ]
    command = ["tests/can/guest.py", work, "env", *environment, *pytest_words("tests/can_bus"),
               "--junitxml=/mnt/shared/bus.xml"]
    code, output = run(command)
    if code == SKIP_EXIT_CODE:
        results.skip("can: gpomd on a CAN bus", output.strip().splitlines()[-1])
    else:
        count_junit(results, "can-bus", code, output, f"{work}/bus.xml")


def run_mavlink(results):
    run_doctest(results, "mavlink-unit", f"{HOST}/mavlink_tests")
    run_doctest(results, "mavlink-unit-sanitize", f"{SANITIZE}/mavlink_tests")
    run_pytest(results, "mavlink", "tests/mavlink")


def run_tsan(results):
    run_check(results, "tsan: copies beside the mapping thread are ordered and whole",
              [f"{THREAD}/tsan_tests"], show=True)
    run_pytest(results, "tsan-gpomd", "tests/linux/test_threads.py",
               [*as_root(), "env", f"GPOMD={THREAD}/gpomd"])


def run_processors(results):
    """Those that are not this machine's, in QEMU."""
    for name, title in ("s390x", "a big-endian processor"), ("aarch64", "64-bit Arm"):
        run_check(results, f"processors: snapshots have the same bytes on {title}",
                  ["tests/processors/check.py", name], show=True)
    if not (os.path.exists(f"{ARM64}/core_tests") and shutil.which("qemu-aarch64")):
        results.skip("unit-aarch64", "no cross compiler or QEMU: `make processors` gets them")
        return
    run_check(results, "processors: a C99 program runs on 64-bit Arm",
              ["qemu-aarch64", f"{ARM64}/api_c99"])
    run_doctest(results, "unit-aarch64", f"{ARM64}/core_tests", "qemu-aarch64")


def run_firmware(results):
    code, names = run(["tests/firmware/check.py", "--list"])
    if code != 0:
        results.fail("firmware", names)
        return
    for name in names.splitlines():
        run_check(results, f"firmware: {name}", ["tests/firmware/check.py", name], show=True)
    run_pytest(results, "firmware", "tests/firmware")


def fuzz_targets(results):
    """(name, command) of every fuzzer: for each message type, receiver, serial, CAN."""
    code, types = run(["env", "FUZZ_TYPE=list", "build/host-fuzz/fuzz_messages"])
    if code != 0:
        results.fail("fuzz: list of types", types)
        return
    for name in types.split():
        yield name, ["env", f"FUZZ_TYPE={name}", "build/host-fuzz/fuzz_messages"]
    yield "receiver", ["build/host-fuzz/fuzz_receiver"]
    yield "frame", ["build/host-fuzz/fuzz_frame"]
    yield "can", ["build/host-fuzz/fuzz_can"]


def run_fuzz(results):
    seconds = int(os.environ.get("FUZZ_SECONDS") or 0)
    limits = ([f"-max_total_time={seconds}", f"-seed={os.environ['GPOM_SEED']}"] if seconds else
              [f"-runs={os.environ.get('FUZZ_RUNS') or FUZZ_RUNS}", f"-seed={FUZZ_SEED}"])
    os.makedirs(RESULTS, exist_ok=True)
    for name, command in fuzz_targets(results):
        code, output = run([*command, *limits, "-max_len=2048", "-len_control=0",
                            f"-artifact_prefix={RESULTS}/fuzz-{name}-"], seconds + TIMEOUT_S)
        if code == 0:
            results.ok()
            print(f"ok      fuzz: {name}: {output.strip().splitlines()[-1]}")
        else:
            results.fail(f"fuzz: {name}", f"exit code {code}\n{output[-4000:]}")


def run_instructions(results):
    run_check(results, "instructions: no query costs 3 % more than recorded",
              ["tests/instructions.py"], show=True)


def run_visits(results):
    run_check(results, "visits: no search of a dense map visits 3 % more than recorded",
              ["tests/visits.py"], show=True)


def run_lint(results):
    for what in "format", "rules", "tidy":
        run_check(results, f"lint: {what}", ["tools/dev/lint.py", what])


SUITES = {
    "unit": run_unit,
    "unit-sanitize": run_unit_sanitize,
    "mavlink": run_mavlink,
    "unit-campaign": run_unit_campaign,
    "codec": lambda results: run_doctest(results, "codec", f"{HOST}/codec_tests",
                                         os.environ.get("EXEC", "")),
    "codec-sanitize": lambda results: run_doctest(results, "codec-sanitize",
                                                  f"{SANITIZE}/codec_tests"),
    "c99": run_c99,
    "make": lambda results: run_pytest(results, "make", "tests/make"),
    "headers": run_headers,
    "symbols": run_symbols,
    "tools": run_tools,
    "tools-sanitize": lambda results: run_doctest(results, "tools-sanitize",
                                                  f"{SANITIZE}/tool_tests"),
    "tools-campaign": lambda results: run_pytest(results, "tools-campaign", "tests/tools",
                                                 mark="campaign"),
    "linux": run_linux,
    "linux-campaign": lambda results: run_pytest(results, "linux-campaign", "tests/linux",
                                                 as_root(), "campaign"),
    "linux-sanitize": run_linux_sanitize,
    "tsan": run_tsan,
    "can": run_can,
    "processors": run_processors,
    "firmware": run_firmware,
    "install": lambda results: run_pytest(results, "install", "tests/install"),
    "python": lambda results: run_pytest(results, "python", "tests/python"),
    "docs": lambda results: run_pytest(results, "docs", "tests/docs"),
    "instructions": run_instructions,
    "visits": run_visits,
    "fuzz": run_fuzz,
    "lint": run_lint,
}


def choose_seed():
    """The seed of all random tests; SEED= in the environment replays a run."""
    seed = os.environ.get("SEED") or str(secrets.randbelow(2**31))
    if not re.fullmatch(r"\d+", seed):
        sys.exit(f"tests/run.py: SEED={seed} is not a number; give a whole number >= 0")
    os.environ["GPOM_SEED"] = seed
    print(f"seed {seed} (replay with SEED={seed})")


def run_suite(name):
    results = Results()
    begin_s = time.monotonic()
    SUITES[name](results)
    print(f"{name:<14} {results.line()}, {time.monotonic() - begin_s:.0f} s", flush=True)
    return results


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0])
    parser.add_argument("--summary", metavar="FILE.json")
    parser.add_argument("suites", nargs="+", metavar="SUITE", choices=[*SUITES, "base", "extra"])
    args = parser.parse_args()
    os.chdir(ROOT)
    choose_seed()
    results = Results()
    for choice in args.suites:
        jobs = BASE_JOBS if choice == "base" else 1
        with ThreadPoolExecutor(jobs) as pool:
            suites = {"base": BASE, "extra": EXTRA}.get(choice, [choice])
            for of_suite in pool.map(run_suite, suites):
                results.add(of_suite)
    if args.summary:
        with open(args.summary, "w", encoding="utf-8") as file:
            json.dump(vars(results), file)
    print(results.line())
    return 1 if results.failed > 0 or results.passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
