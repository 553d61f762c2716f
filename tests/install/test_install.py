"""`make install`, and a user's project of two files that finds the library outside the tree."""
import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
USER = ROOT / "tests" / "install" / "user"
FLAGS = ["-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror"]


def run(*command, **more):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True,
                          timeout=300, check=False, **more)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """A tree installed with DESTDIR, then moved: what is in it must not know where it was made."""
    staging = tmp_path_factory.mktemp("staging")
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    run("make", "-C", ROOT, "install", "PREFIX=/opt/gpom", f"DESTDIR={staging}", env=environment)
    moved = tmp_path_factory.mktemp("elsewhere") / "gpom"
    shutil.move(staging / "opt/gpom", moved)
    return moved


@pytest.fixture
def project(tmp_path):
    return pathlib.Path(shutil.copytree(USER, tmp_path / "user"))


def test_everything_is_there_and_nothing_else(prefix):
    """Public headers, both libraries, pkg-config file and CMake package."""
    found = {str(path.relative_to(prefix)) for path in prefix.rglob("*") if not path.is_dir()}
    version = ".".join(re.findall(r"#define GPOM_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)",
                                  (ROOT / "include/gpom/status.h").read_text()))
    headers = {f"include/gpom/{path.name}" for path in (ROOT / "include/gpom").iterdir()}
    major = version.split(".", maxsplit=1)[0]
    assert found == headers | {
        "lib/libgpom.a", "lib/libgpom.so", f"lib/libgpom.so.{major}", f"lib/libgpom.so.{version}",
        "lib/pkgconfig/gpom.pc", "lib/cmake/gpom/gpom-config.cmake",
        "lib/cmake/gpom/gpom-config-version.cmake"}


def test_the_shared_library_exports_the_functions_of_the_headers(prefix):
    """Every GPOM_API function is exported, and nothing else is."""
    text = "".join(path.read_text() for path in (prefix / "include/gpom").iterdir())
    declared = set(re.findall(r"GPOM_API[^;#]*?\b(gpom_\w+)\(", text))
    exported = {line.split()[2] for line in
                run("nm", "-D", "--defined-only", prefix / "lib/libgpom.so").splitlines()}
    assert exported == declared


@pytest.mark.parametrize("how", ["shared", "static"])
def test_pkg_config(prefix, project, how):
    """Builds with what pkg-config says, and runs."""
    environment = {**os.environ, "PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    options = ["--static"] if how == "static" else []
    flags = run("pkg-config", "--cflags", "--libs", *options, "gpom", env=environment).split()
    if how == "static":
        flags = [str(prefix / "lib/libgpom.a") if flag == "-lgpom" else flag for flag in flags]
    run("cc", *FLAGS, "main.c", "wall.c", *flags, "-o", "user", cwd=project)
    output = run(project / "user", env={**os.environ, "LD_LIBRARY_PATH": str(prefix / "lib")})
    assert output == "wall 2, way 0\n"
    needs_library = "libgpom.so.0" in run("readelf", "-d", project / "user")
    assert needs_library == (how == "shared")


def test_cmake(prefix, project):
    """find_package(gpom) gives targets that build and run."""
    run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    run("cmake", "--build", project / "build")
    for program in "with_shared", "with_static":
        assert run(project / "build" / program) == "wall 2, way 0\n"


def test_cmake_refuses_another_version(prefix, project):
    """A project that wants version 0.2 is told, not linked."""
    path = project / "CMakeLists.txt"
    path.write_text(path.read_text().replace("gpom 0.1", "gpom 0.2"))
    done = subprocess.run(["cmake", "-S", project, "-B", project / "build",
                           f"-DCMAKE_PREFIX_PATH={prefix}"], capture_output=True, text=True,
                          check=False)
    assert done.returncode != 0 and "0.1.0" in done.stderr
