"""Every target works at its first call on a machine on which nothing is installed, with parallel
jobs: what tools/setup installs comes before what needs it."""
import functools
import re
import subprocess

import fresh_machine
import pytest
from fresh_machine import ROOT, FreshMachine

HOST, IMAGES, CROSS_TESTS = "host", "images", "64-bit Arm"
EXTRA_WORDS = {
    HOST: ("build/host-release/tsan_tests", "build/host-release/count-queries"),
    IMAGES: ("CROSS=arm-none-eabi-", "CPU=cortex-m7", "firmware-image",
             "build/arm-none-eabi-cortex-m7/target_tests.elf"),
    CROSS_TESTS: ("CROSS=aarch64-linux-gnu-", "CPU=armv8-a", "LANES=4", "FMA=0",
                  *(f"build/aarch64-linux-gnu-armv8-a/{name}"
                    for name in ("snapshot_bytes", "core_tests", "api_c99"))),
}
# What needs headers or commands of a group. The other groups bring nothing to a compiler: of them
# the first calls of all targets tell.
USERS = {"base": (HOST, IMAGES, CROSS_TESTS), "test": (HOST, IMAGES, CROSS_TESTS),
         "lcm": (HOST, IMAGES), "firmware": (HOST, IMAGES), "processors": (HOST, CROSS_TESTS),
         "bench": (HOST,), "fuzz": (HOST,), "lint": (HOST,), "docs": (HOST,)}
NOT_RUN = ("help", "clean", "distclean", "compile_commands.json")


@functools.cache
def public_targets():
    text = subprocess.run(["make", "--no-print-directory", "help"], cwd=ROOT, check=True,
                          env=fresh_machine.ENVIRONMENT, capture_output=True, text=True).stdout
    return re.findall(r"^  (\S+) ", text, re.MULTILINE)


@pytest.mark.parametrize("target", [name for name in public_targets() if name not in NOT_RUN])
def test_a_target_works_at_its_first_call(target, tmp_path):
    machine = FreshMachine(tmp_path, sleep_s=0.02)
    done = machine.make(target)
    assert machine.lines_of("faults") == []
    assert done.returncode == 0, done.stdout[-4000:]


@pytest.mark.parametrize("group", USERS)
def test_nothing_that_needs_a_group_starts_before_it_is_installed(group, tmp_path):
    """Installing the group fails: with -k make does all that does not wait for it. Whatever needs
    the group and does not wait is found, because it then fails for want of a header or command."""
    machine = FreshMachine(tmp_path, failing_group=group)
    targets = [name for name in public_targets() if name not in NOT_RUN]
    codes = [machine.make("-k", *EXTRA_WORDS[user], *(targets if user == HOST else ())).returncode
             for user in USERS[group]]
    assert machine.lines_of("faults") == []
    assert any(codes), "make does not notice that installing failed"


def test_headers_of_each_group_are_looked_for():
    """Were the list read wrongly, the other tests would find nothing."""
    needs = fresh_machine.needs_of_sources()
    assert set().union(*needs.values()) - {"generated"} == {"base", "test", "lcm", "bench"}
    assert set(fresh_machine.COMMANDS) <= set(USERS)
    assert "test" in needs["tests/common/main.cpp"]
    assert "bench" in needs["bench/speed.cpp"]
    assert {"lcm", "generated"} <= needs["tests/codec/test_messages.cpp"]
