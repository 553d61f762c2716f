"""Documents: links lead somewhere, each page of docs/ has one title, each counter has a row."""
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LINK = re.compile(r"!?\[[^\]\n]*\]\(([^)\s#]+)(#[^)\s]*)?\)")
FENCE = re.compile(r"^(```|~~~).*?^\1", re.DOTALL | re.MULTILINE)


def documents():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT,
                            capture_output=True, text=True, check=True).stdout.split()
    return [ROOT / name for name in listed if (ROOT / name).is_file()]


def text_of(path):
    """Without blocks of code."""
    return FENCE.sub("", path.read_text(encoding="utf-8"))


def test_every_relative_link_leads_to_a_file():
    absent = [f"{path.relative_to(ROOT)}: {target}" for path in documents()
              for target, _ in LINK.findall(text_of(path))
              if "://" not in target and not (path.parent / target).exists()]
    assert not absent


def test_every_page_of_the_documentation_begins_with_its_only_title():
    for path in documents():
        if path.relative_to(ROOT).parts[0] == "docs":
            titles = re.findall(r"^# .+$", text_of(path), re.MULTILINE)
            assert len(titles) == 1 and text_of(path).startswith(titles[0]), path


def counters_of_the_library():
    header = (ROOT / "include" / "gpom" / "map.h").read_text(encoding="utf-8")
    body = re.search(r"typedef struct \{((?:(?!typedef).)*?)\} gpom_stats_t;", header, re.DOTALL)
    return re.findall(r"uint64_t (\w+);", body[1])


@pytest.mark.parametrize("name", counters_of_the_library())
def test_every_counter_of_the_library_has_a_row_in_the_documents(name):
    text = (ROOT / "docs" / "counters.md").read_text(encoding="utf-8")
    table = text.partition("## Of the library")[2].partition("\n## ")[0]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| ")]
    assert any(f"`{name}`" in row for row in rows)


def test_defaults_in_params_h_are_those_of_gpom_params_init():
    header = (ROOT / "include/gpom/params.h").read_text()
    source = (ROOT / "src/gp/params.cpp").read_text()
    fields = re.findall(r"^    \w+ (\w+);\s*/\*\*<(.*?)\*/", header, re.MULTILINE | re.DOTALL)
    stated = {name: match.group(1) for name, text in fields
              if (match := re.search(r"Default\s+([A-Z\d_.]+?)\.?\s*$", " ".join(text.split())))}
    body = source[source.index("void gpom_params_init"):source.index("namespace\n")]
    made = {name: value.rstrip("f") for name, value in
            re.findall(r"params->(\w+) = ([A-Z\w.]+);", body) if name != "struct_bytes"}

    def number(value):
        return value if value.startswith("GPOM") else float(value)
    assert {name: number(value) for name, value in stated.items()} == \
        {name: number(value) for name, value in made.items()}
