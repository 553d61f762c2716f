#!/usr/bin/env python3
"""Worst stack of each public function, from the call graphs of gcc -fcallgraph-info=su.

usage: stack_report.py [--limit BYTES] [--root NAME]... FILE.ci...

Roots are all functions gpom_* unless --root names them. The worst stack of a function is its own
frame plus the worst stack of the functions that it calls. Recursion, frames of run-time size,
indirect calls and functions without a known frame make this sum impossible. Each of them is a fault
(exit code 1), with three exceptions: the leaf functions of the C library and the compiler in LEAVES
count LEAF_BYTES, the indirect calls in INDIRECT have named targets, and the callbacks in CALLBACKS
do not count.
"""
import argparse
import re
import sys

# Leaf functions of newlib and libgcc for Armv7E-M. Their largest frame is 40 bytes. sqrtf and fmaf
# are one instruction there, and appear only where the compiler keeps the call because of errno.
LEAF_BYTES = 64
LEAVES = re.compile(r"mem(cpy|move|set|cmp)|sqrtf?|fmaf|__aeabi_\w+")

# Calls through constant tables: pattern of the calling function and of its possible targets.
INDIRECT = {
    r"^gpom_params_check$": r"\d+problem_of_\w+",
    r"^gpom_query_points$": r"\d+answer_pointsE",
    r"^gpom_query_raster$": r"\d+answer_rasterE",
    r"^gpom_(scratch|gradient)_bytes$|\d+check_scratchE": r"\d+scratch_bytes_forE",
    r"\d+answer_packetI.*AnswerArrays": r"\d+answer_foundI",
    r"^gpom_query_gradients$": r"\d+all_gradientsE",
    r"\d+(all_gradientsE|answer_packetI.*GradientOut)": r"\d+gradients_foundI",
    r"\d+answer_rasterE": r"\d+answer_foundI",
    r"gpom_ray_fan": r"\d+probe_pointsE",
    # Only where gpom_map_begin_late() is called.
    r"\d+keepER8gpom_map": r"\d+begin_lateER8gpom_map",
    # Hooks of gpom_mavlink_device_config_t and gpom_port_t.
    r"^gpom_mavlink_device_tick$": r"^ports/cortex_m/mps2\.c:now_us$|^mps2_write_uart1$",
    r"^gpom_device_\w+$|^ports/uart/\w+\.c:":
        r"^ports/(cortex_m|template)/\w+\.c:(now_us|bytes_read|bytes_write|watchdog_feed|"
        r"line_overruns|watchdog_resets)$",
}
# Functions that call a callback of the library's user. The stack of the callback is not known here.
CALLBACKS = re.compile(r"^gpom_snapshot_write_step$|\d+read_blockER15gpom_snapshot_t")
INDIRECT_NODE = "__indirect_call"

NODE = re.compile(r'^node: \{ title: "([^"]+)" label: "([^"]*)"')
EDGE = re.compile(r'^edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
FRAME = re.compile(r"\\n(\d+) bytes \((static|dynamic,bounded|dynamic)\)")


class CallGraph:
    def __init__(self, paths):
        self.frames = {}  # function: (bytes, kind)
        self.calls = {}   # function: set of functions
        self._worst = {}
        for path in paths:
            with open(path, encoding="utf-8") as lines:
                for line in lines:
                    self._add(line)

    def _add(self, line):
        if match := NODE.match(line):
            if frame := FRAME.search(match.group(2)):
                # An inline function can be in several objects: keep its largest frame.
                new = (int(frame.group(1)), frame.group(2))
                self.frames[match.group(1)] = max(new, self.frames.get(match.group(1), new))
        elif match := EDGE.match(line):
            self.calls.setdefault(match.group(1), set()).add(match.group(2))

    def roots(self):
        return sorted(name for name in self.frames if re.fullmatch(r"gpom_\w+", name))

    def callees(self, name):
        """(functions called by a function, faults)."""
        direct = self.calls.get(name, set())
        if INDIRECT_NODE not in direct:
            return sorted(direct), set()
        if CALLBACKS.search(name):
            return sorted(direct - {INDIRECT_NODE}), set()
        reach = [INDIRECT[caller] for caller in INDIRECT if re.search(caller, name)]
        if not reach:
            return sorted(direct - {INDIRECT_NODE}), {f"an indirect call, in {name}"}
        targets = {known for known in self.frames if re.search(reach[0], known)}
        faults = set() if targets else {f"no target for the indirect call in {name}"}
        return sorted(direct - {INDIRECT_NODE} | targets), faults

    def worst(self, name, above=()):
        """(bytes, deepest path, faults) of a function; `above` are its callers."""
        if name in above:
            return 0, [name], {f"recursion: {' > '.join(above[above.index(name):] + (name,))}"}
        if name in self._worst:
            return self._worst[name]
        if name not in self.frames:
            if LEAVES.fullmatch(name):
                return LEAF_BYTES, [name], set()
            return 0, [name], {f"unknown frame of '{name}', in {above[-1] if above else 'no file'}"}
        own, kind = self.frames[name]
        callees, faults = self.callees(name)
        if kind == "dynamic":
            faults.add(f"run-time frame size: {name}")
        deepest, path = 0, []
        for callee in callees:
            below, below_path, below_faults = self.worst(callee, above + (name,))
            faults |= below_faults
            if below > deepest:
                deepest, path = below, below_path
        self._worst[name] = own + deepest, [name] + path, faults
        return self._worst[name]


def report(graph, root, limit):
    """(line to print, list of faults) for one function."""
    total, path, faults = graph.worst(root)
    faults = sorted(faults)
    if limit is not None and total > limit:
        faults.append(f"{total} bytes of stack, more than {limit}")
    steps = " > ".join(f"{name}:{graph.frames.get(name, (LEAF_BYTES,))[0]}" for name in path)
    return f"{total:6d} {root}  ({steps})", [f"{root}: {fault}" for fault in faults]


def main():
    parser = argparse.ArgumentParser(description="Worst stack of each public function.")
    parser.add_argument("--limit", type=int, metavar="BYTES")
    parser.add_argument("--root", action="append", metavar="NAME")
    parser.add_argument("files", nargs="+", metavar="FILE.ci")
    args = parser.parse_args()
    graph = CallGraph(args.files)
    roots = args.root or graph.roots()
    faults = [] if roots else ["no public function gpom_* in these files"]
    for root in roots:
        line, new_faults = report(graph, root, args.limit)
        print(line)
        faults += new_faults
    for fault in faults:
        print(f"stack-report: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
