"""gpom-params end to end: the same bits in TOML, C header and record; every bad file is named."""
import pathlib
import random
import re
import struct
import subprocess
import tomllib
import zlib

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRESETS = sorted((ROOT / "tools" / "params").glob("*.toml"))
KERNELS = ("nn", "matern12", "matern32", "se", "askey")
# Names in TOML that differ from those in C.
KEYS = {"n_hits": "hits", "n_free": "free", "n_fading": "fading"}
COMPILERS = {
    "C99": ["cc", "-std=c99", "-x", "c"],
    "C++11": ["c++", "-std=c++11", "-x", "c++"],
    "C++17": ["c++", "-std=c++17", "-x", "c++"],
    "C++20": ["c++", "-std=c++20", "-x", "c++"],
}
PRINT = """
#include "preset.h"
#include <stdio.h>
#include <string.h>
int main(void)
{
    uint32_t bits;
    unsigned size = (unsigned)gpom_params_preset.struct_bytes;
    printf("struct_bytes %%u\\n", size == sizeof(gpom_params_t) ? 1u : 0u);
%s    return 0;
}
"""


def fields():
    """(type, name) of every field of gpom_params_t, from its declaration."""
    text = (ROOT / "include/gpom/params.h").read_text()
    body = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    body = re.search(r"typedef struct \{(.*?)\} gpom_params_t;", body, re.DOTALL).group(1)
    return re.findall(r"(\w+) (\w+);", body)


def bits_of(value):
    return struct.unpack("<I", struct.pack("<f", value))[0]


def expected(toml_path):
    """{field: bits, or number of a count} that a TOML text means, by Python's own readers."""
    toml = tomllib.loads(toml_path.read_text(encoding="utf-8"))
    unused = {"s0": 60.0, "s1": 1.0} if toml["kernel"] != "nn" else {"ell_m": 11.0}
    values = {"struct_bytes": 1, "kernel": KERNELS.index(toml["kernel"]),
              "frame": ("query", "map").index(toml.get("frame", "query"))}
    for kind, name in fields():
        if name in values:
            continue
        absent = toml["sn2"] if name == "sn2_free" else unused.get(name, 0)
        value = toml.get(KEYS.get(name, name), absent)
        values[name] = bits_of(np.float32(value)) if kind == "float" else value
    return values


def printed(header, folder, language="C99"):
    """The same, printed by a program that the header is compiled into."""
    lines = ""
    for kind, name in fields():
        if kind == "float":
            lines += (f"    memcpy(&bits, &gpom_params_preset.{name}, sizeof bits);\n"
                      f"    printf(\"{name} %lu\\n\", (unsigned long)bits);\n")
        elif name != "struct_bytes":
            lines += f"    printf(\"{name} %d\\n\", (int)gpom_params_preset.{name});\n"
    (folder / "preset.h").write_bytes(header.read_bytes())
    (folder / "main.c").write_text(PRINT % lines)
    subprocess.run([*COMPILERS[language], "-pedantic-errors", "-Wall", "-Wextra", "-Werror",
                    f"-I{ROOT}/include", f"-I{folder}", folder / "main.c",
                    "-o", folder / "main"], check=True)
    output = subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout
    return {name: int(value) for name, value in map(str.split, output.splitlines())}


@pytest.fixture
def convert(run, tmp_path):
    """convert(path, kind, name): the written file."""
    def start(path, kind, name):
        done = run("gpom-params", path, "--to", kind, "--out", tmp_path / name, "--name", "preset"
                   ) if kind == "header" else run("gpom-params", path, "--to", kind, "--out",
                                                  tmp_path / name)
        assert done.returncode == 0, done.stderr
        return tmp_path / name
    return start


