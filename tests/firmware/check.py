#!/usr/bin/env python3
"""Checks of the Cortex-M image under QEMU, one per call.

usage: tests/firmware/check.py --list | --write-golden | NAME

Exit code 0: holds (its figures are printed), 77: cannot be checked here, else it does not hold.
The emulator has no timing: instruction counts are exact, cycles are estimated (cycles.py).
"""
import collections
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "tools", "dev"), os.path.join(ROOT, "tests", "firmware")]
import budget  # noqa: E402  (found only after the line above)
import cycles  # noqa: E402
import stack_report  # noqa: E402

M7 = "build/arm-none-eabi-cortex-m7"
M4 = "build/arm-none-eabi-cortex-m4"
PLUGIN = "build/host-release/libicount.so"
IMAGES = ("demo", "costs", "device", "mavlink")
# The PC's scalar path: one lane and fused multiply-adds, as on the target.
FUSED_QUERY = "build/host-fused/gpom-query"
POINTS = 1000
GOLDEN = "tests/firmware/golden.csv"
# Minutes there, and the same code on both: blanks are stars, as semihosting splits at them.
SLOW_TESTS = ("the*k*nearest*hits*", "searches*come*and*go*", "selection*in*slices*",
              "building*from*a*permuted*")
UNIT_TESTS_MIN = {"unit": 100, "codec": 50}
# What a figure may rise above the recorded one before it is noticed.
RISE_MAX = 1.03
# Registers that an interrupt pushes, those of the FPU included, Armv7-M ARM B1.5.6.
EXCEPTION_BYTES = 112
TIMEOUT_S = 300


class Failed(Exception):
    """What does not hold, as text for the reader."""


