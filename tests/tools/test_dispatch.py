"""The library's hot path for SSE2, AVX2 and AVX-512: kept apart, and of one opinion."""
import csv
import platform
import re
import shutil
import subprocess

import pytest

INSTRUCTION_SETS = {f"{calls}_{name}.o": f"gpom_{name}"
                    for calls in ("answer", "gradient") for name in ("avx2", "avx512")}
# AVX and later encode with the VEX and EVEX prefixes: mnemonics in v..., or the wide registers.
AVX = re.compile(r"^\s+[0-9a-f]+:\s+(v\w+\s|.*%[yz]mm)", re.MULTILINE)
PROCESSORS = ["qemu64", "Nehalem", "Haswell"]
PARAMS = "tests/golden/params_{}_query.toml"


@pytest.fixture(scope="module")
def members(tool):
    """{object: text of `objdump OPTION`} of the library, if it chooses at run time."""
    archive = tool("libgpom.a")

    def read(option):
        text = subprocess.run(["objdump", option, "--no-show-raw-insn", archive],
                              capture_output=True, text=True, check=True).stdout
        parts = re.split(r"^(\S+\.o): +file format.*$", text, flags=re.MULTILINE)
        found = dict(zip(parts[1::2], parts[2::2]))
        if "answer_avx2.o" not in found:
            pytest.skip("the library was built for one width (LANES=n, or not x86-64)")
        return found
    return read


def test_no_object_but_its_own_holds_avx(members):
    with_avx = {name for name, text in members("-d").items() if AVX.search(text)}
    assert with_avx == set(INSTRUCTION_SETS)


def test_zmm_registers_only_for_avx512(members):
    with_zmm = {name for name, text in members("-d").items() if "%zmm" in text}
    assert with_zmm == {"answer_avx512.o", "gradient_avx512.o"}


def test_every_symbol_of_an_instruction_set_is_in_its_namespace(members):
    """An inline function shared with other objects might be the one that the linker keeps."""
    for name, namespace in INSTRUCTION_SETS.items():
        text = members("-t")[name]
        defined = re.findall(r"^[0-9a-f]+ (?:[gwu]| +w).*\.text\S*\s+[0-9a-f]+ "
                             r"(?:\.hidden )?(\S+)$", text, re.MULTILINE)
        assert defined
        assert [symbol for symbol in defined if namespace not in symbol] == []


def answers(command, folder, kernel):
    points = folder / "points.csv"
    if not points.exists():
        with open("tests/golden/points.csv", encoding="ascii") as source:
            points.write_text(source.read(), encoding="ascii")
    out = folder / "answers.csv"
    subprocess.run([*command, "--scans", "tests/golden/scans.csv", "--params",
                    PARAMS.format(kernel), "--points", points, "--out", out],
                   check=True, capture_output=True)
    with open(out, encoding="ascii") as file:
        return [[float(x) for x in row[2:5]] for row in list(csv.reader(file))[1:]]


@pytest.mark.parametrize("kernel", ["nn", "matern12", "matern32", "se", "askey"])
@pytest.mark.parametrize("processor", PROCESSORS)
def test_a_lesser_processor_gives_the_same_answers(tool, tmp_path, processor, kernel):
    """qemu64 and Nehalem have no AVX: one instruction of it would end the run."""
    if platform.machine() != "x86_64":
        pytest.skip("not an x86-64 machine")
    if shutil.which("qemu-x86_64") is None:
        pytest.skip("qemu-x86_64 is not installed (Debian: qemu-user)")
    program = str(tool("gpom-query"))
    here = answers([program], tmp_path, kernel)
    there = answers(["qemu-x86_64", "-cpu", processor, program], tmp_path, kernel)
    assert here and len(here) == len(there)
    worst = max(abs(a - b) for row, other in zip(here, there) for a, b in zip(row, other))
    assert worst <= 1e-4
