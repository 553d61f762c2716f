"""What examples/bare_main_loop.c does on the board of tests/firmware/board, on a PC or in QEMU."""
import re

WALL_MM, MARGIN_MM, CELL_MM = 4000, 750, 250


def check(output):
    """The robot drives up to the wall, is never told that the wall is free, and stops before it."""
    rows = [tuple(map(int, row)) for row in re.findall(r"^at (\d+) free (\d+)$", output, re.M)]
    assert len(rows) == 80 and "stopped" not in output, output
    assert all(at + free <= WALL_MM for at, free in rows)
    assert rows[0] == (0, 0), "nothing is known before the first scan"
    last_mm = rows[-1][0]
    assert rows[-2][0] == last_mm, "it stands at the end"
    assert WALL_MM - MARGIN_MM - 2 * CELL_MM <= last_mm <= WALL_MM - MARGIN_MM