def random_toml(path, rng):
    """Parameters that the library takes, with bits that few digits do not hold."""
    kernel = rng.choice(KERNELS)
    number = {"sf2": rng.uniform(1, 3), "alpha": rng.uniform(1, 3), "beta": rng.uniform(-.1, .1),
              "sn2": rng.uniform(.1, .2), "sn2_free": rng.uniform(.1, .2),
              "sn2_once": rng.uniform(.3, .4), "gap_m": rng.uniform(0, 1),
              "depth_m": rng.uniform(0, 1), "vote": -rng.uniform(0, 1e-30), "line": -0.0,
              "fade_m": rng.uniform(10, 1e5), "beta_far": rng.uniform(-.1, .1),
              "anisotropy": rng.uniform(0, 1), "log_hit_first": 1e-42, "log_hit_last": -1e-9,
              "log_free_first": rng.uniform(-.01, .01), "log_free_last": -0.0,
              "p_free": rng.uniform(.1, .3), "p_occupied": rng.uniform(.7, .9)}
    number.update({"s0": rng.uniform(1, 1e3), "s1": rng.uniform(1e-5, 1)} if kernel == "nn"
                  else {"ell_m": rng.uniform(1, 900)})
    count = {"hits": rng.randint(5, 30), "free": rng.randint(5, 30), "fading": rng.randint(0, 4),
             "scan_points_max": rng.randint(0, 64)}
    lines = [f'kernel = "{kernel}"'] + [f"{key} = {value!r}" for key, value in number.items()]
    path.write_text("\n".join(lines + [f"{key} = {value}" for key, value in count.items()]))


# ---- the same bits -------------------------------------------------------------------------------

@pytest.mark.parametrize("language", COMPILERS)
@pytest.mark.parametrize("preset", PRESETS, ids=lambda path: path.stem)
def test_a_preset_compiled_as_a_header_has_the_bits_of_its_toml(convert, tmp_path, preset,
                                                                language):
    assert printed(convert(preset, "header", "p.h"), tmp_path, language) == expected(preset)


def test_every_way_round_gives_the_same_bits(convert, tmp_path):
    """Random parameters: TOML, header and record, each made of each other."""
    rng = random.Random(7)
    for i in range(20):
        random_toml(tmp_path / "a.toml", rng)
        toml = convert(tmp_path / "a.toml", "toml", "b.toml")
        header = convert(toml, "header", "c.h")
        record = convert(header, "record", "d.bin")
        if i < 5:
            assert printed(header, tmp_path) == expected(tmp_path / "a.toml")
        assert expected(toml) == expected(tmp_path / "a.toml")
        assert convert(tmp_path / "a.toml", "record", "e.bin").read_bytes() == record.read_bytes()
        assert expected(convert(record, "toml", "f.toml")) == expected(tmp_path / "a.toml")
        assert expected(convert(header, "toml", "g.toml")) == expected(tmp_path / "a.toml")
        assert (convert(record, "header", "h.h").read_bytes() ==
                convert(tmp_path / "f.toml", "header", "i.h").read_bytes())


def test_the_comment_goes_along(convert):
    """TOML to header to TOML: how the preset was learnt stays with it, and harms no C compiler."""
    street = ROOT / "tools/params/street.toml"
    back = convert(convert(street, "header", "p.h"), "toml", "p.toml")
    head = [line for line in street.read_text().splitlines() if line.startswith("#")]
    assert back.read_text().splitlines()[:len(head)] == head


def test_marks_of_comments_inside_a_comment_end_nothing(convert, tmp_path):
    text = (ROOT / "tools/params/street.toml").read_text()
    (tmp_path / "a.toml").write_text("# a */ b /* c **//\n" + text)
    header = convert(tmp_path / "a.toml", "header", "p.h")
    assert printed(header, tmp_path) == expected(tmp_path / "a.toml")


def test_a_new_field_of_the_library_is_neutral_in_an_old_header(convert, tmp_path):
    """The initialiser names fields, so that a struct with one more, anywhere, still compiles."""
    header = convert(PRESETS[0], "header", "p.h")
    folder = tmp_path / "gpom"
    folder.mkdir()
    for path in (ROOT / "include/gpom").iterdir():
        text = path.read_text().replace("    float s0; ", "    float brand_new;\n    float s0; ")
        (folder / path.name).write_text(text)
    (tmp_path / "main.c").write_text(
        '#include "p.h"\nint main(void) { return gpom_params_preset.brand_new == 0.0f ? 0 : 1; }')
    subprocess.run(["cc", "-std=c99", "-pedantic-errors", "-Wall", "-Werror", "-I", tmp_path,
                    tmp_path / "main.c", "-o", tmp_path / "main"], check=True)
    assert subprocess.run([tmp_path / "main"], check=False).returncode == 0


