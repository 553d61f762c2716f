#!/usr/bin/env python3
"""Fail on symbols that the fixed-memory library, or an image with it, must not have.

usage: check_symbols.py [--objdump PROGRAM] [--soft-double] [--sparse] [--port] libgpom.a
       check_symbols.py [--objdump PROGRAM] [--soft-double] --image IMAGE.elf
       check_symbols.py [--objdump PROGRAM] --exports libgpom.so

Library: every symbol that its objects need from outside must be in ALLOWED. The objects must hold
no static constructor and no writable data. Image: no symbol in BANNED may be linked. Shared
library: it must export at least one function gpom_* and no other symbols.
--sparse also allows the functions of SuiteSparse that the sparse solve calls.
--port also allows functions gpom_* of the libraries below a port.
--soft-double also allows double arithmetic in software (Cortex-M4F: poses are double).
"""
import argparse
import re
import subprocess
import sys

MEMORY = {"memcpy", "memmove", "memset", "memcmp"}
LIBM = {"sqrt", "sqrtf", "fmaf"}
COMPILER = {"_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail", "__cpu_model", "__cpu_features2"}
ARM_INTEGER = {"__aeabi_" + name for name in
               ("idiv uidiv idivmod uidivmod ldivmod uldivmod lmul llsl llsr lasr "
                "l2f ul2f f2lz f2ulz l2d ul2d d2lz d2ulz").split()}
ARM_DOUBLE = {"__aeabi_" + name for name in
              ("dadd dsub drsub dmul ddiv dcmpeq dcmplt dcmple dcmpge dcmpgt dcmpun cdcmple "
               "cdcmpeq cdrcmple d2f f2d d2iz d2uiz i2d ui2d").split()}
SUITESPARSE = {"amd_2", "ldl_symbolic", "ldl_numeric", "ldl_lsolve"}  # none of them allocates
ALLOWED = MEMORY | LIBM | COMPILER | ARM_INTEGER

BANNED = {
    "heap": r"(malloc|calloc|realloc|free|_malloc_r|_free_r|_sbrk|_sbrk_r|_Zn[wa][jm].*|_Zd[la].*)",
    "formatted output": r"(_?v?(f|s|sn)?i?printf(_r|_float|_i)?|_dtoa_r|puts|putchar)",
    "C++ runtime": r"(__cxa_.*|__gxx_.*|_Unwind_.*|__dso_handle)",
}


# address, 7 flag characters, section, size, [visibility], name
SYMBOL = re.compile(r"^[0-9a-f]{8,16} (.{7}) (\S+)\t([0-9a-f]+) +(?:\.\w+ +|0x\w+ +)*(\S+)$")
EXPORT = re.compile(r"^[0-9a-f]{8,16} [gw].{6} \.\w+\t\S+ +(?:\S+ +)?(\S+)$", re.MULTILINE)


def objdump(program, option, path):
    done = subprocess.run([program, option, path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"check-symbols: {done.stderr.strip()}")
    return done.stdout


def symbols(program, path):
    """Rows (object, section, size, name, is_local_section_symbol) of `objdump -t`."""
    member = path
    for line in objdump(program, "-t", path).splitlines():
        if ":     file format" in line:
            member = line.split(":")[0]
            continue
        if match := SYMBOL.match(line):
            flags, section, size, name = match.groups()
            yield member, section, int(size, 16), name, "d" in flags


def sections(program, path):
    """Rows (object, section, size) of `objdump -h`."""
    member = path
    for line in objdump(program, "-h", path).splitlines():
        if ":     file format" in line:
            member = line.split(":")[0]
            continue
        match = re.match(r"^ +\d+ (\S+) +([0-9a-f]+) ", line)
        if match:
            yield member, match.group(1), int(match.group(2), 16)


def is_writable(section):
    return re.match(r"\.(data|bss|tdata|tbss)(\.|$)", section) is not None and \
        not section.startswith(".data.rel.ro")


def library_faults(program, path, allowed, is_port):
    rows = list(symbols(program, path))
    if not rows:
        yield f"{path}: holds no objects"
    defined = {name for _, section, _, name, _ in rows if section != "*UND*"}
    for member, section, size, name, is_debug in rows:
        is_known = name in defined or name in allowed or (is_port and name.startswith("gpom_"))
        if section == "*UND*" and not is_known:
            yield f"{path}({member}): needs '{name}', which is not on the list of allowed symbols"
        if section == "*COM*" or (is_writable(section) and size > 0 and not is_debug):
            yield f"{path}({member}): '{name}' is writable global data ({section}, {size} bytes)"
    for member, section, size in sections(program, path):
        if re.match(r"\.(preinit_array|init_array|ctors)", section) and size > 0:
            yield f"{path}({member}): section {section}: a static constructor"


def image_faults(program, path, soft_double):
    for _, _, _, name, _ in symbols(program, path):
        for what, pattern in BANNED.items():
            if re.fullmatch(pattern, name):
                yield f"{path}: '{name}' was linked ({what})"
        if name in ARM_DOUBLE and not soft_double:
            yield f"{path}: '{name}' was linked (double arithmetic in software)"


def export_faults(program, path):
    exported = EXPORT.findall(objdump(program, "-T", path))
    if not exported:
        yield f"{path}: exports nothing; public functions need default visibility"
    for name in exported:
        if not name.startswith("gpom_"):
            yield f"{path}: exports '{name}', which is not a function of the public API"


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n\n")[0])
    parser.add_argument("--objdump", default="objdump")
    parser.add_argument("--soft-double", action="store_true")
    parser.add_argument("--sparse", action="store_true")
    parser.add_argument("--port", action="store_true")
    parser.add_argument("--image", action="store_true")
    parser.add_argument("--exports", action="store_true")
    parser.add_argument("path")
    args = parser.parse_args()
    if args.image:
        faults = list(image_faults(args.objdump, args.path, args.soft_double))
    elif args.exports:
        faults = list(export_faults(args.objdump, args.path))
    else:
        allowed = ALLOWED | (ARM_DOUBLE if args.soft_double else set()) | \
            (SUITESPARSE if args.sparse else set())
        faults = list(library_faults(args.objdump, args.path, allowed, args.port))
    for fault in faults:
        print(f"check-symbols: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
