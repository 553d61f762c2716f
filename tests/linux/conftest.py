"""A network of its own for each test, gpomd in it, and peers made by lcm-gen.

Nothing that is sent can leave the machine: a test that cannot have its own network is skipped.
GPOM_BUILD  build directory, default build/host-release
GPOMD       the daemon to be tested, default that of GPOM_BUILD
"""
import contextlib
import ctypes
import importlib
import os
import pathlib
import signal
import struct
import subprocess
import sys
import threading
import time
import zlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "common"), str(ROOT / "tools" / "view")]
BUILD = (ROOT / os.environ.get("GPOM_BUILD", "build/host-release")).resolve()
CLONE_NEWNET = 0x40000000
URL = "udpm://239.255.76.67:7667?ttl=0"
URL_WITH_ROOM = URL + "&recv_buf_size=4194304"  # for who must miss nothing
PATIENCE_S = 60  # what is waited for comes far sooner, but on a machine with much else to do
T0_US = 1_000_000_000  # stamp of the first scan of a test's own
N_BEAMS = 31


def own_network():
    """A new network with loopback and its multicast route; the old one's file descriptor."""
    before = os.open("/proc/self/ns/net", os.O_RDONLY)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:
        os.close(before)
        pytest.skip("no network namespace may be made here: run as root, or unshare -r")
    return before, libc


@pytest.fixture(autouse=True)
def network():
    before, libc = own_network()
    try:
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
        yield
    finally:
        assert libc.setns(before, CLONE_NEWNET) == 0
        os.close(before)


def tool(name):
    path = ROOT / os.environ["GPOMD"] if name == "gpomd" and "GPOMD" in os.environ else BUILD / name
    assert path.is_file(), f"{path} is missing: run `make linux-tests`"
    return str(path)


def run(name, *arguments, **more):
    return subprocess.run([tool(name), *map(str, arguments)], capture_output=True, text=True,
                          timeout=2 * PATIENCE_S, check=False, **more)


@pytest.fixture(scope="session")
def street(tmp_path_factory):
    """A dense, short street."""
    path = tmp_path_factory.mktemp("street") / "scans.csv"
    done = run("gpom-sim", "--seed", 1, "--scans", 40, "--beams", 91, "--step", 1, "--out", path)
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture(scope="session")
def peer():
    """peer(name, **fields): a message by lcm-gen's Python code; peer.type(name): its class."""
    folder = BUILD / "lcm" / "python"
    assert folder.is_dir(), f"{folder} is missing: run `make linux-tests`"
    sys.path.insert(0, str(folder))

    def kind(name):
        return getattr(importlib.import_module(name), name.split(".")[1])

    def make(name, **fields):
        message = kind(name)()
        for field, value in fields.items():
            assert hasattr(message, field), field
            setattr(message, field, value)
        return message
    make.type = kind
    return make


def encoded(message):
    """Bytes of a message; CRC-32 by zlib where it has one."""
    if hasattr(message, "crc32"):
        message.crc32 = struct.unpack(">i", struct.pack(">I", zlib.crc32(message.encode()[:-4])))[0]
    return message.encode()


CONFIG = """\
params = "{params}"
{top}
{sensors}
[map]
{map}
[raster]
{raster}
[intake]
{intake}
[publish]
status_s = 0.1
{publish}
{rest}
"""
DEFAULTS = {"params": ROOT / "tools" / "params" / "street.toml", "top": "",
            "sensors": '[[sensor]]\ntype = "gpom.scan_t"\nrange_max_m = 34.0',
            "map": "beam_max = 8000", "intake": "", "publish": "", "rest": "",
            "raster": "cell_m = 1.0\nnx = 70\nny = 60\ncorner = [0.0, 50.0]"}


def config_text(**parts):
    return CONFIG.format(**{**DEFAULTS, **parts})


