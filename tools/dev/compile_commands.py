#!/usr/bin/env python3
"""Write a database of compile commands from the output of `make -n -B V=1`, read from stdin.

usage: make -n -B V=1 OBJECT... | tools/dev/compile_commands.py FILE.json

It has one entry for each source: the first command that compiles it. Clang's tools and editors read
the database.
"""
import json
import os
import shlex
import sys


def entries_of(text, folder):
    """Entries in order of source. A compile command is a line with -c SOURCE and -o OBJECT."""
    entries = {}
    for line in text.replace("\\\n", " ").splitlines():
        if " -c " not in line or " -o " not in line:
            continue
        words = shlex.split(line)
        source = words[words.index("-c") + 1]
        entries.setdefault(source, {"directory": folder, "file": source, "arguments": words,
                                    "output": words[words.index("-o") + 1]})
    return [entries[source] for source in sorted(entries)]


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    entries = entries_of(sys.stdin.read(), os.getcwd())
    if not entries:
        print("compile_commands.py: no compile command in the input; give it the output of"
              " make -n -B V=1", file=sys.stderr)
        return 1
    os.makedirs(os.path.dirname(sys.argv[1]) or ".", exist_ok=True)
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump(entries, file, indent=1)
        file.write("\n")
    print(f"{sys.argv[1]}: {len(entries)} sources")
    return 0


if __name__ == "__main__":
    sys.exit(main())
