#!/usr/bin/env python3
"""Write the parts of the documentation that other files know: pages in docs/ include them.

usage: tools/dev/docs_pages.py --build DIR --out DIR
  costs.md    cost of each public function, from the lines `Cost: ...` of include/gpom/
  tools.md    --help of each tool in the build folder
  messages.md the .lcm files
  budget.md   limits of tests/budget.csv
Exit code 1: a public function has no line `Cost: ...`, or several.
"""
import argparse
import csv
import glob
import os
import re
import subprocess
import sys

FUNCTION = re.compile(
    r"(?P<comment>/\*\*(?:(?!\*/).)*\*/)\n(?:GPOM_NODISCARD )?(?:GPOM_API|static inline) "
    r"[^;({]*?(?P<name>gpom_\w+)\(", re.DOTALL)
COST = re.compile(r"^ \*  Cost: (.*?)(?: \*/)?$", re.MULTILINE)


class InputError(Exception):
    """One line for the user: which file, and what is missing."""


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def table(columns, rows):
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def costs_of(path):
    """(function, cost) of a header, in its order."""
    for match in FUNCTION.finditer(read(path)):
        found = COST.findall(match.group("comment"))
        if len(found) != 1:
            raise InputError(f"{path}: {match.group('name')}() has {len(found)} lines "
                             "` *  Cost: ...` in its comment; write one")
        yield match.group("name"), found[0]


def costs_page():
    parts = []
    for path in sorted(glob.glob("include/gpom/*.h")):
        rows = [(f"`{name}`", cost.replace("*", "\\*")) for name, cost in costs_of(path)]
        if rows:
            name = os.path.basename(path)
            parts.append(f"### {name}\n\n" + table(["function", "cost"], rows))
    return "\n".join(parts)


def is_tool(path):
    return re.fullmatch(r"gpomd|gpom-[a-z-]+", os.path.basename(path)) and \
        os.access(path, os.X_OK)


def help_of(words):
    done = subprocess.run([*words, "--help"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, check=False, timeout=60, env={**os.environ, "COLUMNS": "90"})
    if done.returncode != 0:
        raise InputError(f"{' '.join(words)} --help: exit code {done.returncode}")
    return done.stdout.strip()


def subcommands(text):
    """Names that CLI11 lists below `Subcommands:`."""
    listed = text.partition("Subcommands:")[2]
    return re.findall(r"^  ([a-z][a-z-]*)\s", listed, re.MULTILINE)


def tools_page(build):
    parts = []
    tools = sorted(path for path in glob.glob(f"{build}/*") if is_tool(path))
    if not tools:
        raise InputError(f"{build}: no tools there; run make tools gpomd")
    for path in tools:
        name = os.path.basename(path)
        text = help_of([path])
        parts.append(f"## {name}\n\n```text\n{text}\n```\n")
        for word in subcommands(text):
            parts.append(f"### {name} {word}\n\n```text\n{help_of([path, word])}\n```\n")
    return "\n".join(parts)


def messages_page():
    parts = []
    for path in sorted(glob.glob("lcmtypes/*.lcm")):
        name = os.path.basename(path)
        parts.append(f"### {name}\n\n```c\n{read(path).strip()}\n```\n")
    return "\n".join(parts)


def budget_page():
    with open("tests/budget.csv", encoding="utf-8", newline="") as file:
        rows = [(row["target"], row["metric"], f"{int(row['limit']):,}")
                for row in csv.DictReader(file)]
    return table(["target", "what", "limit"], rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--build", required=True, metavar="DIR")
    parser.add_argument("--out", required=True, metavar="DIR")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    try:
        pages = {"costs": costs_page(), "tools": tools_page(args.build),
                 "messages": messages_page(), "budget": budget_page()}
    except InputError as error:
        print(f"docs_pages.py: {error}", file=sys.stderr)
        return 1
    for name, text in pages.items():
        with open(f"{args.out}/{name}.md", "w", encoding="utf-8") as file:
            file.write(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
