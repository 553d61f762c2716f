#!/usr/bin/env python3
"""Check house rules that no compiler checks. Each fault is one line `FILE:LINE: what (rule)`.

usage: tools/dev/lint.py CHECK...
  format    clang-format must find nothing to change
  rules     one-way includes, lengths, names, calls, blanks
  tidy      clang-tidy on src and ports (limits and checks in .clang-tidy)
  reformat  let clang-format rewrite the files
"""
import ast
import glob
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import rooms

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FOLDERS = ["include", "src", "ports", "tests", "tools", "bench", "examples",
           "lcmtypes", ".ci"]
C_KINDS = (".c", ".h", ".cpp", ".hpp")
FILE_LINES_MAX = 600
FUNCTION_LINES_MAX = 70
FIRMWARE_FUNCTION_LINES_MAX = 45  # in src and ports
FIRMWARE_BRANCHES_MAX = 15
FIRMWARE_FOLDERS = ("src", "ports")
BRANCH = re.compile(r"\b(?:if|for|while|case|catch)\b|&&|\|\||\?")
COLUMNS_MAX = 100

# Host code in the folder of a port. It may use all of libc. In the daemon this is the code that
# runs at start or writes the log. The rest of the daemon uses no heap.
HOST_SIDE = {"ports/cortex_m/icount_plugin.c", "ports/template/host_test.c",
             "ports/linux/config/can_config.cpp",
             "ports/linux/config/config.cpp", "ports/linux/gpomd.cpp",
             "ports/linux/config/mavlink_config.cpp", "ports/linux/config/values.cpp",
             "ports/linux/config/values.hpp", "ports/linux/config/words.cpp",
             "ports/linux/config/words.hpp"}
HOST_FOLDERS = ("ports/host/", "ports/python/")

PUBLIC_SYSTEM_HEADERS = {"stddef.h", "stdint.h", "stdbool.h", "limits.h", "float.h"}
CORE_SYSTEM_HEADERS = PUBLIC_SYSTEM_HEADERS | {
    "cfloat", "climits", "cstddef", "cstdint", "limits", "type_traits", "math.h", "string.h",
    "arm_neon.h"}

BANNED_WORDS = {"manager", "handler", "util", "utils", "helper", "helpers"}
BANNED_CALLS = [
    (r"\b(malloc|calloc|realloc|free|alloca|v?(f|s|sn)?printf)\s*\(", "call"),
    (r"\bnew\s+[A-Za-z_:]", "new"),
    (r"\bdelete\b", "delete"),
    (r"\bstd::(vector|string|map|unordered_map|function|unique_ptr|shared_ptr)\b", "container"),
]
UNFINISHED = re.compile(r"\b(" + "|".join(["TO" + "DO", "FIX" + "ME", "XX" + "X"]) + r")\b")
ISSUE_LINK = re.compile(r"https?://\S+/issues/\d+|#\d+")
FOREIGN_PATH = "/wo" + "rk/"


def is_text_source(path):
    """True for our own text: code, scripts and build files, but not data."""
    if "/golden/" in path or path.endswith((".csv", ".png", ".gz", ".pyc")):
        return False
    return "__pycache__" not in path


def source_files():
    found = [name for name in os.listdir(".") if os.path.isfile(name)]
    for folder in FOLDERS:
        found += [path for path in glob.glob(f"{folder}/**", recursive=True)
                  if os.path.isfile(path)]
    return sorted(path for path in found if is_text_source(path))


def c_files(*folders):
    return [path for path in source_files()
            if path.endswith(C_KINDS) and path.split("/")[0] in folders]


def without_comments(text):
    """C or C++ text with blank comments and literals. Line numbers stay."""
    def blank(match):
        token = match.group(0)
        kept = "\n" * token.count("\n")
        return kept + " " if token.startswith("/") else token[0] + kept + token[0]
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])*\''
    return re.sub(pattern, blank, text, flags=re.DOTALL)


def words_of(identifier):
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", identifier).lower().split("_")


# --- Rules: each yields (line, message) for a file - --------------------------------------------


def blank_faults(path, lines):
    if len(lines) > FILE_LINES_MAX and not path.endswith(".md"):
        yield len(lines), f"file has {len(lines)} lines, more than {FILE_LINES_MAX} (file length)"
    is_make = os.path.basename(path) in ("Makefile", ".gitmodules") or path.endswith(".mk")
    for number, line in enumerate(lines, 1):
        if "\t" in line and not is_make:
            yield number, "tab (blanks)"
        if line != line.rstrip() and not path.endswith(".md"):
            yield number, "trailing blank (blanks)"
        if len(line) > COLUMNS_MAX and not path.endswith((".md", ".toml", ".txt")):
            yield number, f"{len(line)} columns, more than {COLUMNS_MAX} (line length)"
        if UNFINISHED.search(line) and not ISSUE_LINK.search(line):
            yield number, "unfinished work without a link to its issue (unfinished)"
        if FOREIGN_PATH in line:
            yield number, "path of somebody's machine (foreign path)"


def allowed_include(path, name, is_quoted):
    if path.startswith("include/"):
        return name.startswith("gpom/") if is_quoted else name in PUBLIC_SYSTEM_HEADERS
    if path.startswith("src/"):
        if is_quoted:
            return name.startswith(("gpom/", "src/"))
        return name.startswith(("Eigen/", "suitesparse/")) or name in CORE_SYSTEM_HEADERS
    if path.startswith("ports/python/"): # the tools in Python
        return not name.startswith("src/")
    if path.startswith("ports/"): # one way: never into src/ or tools/
        return not name.startswith(("src/", "tools/"))
    return True


