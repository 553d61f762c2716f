"""The architecture that the folders promise, computed from the includes."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "dev"))
import lint  # noqa: E402  these are found by the line above
import rooms  # noqa: E402

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def sources(folder):
    return [path for kind in ("*.cpp", "*.hpp", "*.c", "*.h")
            for path in sorted((ROOT / folder).rglob(kind))]


def includes(path):
    return INCLUDE.findall(path.read_text(encoding="utf-8"))


def module_graph(folder):
    """Module -> modules it includes; a module is a header and its source together."""
    graph = {}
    for path in sources(folder):
        name = str(path.relative_to(ROOT).with_suffix(""))
        others = {str(pathlib.Path(other).with_suffix("")) for other in includes(path)
                  if other.startswith(folder + "/")}
        graph.setdefault(name, set()).update(others - {name})
    return graph


def circle_in(graph):
    """A circle of modules as a list, or None."""
    done, path = set(), []

    def visit(module):
        if module in path:
            return [*path[path.index(module):], module]
        if module in done:
            return None
        path.append(module)
        for other in sorted(graph.get(module, ())):
            if circle := visit(other):
                return circle
        path.pop()
        done.add(module)
        return None
    return next(filter(None, map(visit, sorted(graph))), None)


def test_no_module_of_the_library_includes_itself_through_others():
    graph = module_graph("src")
    assert len(graph) > 30
    assert circle_in(graph) is None


def test_a_circle_is_found():
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}}) == ["a", "b", "c", "a"]


def test_no_include_goes_up_or_across_the_levels():
    faults = [f"{path.relative_to(ROOT)} includes {other}: {fault}"
              for house in rooms.LEVELS for path in sources(house) for other in includes(path)
              if (fault := rooms.room_fault(str(path.relative_to(ROOT)), other))]
    assert faults == []


def test_ports_never_include_tools():
    """But for the Python package, which offers what the tools do."""
    faults = [(path, other) for path in sources("ports") for other in includes(path)
              if other.startswith(("src/", "tests/")) or
              (other.startswith("tools/") and "python" not in path.parts)]
    assert faults == []


def test_an_include_against_the_levels_is_a_fault():
    assert rooms.room_fault("src/beams/index.hpp", "src/map/map.hpp")
    assert rooms.room_fault("src/insert/scan.cpp", "src/query/workspace.hpp")
    assert rooms.room_fault("src/cellar/new.cpp", "src/map/map.hpp")
    assert not rooms.room_fault("src/insert/scan.cpp", "src/map/map.hpp")


def functions(*folders):
    """(lines, branches) of every function of the C and C++ files of folders."""
    return [(length, n_branches) for folder in folders for path in sources(folder)
            for _, length, n_branches in lint.c_functions(
                lint.without_comments(path.read_text(encoding="utf-8")).split("\n"))]


def test_functions_of_the_library_and_its_ports_are_short():
    lengths, branches = zip(*functions("src", "ports"))
    assert len(lengths) > 1000
    assert sorted(lengths)[int(0.95 * len(lengths))] <= 25
    assert max(lengths) <= 45
    assert max(branches) <= 15


def test_lengths_and_branches_are_counted():
    code = ["int f(int x)", "{", "    if (x > 0 && x < 9) {", "        return 1;", "    }",
            "    return 0;", "}"]
    assert list(lint.c_functions(code)) == [(2, 4, 2)]
