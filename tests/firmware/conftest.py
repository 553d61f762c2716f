"""The device image under QEMU, its UART as a socket.

GPOM_SEED      seed of the garbage (tests/run.py prints it)
GARBAGE_BYTES  how much of it, default 200000
"""
import pathlib
import select
import shutil
import socket
import struct
import subprocess
import sys
import time
import zlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "firmware"), str(ROOT / "tests" / "common"),
                str(ROOT / "tools" / "view")]
import gpom_watch  # noqa: E402  (found only after the line above)
import line  # noqa: E402

IMAGE = ROOT / "build/arm-none-eabi-cortex-m7/gpom_device.elf"
IMAGE_M4 = ROOT / "build/arm-none-eabi-cortex-m4/gpom_device.elf"
SCANS = ROOT / "tests/firmware/scans.csv"
SCAN_FINGERPRINT = 0x1543f68f9b5f9666
PATIENCE_S = 60


def scan_message(row, sequence):
    """A gpom.scan_t of a line of gpom-sim's CSV, written from lcmtypes/gpom_scan_t.lcm."""
    t_s, x, y, yaw, angle_min, angle_step, _, *ranges = map(float, row)
    body = struct.pack(">QqIh3d9f2di", SCAN_FINGERPRINT, round(1e6 * t_s), sequence, 0, x, y, yaw,
                       *[0.0] * 9, angle_min, angle_step, len(ranges))
    body += struct.pack(f">{len(ranges)}f", *ranges)
    return body + struct.pack(">I", zlib.crc32(body))


def street_messages():
    rows = [text.split(",") for text in SCANS.read_text().splitlines() if text[0] != "#"]
    return [scan_message(row, i) for i, row in enumerate(rows)]


def connect(path):
    """The socket that QEMU opens there."""
    end = time.monotonic() + PATIENCE_S
    while True:
        client = socket.socket(socket.AF_UNIX)
        try:
            client.connect(str(path))
            return client
        except OSError:
            client.close()
            assert time.monotonic() < end, f"QEMU gives no {path}"
            time.sleep(0.05)


class Device:
    """A running image. Its time is that of its instructions: a busy PC wakes no watchdog."""

    def __init__(self, folder, *more, machine="mps2-an500", image=IMAGE):
        self.qemu = subprocess.Popen(
            ["qemu-system-arm", "-machine", machine, "-nographic", "-monitor", "none",
             "-icount", "shift=4,sleep=on", "-serial", f"unix:{folder}/uart,server=on,wait=off",
             "-kernel", str(image), *more], stdin=subprocess.DEVNULL)
        self.uart = connect(folder / "uart")
        self.number = 0
        self.model = line.FrameModel()  # of what the device sends
        self.map, self.status = gpom_watch.Map(), None

    def frame(self, datagram):
        """The next frame to the device."""
        text = line.frame(datagram, self.number)
        self.number = line.next_number(self.number)
        return text

    def send(self, channel, message):
        self.uart.sendall(self.frame(line.datagram(channel, message)))

    def take(self, wait_s=0.1):
        """What the device says for a moment."""
        if not select.select([self.uart], [], [], wait_s)[0]:
            return
        for datagram in self.model.take(self.uart.recv(65536)):
            channel, _, message = datagram[8:].partition(b"\0")
            if channel == b"GPOM_MAP":
                self.map.take(message)
            else:
                assert channel == b"GPOM_STATUS", channel
                self.status = gpom_watch.read_status(message)

    def wait(self, holds):
        """Until something holds of what the device says."""
        end = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < end, (self.status, self.model.counts)
            self.take()

    def wait_for_counts(self, **counts):
        self.wait(lambda: self.status is not None
                  and all(self.status["counts"][name] == n for name, n in counts.items()))

    def fresh_map(self):
        """Codes of all cells, once none is dirty."""
        self.status = None
        self.wait(lambda: self.status is not None and self.status["n_cells_dirty"] == 0)
        self.map = gpom_watch.Map()
        self.send("GPOM_MAP_REQUEST", b"")
        self.wait(lambda: self.map.tile is not None and self.map.is_whole)
        return self.map.probability.tobytes() + self.map.variance_class.tobytes()


@pytest.fixture
def start(tmp_path):
    """start(*more arguments of QEMU, machine and image): a running device."""
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("qemu-system-arm is not installed")
    running = []

    def begin(*more, **board):
        folder = tmp_path / str(len(running))
        folder.mkdir()
        running.append(Device(folder, *more, **board))
        return running[-1]
    yield begin
    for device in running:
        device.uart.close()
        device.qemu.terminate()
        device.qemu.wait()
