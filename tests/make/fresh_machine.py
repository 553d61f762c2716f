"""A copy of the tree on a machine on which nothing is installed, in a folder.

The makefiles are the real ones; compilers and tools/setup are scripts. A compiler fails, and writes
down why, if the group of tools/setup that brings it, or a header that its source includes, is not
installed yet. tools/setup GROUP installs by creating a file; it can be told to fail for one group.
"""
import functools
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]

# These tests may be called from make, whose own variables would change what it does.
ENVIRONMENT = {name: value for name, value in os.environ.items()
               if not name.startswith(("MAKE", "MFLAGS"))}

# The group that brings a command. Only these and what is in SYSTEM can be called.
COMMANDS = {"base": ("gcc", "g++", "cc", "c++", "ar", "python3"),
            "firmware": ("arm-none-eabi-gcc", "arm-none-eabi-g++", "arm-none-eabi-ar", "valgrind"),
            "processors": ("aarch64-linux-gnu-gcc", "aarch64-linux-gnu-g++", "aarch64-linux-gnu-ar",
                           "s390x-linux-gnu-gcc", "s390x-linux-gnu-g++", "s390x-linux-gnu-ar"),
            "fuzz": ("clang", "clang++"),
            "lint": ("clang-format", "clang-tidy"),
            "docs": ("doxygen", "sphinx-build"),
            "lcm": ("lcm-gen", "lcm-logger")}
NO_COMPILERS = ("python3", "valgrind", "doxygen", "sphinx-build")
SYSTEM = ("make", "sh", "bash", "env", "awk", "basename", "cat", "chmod", "cmp", "cut", "dirname",
          "echo", "expr", "find", "grep", "head", "install", "ln", "mkdir", "mv", "nproc", "printf",
          "realpath", "rm", "sed", "seq", "sleep", "sort", "tee", "touch", "true", "uname")
# Scripts of the repository that would need the network, root or minutes: they do nothing here.
SILENT = ("demo_lcm", "demo_firmware")

SETUP = """#!/bin/sh
for group; do
    [ "$group" != "{failing}" ] || {{ echo "setup: $group fails" >&2; exit 1; }}
    sleep {sleep_s}
    mkdir -p build/setup build/venv/bin
    : >{tree}/there/$group
    [ "$group" != python ] || {{ printf '#!/bin/sh\\n' >build/venv/bin/python
        chmod +x build/venv/bin/python; }}
    touch build/setup/$group
done
"""
COMMAND = """#!/bin/sh
need() {{ # group, for what
    [ -e {tree}/there/$1 ] || {{ echo "$2 needs the group $1" >>{tree}/faults; exit 1; }}
}}
need {group} {name}
case "$*" in
*tools/dev/lint.py*) need lint "$*" ;;
*tests/run.py*fuzz) ;; # the only suite without Python tests that a target runs alone
*tests/run.py*) need python "$*" ;;
esac
[ {kind} != other ] || exit 0
source= object= program=
while [ $# -gt 0 ]; do
    case $1 in
    -c) source=$2; shift ;;
    -o) object=$2; shift ;;
    --c-cpath) mkdir -p $2; : >$2/generated ;;
    crs) object=$2; shift ;;
    -lbenchmark) need bench "link with $1" ;;
    esac
    shift
done
[ -n "$object" ] || exit 0
if [ -z "$source" ]; then
    printf 'while [ $# -gt 0 ]; do [ $1 != --out ] || : >$2; shift; done\\n' >$object
    chmod +x $object
    exit 0
fi
echo "$source" >>{tree}/compiled
build=${{object%%/obj/*}}
build=${{build%%/target/*}}
[ ! -e {tree}/needs/$source ] || while read -r group; do
    case $group in
    generated) [ -e "$build/lcm/generated" ] ||
        {{ echo "$object is compiled before lcm-gen runs" >>{tree}/faults; exit 1; }} ;;
    *) need $group $object ;;
    esac
done <{tree}/needs/$source
case $source in build/*) need lcm $object ;; esac
: >$object
"""


def header_groups():
    """Group by the first part of a header's name, as tools/setup knows them."""
    text = (ROOT / "tools/setup").read_text(encoding="utf-8")
    groups = {"Eigen": "base"} # Debian keeps it in a folder of its own
    for names, words in re.findall(r'^ {4}([a-z |]+)\) echo "([^"]*)"', text, re.MULTILINE):
        for probe in words.split()[1::2]:
            if "." in probe:
                groups.setdefault(probe.split("/")[0], names.split()[0])
    return groups


def includes_of(path, cache):
    """All headers that a file includes, through the repository's own."""
    if path in cache:
        return cache[path]
    cache[path] = found = set()
    text = (ROOT / path).read_text(encoding="utf-8")
    for name in re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, re.MULTILINE):
        found.add(name)
        for folder in ("", "include/", os.path.dirname(path) + "/"):
            if (ROOT / (folder + name)).is_file():
                found |= includes_of(folder + name, cache)
                break
    return found


@functools.cache
def needs_of_sources():
    """Groups that each source needs; `generated` is what lcm-gen writes."""
    groups, cache, needs = header_groups(), {}, {}
    for folder in ("src", "ports", "tools", "tests", "bench"):
        for path in sorted([*(ROOT / folder).rglob("*.c"), *(ROOT / folder).rglob("*.cpp")]):
            name = str(path.relative_to(ROOT))
            headers = includes_of(name, cache)
            needs[name] = {groups[i.split("/")[0]] for i in headers if i.split("/")[0] in groups}
            if any(i.startswith("peer") for i in headers):
                needs[name] |= {"generated", "lcm"}
    return needs


class FreshMachine:
    """The tree, and the commands that it can call."""

    def __init__(self, tree, failing_group="", sleep_s=0.0):
        self.tree = tree
        for folder in ("there", "bin", "tools"):
            (tree / folder).mkdir(parents=True)
        for entry in ROOT.iterdir():
            if entry.name not in ("build", "tools", ".git"):
                (tree / entry.name).symlink_to(entry)
        for entry in (ROOT / "tools").iterdir():
            if entry.name not in ("setup", *SILENT):
                (tree / "tools" / entry.name).symlink_to(entry)
        words = {"tree": tree, "failing": failing_group, "sleep_s": sleep_s}
        self.write("tools/setup", SETUP.format(**words))
        for name in SILENT:
            self.write(f"tools/{name}", "#!/bin/sh\n")
        for name in SYSTEM:
            path = next(p for p in (f"/usr/bin/{name}", f"/bin/{name}") if os.path.exists(p))
            (tree / "bin" / name).symlink_to(path)
        for group, names in COMMANDS.items():
            for name in names:
                kind = "other" if name in NO_COMPILERS else "compiler"
                self.write(f"bin/{name}", COMMAND.format(**words, group=group, name=name,
                                                         kind=kind))
        for source, groups in needs_of_sources().items():
            self.write(f"needs/{source}", "".join(f"{group}\n" for group in sorted(groups)))

    def write(self, name, text):
        path = self.tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)

    def make(self, *words):
        environment = {"PATH": str(self.tree / "bin"), "HOME": str(self.tree)}
        return subprocess.run(["make", "-j4", "V=1", f"PREFIX={self.tree}/prefix", *words],
                              cwd=self.tree, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              check=False)

    def lines_of(self, name):
        path = self.tree / name
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []
