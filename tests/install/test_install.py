"""`make install`: a user's project of two files finds the library; daemon and tools run."""
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


def make_install(*words):
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    return run("make", "-C", ROOT, "install", *words, env=environment)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """A tree installed with DESTDIR, then moved: the library must not know where it was made."""
    staging = tmp_path_factory.mktemp("staging")
    make_install("PREFIX=/opt/gpom", f"DESTDIR={staging}")
    moved = tmp_path_factory.mktemp("elsewhere") / "gpom"
    shutil.move(staging / "opt/gpom", moved)
    return moved


@pytest.fixture(scope="module")
def in_place(tmp_path_factory):
    """A tree that stays where it was installed, as daemon and scripts are used."""
    folder = tmp_path_factory.mktemp("in place")
    make_install(f"PREFIX={folder}")
    return folder


@pytest.fixture(scope="module")
def static(tmp_path_factory):
    """The library without the shared one, over a tree that had it."""
    folder = tmp_path_factory.mktemp("static")
    make_install(f"PREFIX={folder}", "PROGRAMS=0")
    make_install(f"PREFIX={folder}", "PROGRAMS=0", "SHARED=0")
    return folder


@pytest.fixture
def project(tmp_path):
    return pathlib.Path(shutil.copytree(USER, tmp_path / "user"))


def files_of(prefix):
    return {str(path.relative_to(prefix)) for path in prefix.rglob("*") if not path.is_dir()}


def library_files(shared):
    version = ".".join(re.findall(r"#define GPOM_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)",
                                  (ROOT / "include/gpom/status.h").read_text()))
    major = version.split(".", maxsplit=1)[0]
    names = {f"include/gpom/{path.name}" for path in (ROOT / "include/gpom").iterdir()}
    for preset in (ROOT / "tools/params").glob("*.toml"):
        names |= {f"include/gpom/presets/{preset.stem}.h", f"share/gpom/params/{preset.name}"}
    names |= {"lib/libgpom.a", "lib/pkgconfig/gpom.pc", "lib/cmake/gpom/gpom-config.cmake",
              "lib/cmake/gpom/gpom-config-version.cmake"}
    return names | ({"lib/libgpom.so", f"lib/libgpom.so.{major}", f"lib/libgpom.so.{version}"}
                    if shared else set())


def test_everything_is_there_and_nothing_else(prefix):
    """Headers, both libraries, presets, daemon, tools, their Python, unit and configuration."""
    tools = {f"bin/{path.stem.replace('_', '-')}" for path in (ROOT / "tools").glob("gpom_*.cpp")}
    python = {f"lib/gpom/{name}" for name in ("run_script.py", "gpom_plot.py", "gpom_watch.py",
                                              "status_words.py", "requirements.txt")}
    assert files_of(prefix) == library_files(shared=True) | tools | python | {
        "bin/gpomd", "bin/gpom-plot", "bin/gpom-watch", "etc/gpom/gpomd.toml",
        "lib/systemd/system/gpomd.service"}


def test_the_shared_library_exports_the_functions_of_the_headers(prefix):
    """Every GPOM_API function is exported, and nothing else is."""
    text = "".join(path.read_text() for path in (prefix / "include/gpom").glob("*.h"))
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


# ---- without the shared library ------------------------------------------------------------------

def test_a_static_library_alone_is_whole(static):
    """SHARED=0: no name is left that stands for a shared library."""
    assert not (static / "lib/libgpom.so").exists()
    assert library_files(shared=False) <= files_of(static)
    for name in "lib/pkgconfig/gpom.pc", "lib/cmake/gpom/gpom-config.cmake":
        assert (static / name).is_file()


def test_static_only_through_cmake(static, project):
    """The same project, which asks for gpom::gpom, builds and runs."""
    run("cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={static}")
    run("cmake", "--build", project / "build")
    for program in "with_shared", "with_static":
        assert run(project / "build" / program) == "wall 2, way 0\n"
        assert "libgpom" not in run("readelf", "-d", project / "build" / program)


def test_static_only_through_pkg_config(static, project):
    """Without --static, as who does not know that there is no other."""
    environment = {**os.environ, "PKG_CONFIG_PATH": str(static / "lib/pkgconfig")}
    flags = run("pkg-config", "--cflags", "--libs", "gpom", env=environment).split()
    run("cc", *FLAGS, "main.c", "wall.c", *flags, "-o", "user", cwd=project)
    assert run(project / "user") == "wall 2, way 0\n"


# ---- presets, daemon, scripts --------------------------------------------------------------------

@pytest.mark.parametrize("compiler", ["cc -std=c99", "c++ -std=c++17",
                                      "arm-none-eabi-gcc -std=c99 -mcpu=cortex-m7"])
