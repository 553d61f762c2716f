#!/usr/bin/env python3
"""A snapshot has the same bytes on another processor; each answers from both as from its own.

usage: tests/processors/check.py aarch64|s390x
Runs snapshot_bytes of the host and, in QEMU, of the other processor; `make processors` builds them.
Exit code 77 where one of them or QEMU is not there.
"""
import os
import shutil
import subprocess
import sys
import tempfile

HOST = ["build/host-release/snapshot_bytes"]
OTHERS = {
    "aarch64": ["qemu-aarch64", "build/aarch64-linux-gnu-armv8-a/snapshot_bytes"],
    "s390x": ["qemu-s390x", "build/s390x-linux-gnu-s390x/snapshot_bytes"],
}
SKIPPED = 77


def answers(program, verb, path):
    done = subprocess.run([*program, verb, path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(program)} {verb}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def content(path):
    with open(path, "rb") as file:
        return file.read()


def check(name, folder):
    other = OTHERS[name]
    host_path, other_path = os.path.join(folder, "host"), os.path.join(folder, name)
    host_answers = answers(HOST, "write", host_path)
    other_answers = answers(other, "write", other_path)
    for slot in ".0", ".1":
        if content(host_path + slot) != content(other_path + slot):
            sys.exit(f"slot {slot[1:]}: the snapshot of {name} has other bytes")
    if answers(HOST, "read", other_path) != host_answers:
        sys.exit(f"the host answers otherwise from the snapshot of {name}")
    if answers(other, "read", host_path) != other_answers:
        sys.exit(f"{name} answers otherwise from the host's snapshot")
    n_bytes = sum(len(content(host_path + slot)) for slot in (".0", ".1"))
    n_answers = len(host_answers.split()) // 3
    print(f"{n_bytes} bytes of two snapshots and {n_answers} answers are the same")


def main():
    if len(sys.argv) != 2 or sys.argv[1] not in OTHERS:
        sys.exit(f"usage: {sys.argv[0]} {'|'.join(OTHERS)}")
    name = sys.argv[1]
    for program in HOST[0], *OTHERS[name]:
        if shutil.which(program) is None and not os.access(program, os.X_OK):
            print(f"{program} is not there: `make processors` makes it where packages can be had")
            return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        check(name, folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
