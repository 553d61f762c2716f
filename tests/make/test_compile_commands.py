"""`make compile_commands.json` writes what the build really runs."""
import json
import pathlib
import shutil
import subprocess

import pytest
from fresh_machine import ENVIRONMENT

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("src", "ports", "tools", "bench")
# CMake compiles the package; a build of its own (VISITS=1) compiles what counts visits.
ELSEWHERE = (ROOT / "ports" / "python", ROOT / "bench" / "count_visits.cpp")
SAMPLES = ("src/map/", "src/gp/", "ports/codec/", "ports/host/", "bench/")


@pytest.fixture(scope="module", name="entries")
def fixture_entries():
    subprocess.run(["make", "--no-print-directory", "compile_commands.json"], cwd=ROOT, check=True,
                   env=ENVIRONMENT, capture_output=True)
    with open(ROOT / "build/compile_commands.json", encoding="utf-8") as file:
        return {entry["file"]: entry for entry in json.load(file)}


def test_every_source_has_one_entry(entries):
    sources = {str(path.relative_to(ROOT)) for folder in FOLDERS
               for kind in ("*.c", "*.cpp") for path in (ROOT / folder).rglob(kind)
               if not {path, *path.parents} & set(ELSEWHERE)}
    assert len(sources) > 50
    assert sources <= set(entries)
    assert all(entry["directory"] == str(ROOT) for entry in entries.values())


@pytest.mark.parametrize("folder", SAMPLES)
def test_the_command_of_an_entry_compiles_its_source(entries, folder, tmp_path):
    source = min(name for name in entries if name.startswith(folder))
    words = list(entries[source]["arguments"])
    words[words.index("-o") + 1] = str(tmp_path / "object.o")
    subprocess.run([*words, "-fsyntax-only"], cwd=ROOT, check=True)


def test_clang_tidy_reads_the_database(entries):
    """It finds the flags by itself: without them no header of the repository would be found."""
    if shutil.which("clang-tidy") is None:
        pytest.skip("no clang-tidy: `tools/setup lint` installs it")
    source = min(name for name in entries if name.startswith("ports/codec/"))
    done = subprocess.run(["clang-tidy", "--quiet", "-p", "build", source],
                          cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
