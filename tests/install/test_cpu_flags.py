"""Processors that the Makefile does not know by name: CROSS= and CPU_FLAGS= are enough."""
import os
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CORTEX_M33 = "-mcpu=cortex-m33 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16"


def make(*words):
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    return subprocess.run(["make", "-C", ROOT, *words], capture_output=True, text=True,
                          timeout=600, check=False, env=environment)


@pytest.mark.skipif(shutil.which("arm-none-eabi-g++") is None, reason="no Arm cross compiler")
def test_a_cortex_m33_has_a_whole_library_for_firmware(tmp_path):
    """Built by flags alone; for that processor; no heap, libc or global state."""
    done = make("CROSS=arm-none-eabi-", f"CPU_FLAGS={CORTEX_M33}", f"BUILD={tmp_path}", "lib",
                "codec")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not (tmp_path / "libgpom.so").exists()
    for name in "libgpom.a", "libgpom_codec.a":
        subprocess.run([ROOT / "tools/dev/check_symbols.py", "--objdump", "arm-none-eabi-objdump",
                        "--soft-double", tmp_path / name], check=True)
    attributes = subprocess.run(["arm-none-eabi-readelf", "-A", tmp_path / "libgpom.a"],
                                capture_output=True, text=True, check=True).stdout
    assert "Tag_CPU_arch: v8-M.mainline" in attributes and "Tag_FP_arch: FPv5" in attributes


@pytest.mark.parametrize("words, is_bare", [
    (["CROSS=arm-none-eabi-"], True),
    (["CROSS=/opt/arm/bin/arm-none-eabi-"], True),
    (["CROSS=riscv32-unknown-elf-"], True),
    (["CROSS=arm-linux-gnueabihf-"], False),
    (["CROSS=some-vendor-", "BARE=1"], True),
    (["CROSS=arm-none-eabi-", "BARE=0"], False),
])
def test_the_name_of_the_compiler_tells_whether_there_is_an_operating_system(words, is_bare):
    """Without one there is one lane and no shared library; BARE=0 and BARE=1 say it outright."""
    done = make("-n", "V=1", "CPU_FLAGS=-O2", *words, "lib")
    assert done.returncode == 0, done.stderr
    assert (".so" not in done.stdout and "-DGPOM_LANES=1 " in done.stdout) == is_bare
    assert "build//" not in done.stdout


def test_an_unknown_name_without_flags_says_what_to_give():
    done = make("CROSS=arm-none-eabi-", "CPU=cortex-m33", "lib")
    assert done.returncode == 2 and "CPU=cortex-m33 is unknown" in done.stderr
    assert 'by its flags: CPU_FLAGS="-mcpu=..."' in done.stderr
