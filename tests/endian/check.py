#!/usr/bin/env python3
"""A snapshot has the same bytes on a big-endian processor, and each reads the other's.

usage: tests/endian/check.py
Runs snapshot_bytes of the host and, in QEMU, of s390x, which `make endian` builds. Exit code 77
where one of them or QEMU is not there.
"""
import os
import shutil
import subprocess
import sys
import tempfile

HOST = ["build/host-release/snapshot_bytes"]
BIG_ENDIAN = ["qemu-s390x", "build/s390x-linux-gnu-s390x/snapshot_bytes"]
SKIPPED = 77


def answers(program, verb, path):
    done = subprocess.run([*program, verb, path], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(program)} {verb}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def content(path):
    with open(path, "rb") as file:
        return file.read()


def check(folder):
    host_path, big_path = os.path.join(folder, "host"), os.path.join(folder, "big")
    host_answers = answers(HOST, "write", host_path)
    big_answers = answers(BIG_ENDIAN, "write", big_path)
    for slot in ".0", ".1":
        if content(host_path + slot) != content(big_path + slot):
            sys.exit(f"slot {slot[1:]}: the big-endian snapshot has other bytes")
    if answers(HOST, "read", big_path) != host_answers:
        sys.exit("the host answers otherwise from the big-endian snapshot")
    if answers(BIG_ENDIAN, "read", host_path) != big_answers:
        sys.exit("the big-endian processor answers otherwise from the host's snapshot")
    n_bytes = sum(len(content(host_path + slot)) for slot in (".0", ".1"))
    n_answers = len(host_answers.split()) // 3
    print(f"{n_bytes} bytes of two snapshots and {n_answers} answers are the same")


def main():
    for program in HOST[0], *BIG_ENDIAN:
        if shutil.which(program) is None and not os.access(program, os.X_OK):
            print(f"{program} is not there: `make endian` makes it where packages can be had")
            return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        check(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