def test_a_header_by_hand_means_what_it_means_in_c(convert, tmp_path):
    """Any order, comments, doubles, hexadecimal; what is left out is 0, as in C."""
    source = tmp_path / "by_hand.txt"
    source.write_text("""#include <gpom/params.h>
// gpom_params_t other = {
const gpom_params_t gpom_params_preset /* here */ = {
    .struct_bytes = sizeof(gpom_params_t), .kernel = GPOM_KERNEL_SE, .s0 = 60.0f, .s1 = 1.0f,
    .n_hits = 8u, .n_free = 0x8, .p_free = 0.3, /* .p_free = 0.1, */ .p_occupied = 0.7f,
    .ell_m = 2, .sf2 = 0x1.8p1f, .sn2 = .1f, .sn2_free = 1e-1F, .alpha = 1.f
};
""")
    record = convert(source, "record", "p.bin")
    toml = convert(record, "toml", "p.toml")
    assert printed(source, tmp_path) == expected(toml)


def test_the_name_of_the_constant_is_that_of_the_file(run, tmp_path):
    text = PRESETS[0].read_text()
    (tmp_path / "my robot-2.toml").write_text(text)
    done = run("gpom-params", tmp_path / "my robot-2.toml", "--to", "header")
    assert "gpom_params_t gpom_params_my_robot_2 = {" in done.stdout
    done = run("gpom-params", tmp_path / "my robot-2.toml", "--to", "header", "--out",
               tmp_path / "van.h")
    assert "gpom_params_t gpom_params_van = {" in (tmp_path / "van.h").read_text()


# ---- in words ------------------------------------------------------------------------------------

@pytest.mark.parametrize("preset", PRESETS, ids=lambda path: path.stem)
def test_every_field_of_a_file_is_explained(run, preset):
    done = run("gpom-params", "--explain", preset)
    assert done.returncode == 0, done.stderr
    toml = tomllib.loads(preset.read_text())
    for name, value in toml.items():
        shown = re.search(rf"^{name} = (\S+)", done.stdout, re.MULTILINE)
        assert shown and (shown[1] == value or float(shown[1]) == pytest.approx(value)), name
    assert done.stdout.count("Neutral: ") == len(fields()) - 1 - (1 if "s1" in toml else 2)
    assert "prior probability" in done.stdout and "Free is a place" in done.stdout


# ---- bad files -----------------------------------------------------------------------------------

def changed(text, key, value):
    return re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)


@pytest.mark.parametrize("key, value, complaint", [
    ("sf2", "1e9", "sf2: must be from 1e-6 to 1e6 (here sf2 = 1e+09)"),
    ("sf2", "nan", "sf2: must be from 1e-6 to 1e6 (here sf2 = nan)"),
    ("hits", "900", "hits: must be a whole number from 0 to 512 (here 900)"),
    ("hits", "60", "hits, free: together at most 64; more needs kernel askey, of compact support "
                   "(here hits = 60, free = 8, kernel = nn)"),
    ("kernel", '"cubic"', 'kernel: "cubic" is not one of nn'),
    ("depth_m", "7", "depth_m: must be from 0 to 5 (here depth_m = 7)"),
    ("p_free", "0.9", "p_free, p_occupied: must satisfy 0 < p_free < p_occupied < 1 (here p_free "
                      "= 0.9, p_occupied = 0.7)"),
])
def test_check_names_file_line_field_value_and_bound(run, tmp_path, key, value, complaint):
    text = changed((ROOT / "tools/params/street.toml").read_text(), key, value)
    path = tmp_path / "bad.toml"
    path.write_text(text)
    n_line = text[:text.index(f"\n{key} = ")].count("\n") + 2
    done = run("gpom-params", "--check", PRESETS[0], path, PRESETS[1])
    assert done.returncode == 2
    assert done.stderr.startswith(f"gpom-params: {path}:{n_line}: {complaint}")
    assert done.stderr.count("\n") == 1 and done.stdout.count(": good\n") == 2


@pytest.mark.parametrize("old, new, complaint", [
    (".sf2 = 1", ".sf3 = 1", "sf3: unknown field; did you mean sf2?"),
    (".s0 = 1", ".sf2 = 1", "sf2: given twice"),
    (".sf2 = 1.90329f", "1.90329f", "expected `.field = value`"),
    (".sf2 = 1.90329f", ".sf2 = WEIGHT", "sf2: 'WEIGHT' is not a number"),
    (".sf2 = 1.90329f", ".sf2 = 1e9f", "sf2: must be from 1e-6 to 1e6 (here sf2 = 1e+09)"),
    (".sf2 = 1.90329f,", ".sf2 = ,", "sf2: has no value"),
    (".n_hits = 8", ".n_hits = -8", "n_hits: '-8' is not a whole number from 0 to 65535"),
    ("GPOM_KERNEL_NN", "GPOM_KERNEL_N", "kernel: 'GPOM_KERNEL_N' is not one of GPOM_KERNEL_NN"),
])
def test_a_bad_header_is_named_with_its_line(run, convert, tmp_path, old, new, complaint):
    header = convert(ROOT / "tools/params/street.toml", "header", "p.h")
    text = header.read_text().replace(old, new, 1)
    assert text != header.read_text()
    (tmp_path / "bad.h").write_text(text)
    done = run("gpom-params", "--check", tmp_path / "bad.h")
    assert done.returncode == 2 and complaint in done.stderr
    assert re.match(rf"gpom-params: {tmp_path}/bad.h:\d+: ", done.stderr)


def test_a_damaged_or_cut_record_is_refused(run, convert, tmp_path):
    """Each byte changed, each length shorter: none is read as parameters."""
    record = convert(PRESETS[0], "record", "p.bin").read_bytes()
    bad = [record[:n] for n in range(0, len(record), 7)]
    bad += [record[:i] + bytes([record[i] ^ 1]) + record[i + 1:] for i in range(0, 108, 5)]
    bad.append(record + b"\0")
    paths = []
    for i, content in enumerate(bad):
        paths.append(tmp_path / f"bad{i}")
        paths[-1].write_bytes(content)
    done = run("gpom-params", "--check", *paths)
    assert done.returncode == 2
    assert done.stderr.count("\n") == len(bad) and done.stdout == ""


def test_a_record_of_the_version_before_is_read(run, tmp_path):
    """Version 3 knew no n_fading, beta_far and line: 0."""
    body = struct.pack("<4sHBB3H20f", b"GPMP", 3, 1, 0, 8, 8, 0, 2, 60, 1, 5, .1, .1, 2, 0, .1, .7,
                       .3, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    (tmp_path / "old").write_bytes(body + struct.pack("<I", zlib.crc32(body)))
    done = run("gpom-params", tmp_path / "old", "--to", "toml")
    assert done.returncode == 0, done.stderr
    assert tomllib.loads(done.stdout)["ell_m"] == 5 and "line" not in done.stdout


@pytest.mark.parametrize("arguments, complaint", [
    ([], "FILE is required"),
    (["a.toml"], "say what to do: --to toml, header or record, --check or --explain"),
    (["missing.toml", "--check"], "missing.toml: cannot open"),
    ([".", "--check"], ".: is a directory"),
    (["empty", "--check"], "empty: is empty"),
    (["a.toml", "--chekc"], "did you mean --check?"),
    (["a.toml", "--to", "yaml"], "yaml not in {toml,header,record}"),
    (["a.toml", "a.toml", "--explain"], "one file at a time"),
    (["a.toml", "--to", "toml", "--name", "x"], "--name: with --to header alone"),
    (["a.toml", "--to", "header", "--name", "x y"], "--name: 'x y' has characters"),
    (["a.toml", "--to", "header", "--out", "no/p.h"], "no/p.h: cannot write"),
    (["bytes", "--check"], "bytes: is neither text nor a record"),
    (["plain.c", "--check"], "plain.c: holds no parameters"),
    (["two.h", "--check"], "holds two sets of parameters"),
])
def test_bad_arguments_are_one_line(tool, tmp_path, arguments, complaint):
    (tmp_path / "empty").touch()
    (tmp_path / "a.toml").write_text(PRESETS[0].read_text())
    (tmp_path / "bytes").write_bytes(b"\x7fELF\0\0")
    (tmp_path / "plain.c").write_text("#include <stdio.h>\nint main(void) { return 0; }\n")
    (tmp_path / "two.h").write_text("gpom_params_t a = {.s0 = 1}, x;\ngpom_params_t b = {.s0 = 1};")
    done = subprocess.run([tool("gpom-params"), *arguments], cwd=tmp_path, capture_output=True,
                          text=True, check=False, timeout=60)
    assert done.returncode == 2 and complaint in done.stderr, done.stderr
    assert done.stderr.startswith("gpom-params: ") and done.stderr.count("\n") == 1
    assert not (tmp_path / "p.h").exists()
