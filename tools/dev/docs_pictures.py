#!/usr/bin/env python3
"""Draw the pictures of the documentation again: simulated streets, by the project's own tools.

usage: tools/dev/docs_pictures.py [NAME...]
  street.png  gpom-sim, gpom-eval street, gpom-plot: truth, hits, grid, variance, probability, class
  cars.png    gpom-live cars, cars_picture.py: a live map before and after cars left
  bus.png     gpomd, gpom-replay, gpom-watch: the map that a subscriber sees
Needs `make tools gpomd`. Each picture is made smaller and gets a palette, then goes to
docs/pictures/. bus.png is drawn in a network of its own, which takes root or `unshare -rn`.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOOLS = ROOT / "build/host-release"
PARAMS = ROOT / "tools/params/street.toml"
WIDTH = 1240
COLOURS = 224
NETWORK = "ip link set lo up && ip route add 224.0.0.0/4 dev lo && "
CONFIG = f"""params = "{PARAMS}"
[[sensor]]
type = "gpom.scan_t"
range_max_m = 34.0
[map]
beam_max = 40000
[raster]
cell_m = 0.5
nx = 300
ny = 240
corner = [0.0, 0.0]
"""


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, **options)


def draw_street(folder):
    run(TOOLS / "gpom-sim", "--seed", "1", "--out", folder / "scans.csv", "--truth",
        folder / "world.pgm")
    run(TOOLS / "gpom-eval", "street", "--scans", folder / "scans.csv", "--truth",
        folder / "world.pgm", "--params", PARAMS, "--out", folder, stdout=subprocess.DEVNULL)
    run(TOOLS / "gpom-plot", folder, stdout=subprocess.DEVNULL)
    return folder / "map.png"


def draw_cars(folder):
    run(TOOLS / "gpom-live", "cars", "--params", PARAMS, "--scans", "80", "--keep", "0.1",
        "--cars-leave-at", "40", "--json", folder / "leave.json")
    run(sys.executable, ROOT / "tools/view/cars_picture.py", folder / "leave.json", "--out",
        folder / "cars.png")
    return folder / "cars.png"


def draw_bus(folder):
    (folder / "gpomd.toml").write_text(CONFIG, encoding="utf-8")
    run(TOOLS / "gpom-sim", "--seed", "7", "--scans", "220", "--beams", "181", "--step", "1",
        "--out", folder / "drive.csv")
    script = (f"{NETWORK} {TOOLS}/gpomd --config gpomd.toml & daemon=$!; sleep 1; "
              f"{TOOLS}/gpom-replay drive.csv --now --rate 20; "
              f"{TOOLS}/gpom-watch --settled --seconds 30 --out bus.png; kill $daemon; wait")
    namespace = ["unshare", "-n"] if os.getuid() == 0 else ["unshare", "-rn"]
    run(*namespace, "bash", "-c", script, cwd=folder, stdout=subprocess.DEVNULL)
    return folder / "bus.png"


def shrink(source, out):
    picture = Image.open(source).convert("RGB")
    size = (WIDTH, round(picture.height * WIDTH / picture.width))
    small = picture.resize(size, Image.Resampling.LANCZOS)
    # Rare colours, of the robot's dots, stay.
    few = small.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(out, optimize=True)
    print(f"{out.relative_to(ROOT)}: {out.stat().st_size} bytes")


PICTURES = {"street.png": draw_street, "cars.png": draw_cars, "bus.png": draw_bus}


def main():
    names = sys.argv[1:] or list(PICTURES)
    if not set(names) <= set(PICTURES):
        print(__doc__, file=sys.stderr)
        return 2
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            shrink(PICTURES[name](pathlib.Path(folder)), ROOT / "docs/pictures" / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
