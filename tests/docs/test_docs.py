"""The documentation: it builds without a warning, it is complete, and its commands run."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["README.md", *sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("docs/**/*.md")
                              if path.name != "README.md")]
TIMEOUT_S = 900
FENCED = re.compile(r"^```(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?<=\n\n)(?: {4}.*\n)+")
COMMAND = re.compile(r" {4}(make|cc|c\+\+|build/\S+|tools/\S+) ")

# Commands that are not run, by how they begin, and why.
NOT_RUN = {
    "make demo ": "takes some minutes; tests/tools run its programs",
    "make demo LOG=": "needs a recorded log",
    "make test ": "these are the tests themselves",
    "make demo-firmware": "takes over a minute; tests/firmware run the same image",
    "make install PREFIX=/usr/local": "writes there; tests/install install elsewhere",
    "make install CROSS=aarch64": "builds all again for another processor: over a minute",
    "tools/setup base": "needs the network",
    "pip install .": "into the reader's Python; tests/python install in clean environments",
    "sudo ip": "needs root; this test has a network of its own",
}

# A network of its own, in which LCM's messages stay.
NETWORK = "ip link set lo up && ip route add 224.0.0.0/4 dev lo"


def blocks_of(text):
    """Shell blocks: fenced and marked so, or indented and beginning with a command."""
    found = [(match.start(), match.group(2)) for match in FENCED.finditer(text)
             if match.group(1) in ("sh", "shell", "bash")]
    rest = FENCED.sub(lambda match: re.sub(r"[^\n]", "~", match.group(0)), text)
    found += [(match.start(), re.sub(r"^ {4}", "", match.group(0), flags=re.MULTILINE))
              for match in INDENTED.finditer(rest) if COMMAND.match(match.group(0))]
    return [block for _, block in sorted(found)]


def reason_not_run(command):
    """Why a command is not run; None: it is. Compared with a blank at its end."""
    return next((why for begin, why in NOT_RUN.items() if (command + " ").startswith(begin)), None)


def script_of(page):
    """The commands of a page that are run, one below the other."""
    text = "\n".join(blocks_of((ROOT / page).read_text(encoding="utf-8")))
    commands = re.sub(r"\\\n\s*", "", text).split("\n")
    return "\n".join("" if reason_not_run(line.strip()) else line for line in commands).strip()


def user_folder(folder):
    """The repository as a user sees it; what commands write beside it stays in the folder."""
    for path in ROOT.iterdir():
        if path.name != ".git":
            (folder / path.name).symlink_to(path)
    return folder


def write_program(folder):
    """README's example, called from a main() that a reader would write."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    example = re.search(r"```c\n(.*?)```", text, re.DOTALL).group(1)
    call = ("int main(void)\n{\n    const float ranges_m[] = {5.0f, 5.0f};\n"
            "    gpom_answer_t answer;\n    return ask(ranges_m, 2, &answer) != GPOM_OK;\n}\n")
    (folder / "program.c").write_text(example + call, encoding="utf-8")


def write_drive(folder):
    """A recorded drive."""
    subprocess.run([ROOT / "build/host-release/gpom-sim", "--scans", "60", "--beams", "61",
                    "--step", "1", "--out", folder / "drive.csv"], check=True)


# What a page takes for given.
GIVEN = {"README.md": write_program, "docs/questions.md": write_drive,
         "docs/python.md": write_drive}


@pytest.fixture(scope="session", name="site")
def built_site():
    """Folder of the pages, as `make docs` makes them; a warning fails it."""
    if not shutil.which("doxygen") or not shutil.which("sphinx-build"):
        pytest.skip("no Doxygen or Sphinx: tools/setup docs")
    done = subprocess.run(["make", "docs"], cwd=ROOT, stdout=subprocess.PIPE, text=True,
                          stderr=subprocess.STDOUT, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stdout
    return ROOT / "build/docs/html"


def test_every_page_is_in_the_site(site):
    """Each file of docs/ becomes a page."""
    for page in PAGES[1:]:
        assert (site / page.removeprefix("docs/")).with_suffix(".html").is_file(), page


def test_every_function_is_on_a_page(site):
    """What a reader looks for by its name is there, with its cost."""
    pages = "".join(path.read_text(encoding="utf-8") for path in (site / "api").glob("*.html"))
    headers = "".join(path.read_text(encoding="utf-8")
                      for path in (ROOT / "include/gpom").glob("*.h"))
    functions = set(re.findall(r"GPOM_API [^;({]*?(gpom_\w+)\(", headers))
    assert len(functions) > 30
    costs = (site / "costs.html").read_text(encoding="utf-8")
    for name in sorted(functions):
        assert f'<span class="pre">{name}</span>' in pages, name
        assert f'<span class="pre">{name}</span>' in costs, name


@pytest.mark.parametrize("name", ["gpom_config_t.keep_m", "gpom_map_step", "GPOM_LANES_MAX",
                                  "gpom_class_t.GPOM_FREE"])
def test_a_missing_comment_is_found(site, tmp_path, name):
    """A field, function, macro or enumerator that Doxygen does not have fails the build."""
    assert site.is_dir()
    shutil.copytree(ROOT / "build/docs/xml", tmp_path / "xml")
    member = name.partition(".")[2] or name
    for path in (tmp_path / "xml").glob("*.xml"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(f"<name>{member}</name>", "<name>other</name>"),
                        encoding="utf-8")
    headers = sorted((ROOT / "include/gpom").glob("*.h"))
    done = subprocess.run([sys.executable, "tools/dev/docs_complete.py", tmp_path / "xml",
                           *[header.relative_to(ROOT) for header in headers]], cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False)
    assert done.returncode == 1
    assert f": {name} is not in the documentation" in done.stdout


def test_a_function_without_cost_is_found(tmp_path):
    """A public function needs one line `Cost: ...`."""
    (tmp_path / "include/gpom").mkdir(parents=True)
    (tmp_path / "include/gpom/one.h").write_text(
        "/** Does it.\n *\n *  Cost: O(1). */\nGPOM_API int gpom_one(void);\n\n"
        "/** Does more. */\nGPOM_API int gpom_two(void);\n", encoding="utf-8")
    done = subprocess.run([sys.executable, ROOT / "tools/dev/docs_pages.py", "--build", ".",
                           "--out", "out"], cwd=tmp_path, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 1
    assert "include/gpom/one.h: gpom_two() has 0 lines" in done.stdout


def test_commands_are_found():
    """A fenced block, an indented one, a command over two lines; text and C are none."""
    text = ("Text\n\n    make lib\n\n```c\n\n    make(it);\n```\n\n```shell\na \\\n    b\n```\n"
            "\n    k = x * y\n\n")
    assert blocks_of(text) == ["make lib\n", "a \\\n    b\n"]


def test_reasons_are_needed():
    """A command that no page has any more needs no reason."""
    commands = [line.strip() + " " for page in PAGES
                for block in blocks_of((ROOT / page).read_text(encoding="utf-8"))
                for line in block.split("\n")]
    for begin in NOT_RUN:
        assert any(command.startswith(begin) for command in commands), begin


@pytest.mark.parametrize("page", [page for page in PAGES if script_of(page)])
def test_commands_run(page, tmp_path):
    """The commands of a page, one after the other as a reader types them, succeed."""
    own_network = ["unshare", "-n"] if os.getuid() == 0 else ["unshare", "-rn"]
    if subprocess.run([*own_network, "true"], check=False).returncode != 0:
        pytest.skip("unshare -n is not permitted: no network of its own")
    subprocess.run(["make", "tools", "gpomd", "lib", "examples", "python-package"], cwd=ROOT,
                   check=True, stdout=subprocess.DEVNULL, timeout=TIMEOUT_S)
    GIVEN.get(page, lambda folder: None)(user_folder(tmp_path))
    script = (f"{NETWORK}\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n"
              f"set -ex\n{script_of(page)}\n")
    done = subprocess.run([*own_network, "bash", "-c", script], cwd=tmp_path, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                          stdin=subprocess.DEVNULL, timeout=TIMEOUT_S)
    assert done.returncode == 0, done.stdout[-4000:]