def test_firmware_includes_an_installed_preset(prefix, tmp_path, compiler):
    """Every preset in one C file, which uses one: nothing but the installed headers is needed."""
    words = compiler.split()
    if shutil.which(words[0]) is None:
        pytest.skip(f"no {words[0]}")
    presets = sorted((prefix / "include/gpom/presets").glob("*.h"))
    assert presets
    lines = ["#include <gpom/gpom.h>"] + [f"#include <gpom/presets/{p.name}>" for p in presets]
    lines += ["gpom_status_t begin(gpom_map_t **map, void *memory, size_t bytes);",
              "gpom_status_t begin(gpom_map_t **map, void *memory, size_t bytes)", "{",
              "    gpom_config_t config;", "    gpom_config_init(&config);",
              "    config.params = gpom_params_street;",
              "    return gpom_map_init(map, &config, memory, bytes);", "}"]
    (tmp_path / "firmware.c").write_text("\n".join(lines) + "\n")
    run(*words, *FLAGS[1:], "-x", "c++" if "++" in words[0] else "c", f"-I{prefix}/include", "-c",
        tmp_path / "firmware.c", "-o", tmp_path / "firmware.o")


def test_the_installed_daemon_takes_the_installed_configuration(in_place):
    config = in_place / "etc/gpom/gpomd.toml"
    run(in_place / "bin/gpomd", "--config", config, "--check", cwd="/")
    assert f'params = "{in_place}/share/gpom/params/street.toml"' in config.read_text()


def test_the_unit_starts_the_installed_daemon(in_place):
    unit = (in_place / "lib/systemd/system/gpomd.service").read_text()
    assert f"\nExecStart={in_place}/bin/gpomd --config {in_place}/etc/gpom/gpomd.toml\n" in unit
    assert f"systemctl enable --now {in_place}/lib/systemd/system/gpomd.service\n" in unit
    assert "/usr/local" not in unit


def test_paths_are_those_after_installation(prefix):
    """With DESTDIR, which a package's paths must not have."""
    assert ('params = "/opt/gpom/share/gpom/params/street.toml"'
            in (prefix / "etc/gpom/gpomd.toml").read_text())
    assert ("ExecStart=/opt/gpom/bin/gpomd --config /opt/gpom/etc/gpom/gpomd.toml\n"
            in (prefix / "lib/systemd/system/gpomd.service").read_text())


def test_a_prefix_of_usr_is_configured_in_etc(tmp_path):
    make_install("PREFIX=/usr", f"DESTDIR={tmp_path}")
    assert (tmp_path / "etc/gpom/gpomd.toml").is_file()
    assert ("--config /etc/gpom/gpomd.toml\n"
            in (tmp_path / "usr/lib/systemd/system/gpomd.service").read_text())


def test_a_changed_configuration_is_kept(tmp_path):
    """A second installation puts its own beside it, and says so."""
    make_install(f"PREFIX={tmp_path}")
    config = tmp_path / "etc/gpom/gpomd.toml"
    config.write_text(config.read_text().replace("beam_max = 20000", "beam_max = 30000"))
    told = make_install(f"PREFIX={tmp_path}")
    assert "beam_max = 30000" in config.read_text()
    assert "beam_max = 20000" in (tmp_path / "etc/gpom/gpomd.toml.new").read_text()
    assert f"{config} was changed and stays" in told


def test_every_installed_program_runs(in_place):
    """Those of Python with an environment that has their packages."""
    environment = {**os.environ, "GPOM_PYTHON": str(ROOT / "build/venv/bin/python")}
    for program in (in_place / "bin").iterdir():
        assert "usage" in run(program, "--help", env=environment, cwd="/").lower(), program


def test_a_script_without_its_packages_says_what_to_do(in_place, tmp_path):
    """A Python of its own without numpy: one line that names the package and two commands."""
    run("python3", "-m", "venv", "--without-pip", tmp_path / "bare")
    environment = {**os.environ, "GPOM_PYTHON": str(tmp_path / "bare/bin/python")}
    done = subprocess.run([in_place / "bin/gpom-watch", "--help"], capture_output=True, text=True,
                          check=False, env=environment)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert re.match(r"gpom-watch: \S+ lacks the Python package (lcm|numpy); make an environment",
                    done.stderr)
    assert f"{in_place}/lib/gpom/venv/bin/pip install -r" in done.stderr
    environment["GPOM_PYTHON"] = "no-such-python"
    done = subprocess.run([in_place / "bin/gpom-watch"], capture_output=True, text=True,
                          check=False, env=environment)
    assert done.returncode == 2 and "no no-such-python here; install Python 3" in done.stderr


def test_a_relative_prefix_is_refused():
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    done = subprocess.run(["make", "-C", ROOT, "install", "PREFIX=out", "PROGRAMS=0"],
                          capture_output=True, text=True, check=False, env=environment)
    assert done.returncode != 0 and "PREFIX=out does not begin with /" in done.stderr
