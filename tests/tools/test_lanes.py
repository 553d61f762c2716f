"""What a map keeps does not depend on how many queries the library computes side by side."""
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LANES = (1, 4, 8, 16)
# A program may be called from make, whose own variables would change what is built.
ENVIRONMENT = {name: value for name, value in os.environ.items()
               if not name.startswith(("MAKE", "MFLAGS"))}


def checked(*command):
    done = subprocess.run([str(part) for part in command], cwd=ROOT, env=ENVIRONMENT, text=True,
                          capture_output=True, timeout=600, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """{lanes: program}: one object file, linked with a library of each width."""
    folder = tmp_path_factory.mktemp("lanes")
    checked("cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-Iinclude", "-c",
            "tests/tools/kept_beams.c", "-o", folder / "kept_beams.o")
    made = {}
    for lanes in LANES:
        library = f"build/host-lanes{lanes}/libgpom.a"
        checked("make", "CROSS=", "CONFIG=debug", f"BUILD=build/host-lanes{lanes}",
                f"LANES={lanes}", library)
        made[lanes] = folder / f"kept_beams_{lanes}"
        checked("cc", folder / "kept_beams.o", library, "-lldl", "-lamd", "-lm", "-o", made[lanes])
    return made


@pytest.mark.parametrize("depth_m", [0, 1.5])
@pytest.mark.campaign
@pytest.mark.parametrize("beam_max", [200, 5000])
def test_every_lane_width_keeps_the_same_beams_bit_for_bit(programs, beam_max, depth_m):
    kept = {lanes: checked(program, beam_max, depth_m) for lanes, program in programs.items()}
    first = kept[LANES[0]]
    n_beams = len(re.findall("^slot", first, re.MULTILINE))
    assert 100 < n_beams <= beam_max
    counters = first[first.index("\nhit "):]
    counts = {name: int(n) for name, n in re.findall(r"([a-z_]+) (\d+)", counters)}
    causes = ["hit", "no_return", "known", "contradicting", "not_confirmed", "hits_cleared"]
    assert all(counts[name] > 0 for name in causes), counts
    for cause in ("redundant", "far", "old", "contradicted"):
        assert (counts[f"evicted_{cause}"] > 0) == (beam_max == 200), counts
    for lanes in LANES[1:]:
        assert kept[lanes] == first, f"{lanes} lanes and {LANES[0]} differ"