class Gpomd:
    """A running daemon."""

    def __init__(self, path, environment=None, before=()):
        self.process = subprocess.Popen([*before, tool("gpomd"), "--config", str(path)],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                        env={**os.environ, **(environment or {})})
        self.lines = []
        late = threading.Timer(PATIENCE_S, self.process.kill)
        late.start()
        while not self.lines or "ready" not in self.lines[-1]:
            line = self.process.stdout.readline()
            assert line, f"gpomd stopped, or was not ready in {PATIENCE_S} s: {self.lines}"
            self.lines.append(line)
        late.cancel()

    def stop(self, how=signal.SIGTERM):
        """Exit code, after all it wrote."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        late = threading.Timer(PATIENCE_S, self.process.kill)
        late.start()
        self.lines += self.process.stdout.read().splitlines()  # also what came with "ready"
        code = self.process.wait()
        late.cancel()
        return code


@pytest.fixture
def start(tmp_path):
    """start(**parts of the configuration, or its whole text): a running daemon; stopped at the end
    of the test. before: words before its command line."""
    running = []

    def begin(environment=None, text=None, before=(), **parts):
        path = tmp_path / "gpomd.toml"
        path.write_text(text or config_text(**parts))
        running.append(Gpomd(path, environment, before))
        running[-1].config = path
        return running[-1]
    yield begin
    for daemon in running:
        if daemon.process.poll() is None:
            assert daemon.stop() == 0, daemon.lines


PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT, WAIT_FOR_THREADS = 17, 0x4206, 0x4207, 0x40000000


def thread_named(process, name):
    """Number of a thread; it has its name once it runs, perhaps after the daemon said ready."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
            if (task / "comm").read_text().strip() == name:
                return int(task.name)
        time.sleep(0.01)
    raise AssertionError(f"no thread {name}")


@contextlib.contextmanager
def stalled(process, name):
    """Hold one thread of a child process, by its name, as a debugger does."""
    ptrace = ctypes.CDLL(None, use_errno=True).ptrace
    ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    thread = thread_named(process, name)
    if ptrace(PTRACE_SEIZE, thread, None, None) != 0:
        pytest.skip(f"no ptrace here: {os.strerror(ctypes.get_errno())}")
    assert ptrace(PTRACE_INTERRUPT, thread, None, None) == 0
    os.waitpid(thread, WAIT_FOR_THREADS)
    try:
        yield
    finally:
        assert ptrace(PTRACE_DETACH, thread, None, None) == 0


def wait_until(watch, holds, seconds=PATIENCE_S):
    """Take messages until something holds; what it last was if it never does."""
    assert watch.collect(seconds, holds), (watch.status, watch.map.tile and watch.map.summary())


def wait_for_status(watch, **counts):
    """Until a status has these counts."""
    def holds():
        return watch.status is not None and all(
            watch.status["counts"][name] == n for name, n in counts.items())
    wait_until(watch, holds)
    return watch.status


def fresh_status(watch):
    """A status that was sent from now on, whatever older ones are still queued."""
    now_us = 1e6 * time.time()
    wait_until(watch, lambda: watch.status is not None and watch.status["stamp_us"] > now_us)
    return watch.status


def cells_of(collected):
    return collected.probability.tobytes() + collected.variance_class.tobytes()


def wait_for_map(watch, cells):
    """Until the map is what it must be: probability and variance-class codes by rows."""
    last = [time.monotonic()]

    def holds():
        if watch.map.tile is None:
            return False
        if time.monotonic() - last[0] > 0.5:
            last[0] = time.monotonic()
            watch.request_keyframe()
        return watch.map.is_whole and cells_of(watch.map) == cells
    assert watch.collect(PATIENCE_S, holds), difference(watch.map, cells)


def wait_for_settled_map(watch):
    """Until nothing changes any more and the map is whole; a keyframe mends what was lost."""
    assert watch.collect_settled(PATIENCE_S, 1.0), watch.status
    for _ in range(6):
        if watch.map.is_whole:
            return
        watch.request_keyframe()
        watch.collect(PATIENCE_S / 6, lambda: watch.map.is_whole)
    assert watch.map.is_whole, watch.map.summary()


def difference(collected, cells):
    if collected.tile is None:
        return "no map came"
    n = sum(a != b for a, b in zip(cells_of(collected), cells))
    return f"{n} of {len(cells)} codes differ; {collected.summary()}"


def library_cells(daemon, scans, tmp_path, *points):
    """Codes that the library itself gives, and what it prints of points."""
    path = tmp_path / "cells"
    done = run("library-map", daemon.config, scans, path, *points)
    assert done.returncode == 0, done.stderr
    return path.read_bytes(), [list(map(float, line.split())) for line in done.stdout.splitlines()]


def replay(path, *arguments, rate=20):
    done = run("gpom-replay", path, "--rate", rate, *arguments)
    assert done.returncode == 0, done.stderr


def scan(peer, i, **fields):
    """The i-th scan of a robot that drives along x and sees a round wall."""
    fields = {"utime": T0_US + 100_000 * i, "sequence": i, "pose": [20.0 + 0.1 * i, 80.0, 0.3],
              "pose_cov": [0.0] * 9, "angle_min": -1.5, "angle_step": 0.1, "n_ranges": N_BEAMS,
              "ranges": [8.0] * N_BEAMS, **fields}
    return peer("gpom.scan_t", **fields)
