#!/usr/bin/env python3
"""Sizes of the firmware images against tests/budget.csv; part of the build.

usage: tests/firmware/budget.py CPU

Prints each figure with its limit. Exit code 1, and what the largest parts are, if one is above it.
"""
import collections
import csv
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PREFIX = "arm-none-eabi-"
RAM_START = 0x20000000
# A section of flash in the linker's map: name, perhaps on a line alone, address, size, file.
SECTION = re.compile(r"^ \.(?:text|rodata|data)[\w.$*-]*\s+0x([0-9a-f]+)\s+0x([0-9a-f]+) (\S+)$",
                     re.MULTILINE)
LIBRARY_PART = re.compile(r"libgpom\.a\((\w+)\.o\)$")
RUNTIME = re.compile(r"lib(gcc|c_nano|m)\.a\(")
# Objects of which no byte may be in the device's image, because it calls nothing of them.
UNCALLED = ["sectors", "distances", "distance_field", "distance_query"]
# What GPOM_MAP_BYTES() counts besides the beams.
FIXED_BYTES = 3136


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def limits(target):
    """{metric: limit} of a target."""
    with open(os.path.join(ROOT, "tests", "budget.csv"), encoding="ascii", newline="") as file:
        return {row["metric"]: float(row["limit"]) for row in csv.DictReader(file)
                if row["target"] == target}


def flash_parts(map_path):
    """Bytes in flash by object of the library; "runtime" for libgcc and libc."""
    with open(map_path, encoding="utf-8") as file:
        text = file.read().partition("Linker script and memory map")[2]
    parts = collections.Counter()
    for address, size, file in SECTION.findall(text):
        if 0 < int(address, 16) < RAM_START:
            if match := LIBRARY_PART.search(file):
                parts[match[1]] += int(size, 16)
            elif RUNTIME.search(file):
                parts["runtime"] += int(size, 16)
    return parts


def symbols(image):
    """{name: (address, bytes)}"""
    rows = (line.split() for line in output_of(f"{PREFIX}nm", "-S", image).splitlines())
    return {row[3]: (int(row[0], 16), int(row[1], 16)) for row in rows if len(row) == 4}


def sections(image):
    """Bytes of text, data and bss."""
    rows = output_of(f"{PREFIX}size", image).splitlines()
    return tuple(map(int, rows[1].split()[:3]))


def mavlink_bytes(map_path):
    """Bytes in flash of MAVLink's own objects."""
    with open(map_path, encoding="utf-8") as file:
        text = file.read().partition("Linker script and memory map")[2]
    return sum(int(size, 16) for address, size, file in SECTION.findall(text)
               if 0 < int(address, 16) < RAM_START and "libgpom_mavlink.a(" in file)


def object_bytes(folder, *names):
    """Bytes of text of objects of the core, whether an image has them or not."""
    return sum(sections(f"{folder}/obj/src/{name}.o")[0] for name in names)


def figures(folder, beam_max):
    """{metric: bytes} of the device image, and the parts of its core."""
    text, data, bss = sections(f"{folder}/gpom_device.elf")
    with_mavlink = sections(f"{folder}/gpom_mavlink.elf")
    parts = flash_parts(f"{folder}/gpom_device.map")
    map_bytes = symbols(f"{folder}/gpom_demo.elf")["map_memory"][1]
    core = {name: n for name, n in parts.items() if name != "runtime"}
    return {"image text": text, "image data": data, "image bss with stack": bss,
            "core text": sum(core.values()), "core text with libgcc and libc": sum(parts.values()),
            "bytes a beam": round((map_bytes - FIXED_BYTES) / beam_max, 2),
            "image text with mavlink": with_mavlink[0],
            "image bss with stack and mavlink": with_mavlink[2],
            "mavlink text": mavlink_bytes(f"{folder}/gpom_mavlink.map"),
            "sectors text": object_bytes(folder, "plan/sectors"),
            "distances text": object_bytes(folder, "plan/distances", "plan/distance_field"),
            "distance query text": object_bytes(folder, "plan/distance_query"),
            "uncalled text": sum(core.get(name, 0) for name in UNCALLED)}, core


def beam_max():
    path = os.path.join(ROOT, "ports", "cortex_m", "device_limits.h")
    with open(path, encoding="ascii") as file:
        return int(re.search(r"#define DEVICE_BEAM_MAX (\d+)", file.read())[1])


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    cpu = sys.argv[1]
    found, core = figures(os.path.join(ROOT, "build", f"{PREFIX}{cpu}"), beam_max())
    wanted = limits(cpu)
    is_over = False
    for metric, n in found.items():
        if metric not in wanted:
            sys.exit(f"budget: tests/budget.csv has no line {cpu},{metric}")
        change = n - wanted[metric]
        is_over = is_over or change > 0
        print(f"  {cpu} {metric}: {n:g} of {wanted[metric]:g}, "
              f"{'OVER by' if change > 0 else 'room'} {abs(change):g}")
    if is_over:
        print("  core text by part:", ", ".join(f"{name} {n}" for name, n in
                                               collections.Counter(core).most_common()))
    return 1 if is_over else 0


if __name__ == "__main__":
    sys.exit(main())
