"""examples/bare_main_loop.c on a Cortex-M7, and its memory."""
import subprocess

import board_output
from conftest import ROOT

FOLDER = ROOT / "build/arm-none-eabi-cortex-m7"


def test_the_bare_main_loop_stops_before_the_wall_on_a_cortex_m7():
    done = subprocess.run(["qemu-system-arm", "-machine", "mps2-an500", "-nographic", "-monitor",
                           "none", "-serial", "none", "-semihosting-config",
                           "enable=on,target=native", "-kernel", FOLDER / "bare_main_loop.elf"],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout
    board_output.check(done.stdout)


def test_the_bare_main_loop_needs_no_heap_and_no_formatted_output():
    subprocess.run([ROOT / "tools/dev/check_symbols.py", "--objdump", "arm-none-eabi-objdump",
                    "--image", FOLDER / "bare_main_loop.elf"], check=True)
