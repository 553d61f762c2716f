#!/usr/bin/env python3
"""Is everything public in the documentation? Compare Doxygen's XML with what a compiler sees.

usage: tools/dev/docs_complete.py XML_DIR HEADER...

The C preprocessor reads each header: macros from its definitions, functions, types, fields and
enumerators from the declarations that are left. What Doxygen does not have, or has without text, is
one line `HEADER: name`. Fields between `\\cond` and `\\endcond` are the library's own.
"""
import glob
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

PREPROCESS = ["cc", "-std=c99", "-x", "c", "-E", "-Iinclude"]


def without_private(text):
    return re.sub(r"/\*\* \\cond.*?\\endcond \*/", "", text, flags=re.DOTALL)


def preprocessed(header, text, *options):
    """What is left of one header itself, without what it includes."""
    done = subprocess.run([*PREPROCESS, *options, "-"], input=text, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"docs_complete.py: {header}: {done.stderr}")
    lines, is_own = [], False
    for line in done.stdout.split("\n"):
        if marker := re.match(r'# \d+ "(.*?)"', line):
            is_own = marker.group(1) == "<stdin>"
        elif is_own:
            lines.append(line)
    return "\n".join(lines)


def macros_of(header, text):
    """Defined by this header, include guard and overrides of the attributes apart."""
    listed = re.findall(r"^#define (GPOM_\w+)", preprocessed(header, text, "-dD"), re.MULTILINE)
    guard = "GPOM_" + os.path.basename(header)[:-2].upper() + "_H"
    return set(listed) - {guard}


def fields_of(body):
    """Names in the body of a struct; a function pointer's is in (*name)."""
    names = set()
    for declaration in body.split(";"):
        if pointer := re.search(r"\(\*(\w+)\)", declaration):
            names.add(pointer.group(1))
            continue
        for part in declaration.split(","):
            if name := re.search(r"(\w+)\s*(?:\[[^\]]*\]\s*)*$", part.strip()):
                names.add(name.group(1))
    return names


def declared_in(header):
    """Every public name of a header: `name`, or `type.field`."""
    with open(header, encoding="utf-8") as file:
        text = without_private(file.read())
    names = macros_of(header, text)
    code = re.sub(r"__attribute__\(\(\w+(?:\([^)]*\))?\)\)", "", preprocessed(header, text))
    for kind, body, name in re.findall(r"typedef (struct|enum)\s*\{(.*?)\}\s*(\w+);", code,
                                       re.DOTALL):
        names.add(name)
        if kind == "enum":
            names |= {f"{name}.{value}" for value in re.findall(r"\b(GPOM_\w+)\b", body)
                      if re.search(rf"(?:^|,|\s){value}\s*(?:=|,|$)", body)}
        else:
            names |= {f"{name}.{field}" for field in fields_of(body)}
    code = re.sub(r"typedef (?:struct|enum)\s*\{.*?\}\s*\w+;", "", code, flags=re.DOTALL)
    names |= set(re.findall(r"typedef struct \w+ (\w+);", code))
    names |= set(re.findall(r"^[\w \t*]*?\b(gpom_\w+)\s*\(", code, re.MULTILINE))
    return names


def has_text(node):
    return any("".join(part.itertext()).strip() for tag in ("briefdescription",
               "detaileddescription") for part in node.findall(tag))


def documented_in(folder):
    """Every name of Doxygen's XML that has a text, as in declared_in()."""
    names = set()
    for path in glob.glob(f"{folder}/*_8h.xml") + glob.glob(f"{folder}/struct*.xml"):
        compound = ElementTree.parse(path).getroot().find("compounddef")
        is_struct = compound.get("kind") == "struct"
        owner = compound.findtext("compoundname") + "." if is_struct else ""
        if is_struct and has_text(compound):
            names.add(compound.findtext("compoundname"))
        for member in compound.iter("memberdef"):
            name = member.findtext("name")
            names |= {owner + name} if has_text(member) else set()
            names |= {f"{name}.{value.findtext('name')}" for value in member.findall("enumvalue")
                      if has_text(value)}
    return names


def main():
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    documented = documented_in(sys.argv[1])
    n_names, n_missing = 0, 0
    for header in sys.argv[2:]:
        declared = declared_in(header)
        n_names += len(declared)
        for name in sorted(declared - documented):
            print(f"{header}: {name} is not in the documentation: write a comment `/** ... */` "
                  "before it", file=sys.stderr)
            n_missing += 1
    if n_names == 0:
        print("docs_complete.py: no public name found in the headers", file=sys.stderr)
    else:
        print(f"  API  {n_names} public names, {n_missing} without documentation")
    return 1 if n_missing > 0 or n_names == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