def include_faults(path, lines):
    for number, line in enumerate(lines, 1):
        match = re.match(r'\s*#\s*include\s*([<"])([^>"]+)[>"]', line)
        if match and not allowed_include(path, match.group(2), match.group(1) == '"'):
            yield number, f"may not include {match.group(2)} (one-way includes)"
        elif match and (fault := rooms.room_fault(path, match.group(2))):
            yield number, f"may not include {match.group(2)}: {fault} (rooms)"


def call_faults(path, code_lines):
    is_host_side = path in HOST_SIDE or path.startswith(HOST_FOLDERS)
    if path.split("/")[0] not in ("include", "src", "ports") or is_host_side:
        return
    for number, line in enumerate(code_lines, 1):
        line = re.sub(r"=\s*delete\b", "", line)
        if line.lstrip().startswith("#"):
            continue
        for pattern, what in BANNED_CALLS:
            if match := re.search(pattern, line):
                yield number, f"'{match.group(0).strip()}' (banned {what})"


def name_faults(code_lines):
    for number, line in enumerate(code_lines, 1):
        for identifier in re.findall(r"[A-Za-z_]\w*", line):
            if banned := BANNED_WORDS.intersection(words_of(identifier)):
                yield number, f"'{identifier}': '{min(banned)}' says nothing (banned word)"


def c_functions(code_lines):
    """(line, length, branches) of each function. A brace alone on its line opens a function,
    because clang-format writes functions in this way."""
    start = None
    for number, line in enumerate(code_lines, 1):
        if start is None and line.strip() == "{":
            start, indent = number, len(line) - len(line.lstrip())
        elif start is not None and re.match(" {%d}\\}" % indent, line):
            body = "\n".join(code_lines[start:number - 1])
            if not re.match(r"\s*(?:namespace|extern)\b", code_lines[start - 2]):
                yield start, number - start - 1, len(BRANCH.findall(body))
            start = None


def c_function_faults(path, code_lines):
    is_firmware = path.split("/")[0] in FIRMWARE_FOLDERS
    lines_max = FIRMWARE_FUNCTION_LINES_MAX if is_firmware else FUNCTION_LINES_MAX
    for start, length, n_branches in c_functions(code_lines):
        if length > lines_max:
            yield start, f"function of {length} lines, more than {lines_max} (function length)"
        if is_firmware and n_branches > FIRMWARE_BRANCHES_MAX:
            yield start, f"function of {n_branches} branches, more than " \
                         f"{FIRMWARE_BRANCHES_MAX} (branches)"


def python_faults(path, text):
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        yield error.lineno or 1, f"{error.msg} (syntax)"
        return
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            if banned := BANNED_WORDS.intersection(words_of(node.name)):
                yield node.lineno, f"'{node.name}': '{min(banned)}' says nothing (banned word)"
        if isinstance(node, ast.FunctionDef):
            length = node.end_lineno - node.lineno
            if length > FUNCTION_LINES_MAX:
                yield node.lineno, f"function of {length} lines, more than " \
                                   f"{FUNCTION_LINES_MAX} (function length)"


def faults_of(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    lines = text.split("\n")[:-1] if text.endswith("\n") else text.split("\n")
    yield from blank_faults(path, lines)
    if path.endswith(C_KINDS):
        code_lines = without_comments(text).split("\n")
        yield from include_faults(path, lines)
        yield from call_faults(path, code_lines)
        yield from name_faults(code_lines)
        yield from c_function_faults(path, code_lines)
    elif path.endswith(".py"):
        yield from python_faults(path, text)


# --- Checks -------------------------------------------------------------------------------------


def check_rules():
    n_faults = 0
    for path in source_files():
        for line, message in sorted(faults_of(path)):
            print(f"{path}:{line}: {message}")
            n_faults += 1
    return n_faults == 0


def check_format(*options):
    files = c_files("include", "src", "ports", "tests", "tools", "bench", "examples")
    command = ["clang-format", *(options or ("--dry-run", "-Werror")), *files]
    return not files or subprocess.run(command, check=False).returncode == 0


def reformat():
    return check_format("-i")


def tidy_one(path):
    flags = ["-Iinclude", "-I.", "-Ibuild/host-release/street", "-Ibuild/host-release/include",
             "-isystem", os.environ.get("EIGEN", "/usr/include/eigen3"),
             "-isystem", "build/mavlink", "-DGPOM_LANES=4", "-DGPOM_FMA=0", "-DGPOM_ASSERTS=1"]
    if path.endswith(".c"):
        flags += ["-std=c99", "-Wno-invalid-noreturn"]
        if path.startswith("ports/cortex_m/") and path not in HOST_SIDE:
            flags += ["--target=arm-none-eabi", "-mcpu=cortex-m7", "-ffreestanding"]
    else:
        flags += ["-std=c++17", "-fno-exceptions", "-fno-rtti"]
    done = subprocess.run(["clang-tidy", "--quiet", path, "--", *flags], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)
    return done.returncode == 0, done.stdout


def check_tidy():
    files = glob.glob("src/*/*.cpp")
    for port in "cortex_m", "codec", "uart", "template", "can":
        files += glob.glob(f"ports/{port}/**/*.c", recursive=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(tidy_one, sorted(files)))
    for is_clean, output in rows:
        if not is_clean:
            print(output.replace(ROOT + "/", ""), end="")
    return all(is_clean for is_clean, _ in rows)


CHECKS = {"format": check_format, "rules": check_rules, "tidy": check_tidy, "reformat": reformat}


def main():
    os.chdir(ROOT)
    names = sys.argv[1:]
    if not names or not set(names) <= set(CHECKS):
        print(__doc__, file=sys.stderr)
        return 2
    results = [CHECKS[name]() for name in names]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