def output_of(command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Failed(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout


def symbol_addresses(image):
    rows = (line.split() for line in output_of(["arm-none-eabi-nm", image]).splitlines())
    return {row[2]: int(row[0], 16) for row in rows if len(row) == 3}


def run_image(folder, machine, image="demo", more=()):
    """Console output of an image; its exit code must be 0."""
    console = [] if "-semihosting-config" in more else ["-semihosting-config",
                                                        "enable=on,target=native"]
    path = f"{folder}/{image}.elf" if "tests" in image else f"{folder}/gpom_{image}.elf"
    command = ["qemu-system-arm", "-machine", machine, "-nographic", "-monitor", "none", "-serial",
               "none", *console, "-kernel", path, *more]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired as late:
        raise Failed(f"the image did not end within {TIMEOUT_S} s") from late
    if done.returncode != 0:
        raise Failed(f"exit code {done.returncode} (77 is a processor fault)\n{done.stdout}")
    return done.stdout


def check_unit_tests():
    """The tests have an operating system, of semihosting; the library is the device's. Two runs,
    as the heap there is small."""
    for folder, n_min in UNIT_TESTS_MIN.items():
        console = run_image(M7, "mps2-an500", "target_tests", [
            "-semihosting-config", "enable=on,target=native,arg=tests,"
            f"arg=--source-file=*{folder}*,arg=--test-case-exclude={',,'.join(SLOW_TESTS)}"])
        match = re.search(r"test cases: +(\d+) \| +(\d+) passed \| 0 failed", console)
        if not match or int(match[2]) < n_min or match[1] != match[2]:
            raise Failed(console[-2000:])
        print(f"{match[1]} test cases of tests/{folder} passed")


def count_instructions(profile=os.devnull):
    """List of (name, instructions, units) of the counted intervals. profile: a file to write."""
    markers = symbol_addresses(f"{M7}/gpom_costs.elf")
    with tempfile.NamedTemporaryFile("r") as counts:
        plugin = (f"{PLUGIN},begin={markers['gpom_count_begin'] & ~1:x},"
                  f"end={markers['gpom_count_end'] & ~1:x},out={counts.name},profile={profile}")
        console = run_image(M7, "mps2-an500", "costs", ["-plugin", plugin])
        numbers = [int(line) for line in open(counts.name, encoding="ascii")]
    labels = re.findall(r"^count (\S+) (\d+)$", console, re.MULTILINE)
    if not labels:
        raise Failed("the image printed no line 'count NAME N'")
    if len(labels) != len(numbers):
        raise Failed(f"{len(labels)} lines 'count NAME N' for {len(numbers)} counted intervals")
    return [(name, number, int(units)) for (name, units), number in zip(labels, numbers)]


def with_cycles():
    """count_instructions(), and the same list with estimated cycles in place of instructions."""
    with tempfile.NamedTemporaryFile("r") as profile:
        counted = count_instructions(profile.name)
        intervals = profile.read().split("\n\n")
    code = cycles.disassembly(f"{M7}/gpom_costs.elf", "arm-none-eabi-objdump")
    estimated = [(name, cycles.estimate(code, interval.splitlines()), units)
                 for (name, _, units), interval in zip(counted, intervals)]
    return counted, estimated


def costs_of(counted):
    """{metric: instructions} as tests/budget.csv names them."""
    intervals = collections.defaultdict(list)
    for name, instructions, units in counted:
        intervals[name].append((instructions, units))
    costs = {"insert mean": sum(n for n, _ in intervals["insert"]) / len(intervals["insert"]),
             "insert worst": max(n for n, _ in intervals["insert"]),
             "step worst": max(n for n, _ in intervals["step"]),
             "refresh": intervals["refresh"][0][0],
             "refresh plain": intervals["refresh_plain"][0][0],
             "build": max(n for n, _ in intervals["build"]),
             "mavlink sectors": intervals["mavlink_sectors"][0][0],
             "mavlink message": intervals["mavlink_message"][0][0],
             "align 180 returns": intervals["align"][0][0],
             "distances first": intervals["distances_first"][0][0],
             "distances update": intervals["distances_update"][0][0]}
    (n, units), = intervals["distance_query"]
    costs["distance query"] = n / units
    for each in "8+8", "16+16", "plain 8+8", "plain 16+16":
        (n, units), = intervals[f"query_{each.replace(' ', '_')}"]
        costs[f"query {each}"] = n / units
    for each in "8+8", "plain 8+8":
        (n, units), = intervals[f"gradient_{each.replace(' ', '_')}"]
        costs[f"gradient {each}"] = n / units
        (n, _), = intervals[f"fan_{each.replace(' ', '_')}"]
        costs[f"fan of 36 rays {each}"] = n
    return costs


def check_run_m7():
    run_image(M7, "mps2-an500")


def check_run_m4():
    run_image(M4, "mps2-an386")


def check_counts():
    first, estimated = with_cycles()
    if first != count_instructions():
        raise Failed("two runs differ")
    recorded = budget.limits("cortex-m7")
    late = []
    n_cycles = costs_of(estimated)
    for name, n in costs_of(first).items():
        before = recorded[f"instructions {name}"]
        print(f"{name}: {n:.0f} instructions, {100 * n / before - 100:+.1f} % of {before:.0f}; "
              f"about {n_cycles[name]:.0f} cycles by the model of tests/firmware/cycles.py")
        if n > RISE_MAX * before:
            late.append(name)
    if late:
        raise Failed(f"more than 3 % above tests/budget.csv: {', '.join(late)}")


def bits_of(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


def host_answers(query, folder):
    """Rows of mean, variance, probability by a build of gpom-query from the image's own inputs."""
    output_of([query, "--scans", "tests/firmware/scans.csv", "--params", "tools/params/street.toml",
               "--points", "tests/firmware/points.csv", "--out", f"{folder}/answers.csv"])
    with open(f"{folder}/answers.csv", encoding="ascii") as lines:
        return [[float(x) for x in line.split(",")[2:5]] for line in list(lines)[1:]]


def target_answers():
    """The same from the image, each number as its bits."""
    lines = re.findall(r"^answer (\d+) (\d+) (\d+)$", run_image(M7, "mps2-an500"), re.MULTILINE)
    return [[int(bits) for bits in line] for line in lines]


def compare_answers(expected, who):
    target = target_answers()
    n_equal = sum([bits_of(x) for x in row] == bits for row, bits in zip(expected, target))
    print(f"{n_equal} of {len(expected)} points agree with {who}, bit for bit in mean, variance "
          "and probability")
    if len(target) != POINTS or len(expected) != POINTS or n_equal != POINTS:
        raise Failed(f"{len(target)} answers from the image, {len(expected)} from {who}")


def check_answers():
    with tempfile.TemporaryDirectory() as folder:
        compare_answers(host_answers(FUSED_QUERY, folder), "the host's scalar path")


def check_golden():
    """A change that is meant writes the file anew (--write-golden), and says by how much."""
    with open(GOLDEN, encoding="ascii") as file:
        rows = [[float(x) for x in line.split(",")] for line in file if line[0] != "#"]
    compare_answers(rows, GOLDEN)


def write_golden():
    with open(GOLDEN, "w", encoding="ascii") as file:
        file.write("# mean, variance, probability at points.csv, of scans.csv with "
                   "tools/params/street.toml\n")
        for row in target_answers():
            values = [struct.unpack("<f", struct.pack("<I", bits))[0] for bits in row]
            file.write(",".join(f"{value:.9g}" for value in values) + "\n")


def check_cost_table():
    """Every public call has a bound in the table of ports/cortex_m/README.md, and no other does."""
    declared = set()
    for path in glob.glob("include/gpom/*.h"):
        with open(path, encoding="utf-8") as file:
            declared |= set(re.findall(r"GPOM_API[^;#]*?\b(gpom_\w+)\(", file.read()))
    with open("ports/cortex_m/README.md", encoding="utf-8") as file:
        table = file.read().partition("Bounds of every public call")[2].partition("\n---")[0]
    named = set(re.findall(r"`(gpom_\w+)`", table))
    print(f"{len(declared & named)} of {len(declared)} public calls have a bound")
    if named != declared:
        raise Failed(f"not there: {sorted(declared - named)}; unknown: {sorted(named - declared)}")


def check_size():
    for cpu in "cortex-m7", "cortex-m4":
        print(output_of(["tests/firmware/budget.py", cpu]))


def check_symbols(folder, *options):
    check = ["tools/dev/check_symbols.py", "--objdump", "arm-none-eabi-objdump", *options]
    for library in "libgpom.a", "libgpom_codec.a":
        output_of([*check, f"{folder}/{library}"])
    for library in "libgpom_device.a", "libgpom_mavlink.a":
        output_of([*check, "--port", f"{folder}/{library}"])
    for image in IMAGES:
        output_of([*check, "--image", f"{folder}/gpom_{image}.elf"])


def check_symbols_m7():
    check_symbols(M7)


def check_symbols_m4():
    check_symbols(M4, "--soft-double")


def stack_graph(sources="**"):
    return stack_report.CallGraph(glob.glob(f"{M7}/obj/{sources}/*.ci", recursive=True))


def check_stack(root):
    stack_bytes = symbol_addresses(f"{M7}/gpom_demo.elf")["STACK_BYTES"]
    line, faults = stack_report.report(stack_graph(), root, stack_bytes)
    print(line.strip())
    if faults:
        raise Failed("\n".join(faults))


def check_interrupts():
    """All other interrupts have one priority; the watchdog's comes on top of any."""
    graph = stack_graph()
    stack_bytes = symbol_addresses(f"{M7}/gpom_device.elf")["STACK_BYTES"]
    main, watchdog = (graph.worst(name)[0] for name in ("main", "nmi_entry"))
    entries = [name for name in graph.frames if name.endswith("_entry")
               and name not in ("reset_entry", "nmi_entry")]
    interrupt = max(graph.worst(name)[0] for name in entries)
    total = main + interrupt + watchdog + 2 * EXCEPTION_BYTES
    print(f"main {main} + interrupt {interrupt} + watchdog {watchdog} + {2 * EXCEPTION_BYTES} of "
          f"registers = {total} of {stack_bytes} bytes")
    if len(entries) < 3 or total > stack_bytes:
        raise Failed(f"interrupts found: {entries}; {total} bytes")


CHECKS = {
    "the image runs on a Cortex-M7 and ends with exit code 0": check_run_m7,
    "the image runs on a Cortex-M4F and ends with exit code 0": check_run_m4,
    "instruction counts repeat exactly and stay within those recorded": check_counts,
    "the Cortex-M7 answers 1000 points as the host's scalar path does, bit for bit": check_answers,
    "scans to map, the Cortex-M7 gives the golden file": check_golden,
    "kernels, Cholesky, trees, beams, codec: the unit tests pass on the Cortex-M7":
        check_unit_tests,
    "the table of costs bounds every public call": check_cost_table,
    "flash, RAM and bytes a beam stay in their budget": check_size,
    "main loop and interrupts fit the stack": check_interrupts,
    "no heap, printf, C++ runtime or software double on the M7": check_symbols_m7,
    "no heap, printf or C++ runtime on the M4F": check_symbols_m4,
}


def stack_checks():
    # Without a public function one case that fails, not a silent nothing.
    roots = stack_graph("src/*").roots() or ["gpom_*"]
    codec = [name for name in stack_graph("ports/codec").roots() if name.startswith("gpom_wire_")]
    device = stack_graph("ports/uart").roots()
    autopilot = stack_graph("ports/mavlink").roots()
    roots += [*(codec or ["gpom_wire_*"]), *(device or ["gpom_device_*"]),
              *(autopilot or ["gpom_mavlink_*"]), "main"]
    return {f"bounded stack of {root}": root for root in roots}


def main():
    os.chdir(ROOT)
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    name = sys.argv[1]
    if shutil.which("qemu-system-arm") is None:
        print("qemu-system-arm is not installed")
        return 77
    stacks = stack_checks()
    if name == "--write-golden":
        write_golden()
        return 0
    if name == "--list":
        print("\n".join([*CHECKS, *stacks]))
        return 0
    try:
        if name in stacks:
            check_stack(stacks[name])
        else:
            CHECKS[name]()
    except Failed as failed:
        print(failed)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
