"""Run a script of this folder, and say in words which Python package it lacks.

usage: run_script.py MODULE ARGUMENT...
"""
import pathlib
import runpy
import sys

EXIT_USAGE = 2


def main():
    folder = pathlib.Path(__file__).resolve().parent
    module = sys.argv[1]
    script = folder / f"{module}.py"
    sys.argv = [str(script), *sys.argv[2:]]
    sys.path[0] = str(folder)
    try:
        runpy.run_path(str(script), run_name="__main__")
    except ModuleNotFoundError as missing:
        venv = folder / "venv"
        print(f"{module.replace('_', '-')}: {sys.executable} lacks the Python package "
              f"{missing.name}; make an environment that has all: python3 -m venv {venv} && "
              f"{venv}/bin/pip install -r {folder}/requirements.txt", file=sys.stderr)
        sys.exit(EXIT_USAGE)


main()
