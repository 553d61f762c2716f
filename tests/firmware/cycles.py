"""Estimate of the cycles that counted instructions take on a Cortex-M7. A model, not a measurement.

The model issues instructions in order, at most two in a cycle. It knows which of them may be issued
together, when their results are ready, and how often each ran (profile of icount_plugin.c). It has
no caches and no wait states: code and data are taken to be in tightly coupled memory. Arm publishes
no latencies of this processor; those below are rounded from the literature and may be wrong by some
cycles each.
"""
import re
import subprocess

READY_AFTER = {"vdiv": 16, "vsqrt": 14, "vfma": 5, "vfms": 5, "vfnm": 5, "vmla": 5, "vmul": 3,
               "vnmul": 3, "vadd": 3, "vsub": 3, "vcmp": 2, "vmrs": 1, "ldr": 2, "ldm": 2,
               "pop": 2, "vldr": 2, "vldm": 2, "mul": 2, "mla": 2, "umul": 2, "smul": 2, "sdiv": 8,
               "udiv": 8}
MISPREDICTED = 7  # cycles lost
BRANCH = re.compile(r"^(b|bl|blx|bx|cbz|cbnz|tbb|tbh|b(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)|"
                    r"b(hs|lo))(\.[nw])?$")
REGISTER = re.compile(r"\b(r1[0-2]|r[0-9]|sl|fp|ip|sp|lr|pc|s[0-9]+|d[0-9]+)\b")
RANGE = re.compile(r"\b([rsd])(\d+)-[rsd](\d+)\b")
NO_RESULT = ("str", "vstr", "stm", "vstm", "push", "vpush", "cmp", "cmn", "tst", "teq", "vcmp",
             "nop")
SETS_FLAGS = ("cmp", "cmn", "tst", "teq", "vmrs")


class Instruction:
    """What the model knows of one instruction: its kind, and the registers it reads and writes."""

    def __init__(self, text):
        name, _, operands = text.partition("\t")
        operands = RANGE.sub(lambda m: ", ".join(f"{m[1]}{i}" for i in range(int(m[2]),
                                                                             int(m[3]) + 1)),
                             operands.split("@")[0])
        stem = name.split(".")[0]
        self.is_branch = bool(BRANCH.match(name)) or "pc" in operands and stem in ("pop", "ldm",
                                                                                  "ldmia")
        self.is_conditional = self.is_branch and (stem.startswith("cb") or stem[:1] == "b" and stem
                                                  not in ("b", "bl", "blx", "bx"))
        self.is_memory = stem.startswith(("ldr", "str", "ldm", "stm", "vld", "vst", "push", "pop",
                                          "vpush", "vpop"))
        self.is_float = stem.startswith("v") and not self.is_memory
        registers = REGISTER.findall(operands)
        many = "{" in operands
        self.n_cycles = max(1, (len(registers) - 1 + 1) // 2) if many and self.is_memory else 1
        stem_writes = not stem.startswith(NO_RESULT) and not self.is_branch
        listed = REGISTER.findall(operands.partition("{")[2]) if many else registers[:1]
        self.writes = set(listed if stem_writes else [])
        self.reads = set(registers) if not stem_writes else set(registers) - set(registers[:1])
        if stem.startswith(("vfm", "vfn", "vml")):
            self.reads |= self.writes
        if stem.startswith(SETS_FLAGS) or (stem.endswith("s") and len(stem) in (4, 5)
                                           and not self.is_float and not self.is_branch):
            self.writes.add("flags")
        if self.is_conditional and not stem.startswith("cb") or stem[:2] == "it":
            self.reads.add("flags")
        if stem == "vmrs":
            self.reads.add("fpscr")
        if stem.startswith("vcmp"):
            self.writes.add("fpscr")
        self.ready_after = next((n for key, n in READY_AFTER.items() if stem.startswith(key)), 1)
        self.is_long = stem.startswith(("vdiv", "vsqrt"))


def cycles_of_run(run):
    """Cycles of a run of instructions without a branch inside, if it follows itself in a loop."""
    ready = {}
    cycle, long_until = 0, 0
    ends = []
    for _ in range(2):
        slot = []  # what is issued in this cycle already
        for one in run:
            at = max([cycle, *(ready.get(name, 0) for name in one.reads)])
            if one.is_long:
                at = max(at, long_until)
                long_until = at + one.ready_after
            pairs = at == cycle and len(slot) < 2 and not (
                one.is_memory and any(other.is_memory for other in slot)) and not (
                one.is_float and any(other.is_float for other in slot))
            if not pairs:
                at = max(at, cycle + (slot[-1].n_cycles if slot else 0))
                slot = []
            cycle = at
            slot.append(one)
            for name in one.writes:
                ready[name] = cycle + one.ready_after
        cycle += slot[-1].n_cycles if slot else 0
        ends.append(cycle)
    return ends[1] - ends[0]


def disassembly(image, objdump):
    """{address: instruction} of an image."""
    text = subprocess.run([objdump, "-d", "--no-show-raw-insn", image], capture_output=True,
                          text=True, check=True).stdout
    lines = re.findall(r"^\s*([0-9a-f]+):\t(\S.*)$", text, re.MULTILINE)
    return {int(address, 16): Instruction(line) for address, line in lines}


def estimate(code, profile):
    """Cycles of one interval. profile: lines "ADDRESS EXECUTED TAKEN" of icount_plugin.c."""
    rows = [(int(a, 16), int(n), int(taken)) for a, n, taken in map(str.split, profile)]
    runs, cycles = {}, 0
    run, last_n = [], 0
    for address, n, taken in rows:
        one = code[address]
        if run and n != last_n:
            runs[tuple(run)] = last_n
            run = []
        run.append(address)
        last_n = n
        if one.is_branch:
            runs[tuple(run)] = n
            run = []
        if one.is_conditional:
            cycles += MISPREDICTED * min(taken, n - taken)
    if run:
        runs[tuple(run)] = last_n
    for addresses, n in runs.items():
        cycles += n * cycles_of_run([code[address] for address in addresses])
    return cycles
