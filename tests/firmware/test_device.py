"""The device image: what must hold of a map behind a serial line."""
import os
import random
import subprocess

import line
import pytest
from conftest import IMAGE, IMAGE_M4, ROOT, connect, scan_message, street_messages

GARBAGE_BYTES = int(os.environ.get("GARBAGE_BYTES") or 200_000)


def test_a_street_over_lcm_and_uart_gives_the_pcs_map(tmp_path):
    """Scans through gpom-bridge and UART give, cell by cell, what the library gives on the PC."""
    done = subprocess.run([ROOT / "tools/demo_firmware", tmp_path], capture_output=True, text=True,
                          timeout=300, check=False)
    if "is not permitted" in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2048 of 2048 codes" in done.stdout
    assert "0 given up" in done.stdout


class Garbage:
    """Chunks of a line that no device should see, and what it must count of them."""

    def __init__(self, seed, number, message):
        self.random = random.Random(seed)
        self.number = number
        self.message = message
        self.n_refused = self.n_other = self.n_corrupt = self.n_repeated = 0
        self.last_frame = b""

    def frame(self, datagram):
        self.last_frame = line.frame(datagram, self.number)
        self.number = line.next_number(self.number)
        return self.last_frame

    def chunk(self):
        """A kind of garbage chosen at random. Zeros keep the kinds apart."""
        kinds = [self.noise, self.truncated, self.damaged, self.overlong, self.repeated,
                 self.skipped, self.other_datagram, self.other_channel, self.corrupt_scan,
                 self.repeated_scan]
        return b"\0" + self.random.choice(kinds)() + b"\0"

    def noise(self):
        return self.random.randbytes(self.random.randrange(1, 3000))

    def without_zeros(self):
        return bytes(byte or 1 for byte in self.noise())

    def truncated(self):
        text = line.frame(line.datagram("GPOM_SCAN", self.message), self.number)
        return text[:self.random.randrange(2, len(text) - 2)]

    def damaged(self):
        text = bytearray(line.frame(line.datagram("GPOM_SCAN", self.message), self.number))
        text[self.random.randrange(len(text))] ^= 1 << self.random.randrange(8)
        return bytes(text)

    def overlong(self):
        """Two bodies that lost what was between them, or more than any frame holds."""
        body = line.uncobs(line.frame(self.message, self.number).strip(b"\0"))[0]
        return line.cobs(body * self.random.randrange(2, 12))

    def repeated(self):
        return self.last_frame

    def skipped(self):
        self.number = line.next_number(self.number)
        return self.other_channel()

    def other_datagram(self):
        self.n_refused += 1
        return self.frame(b"XX" + self.without_zeros()[:1400])

    def other_channel(self):
        self.n_other += 1
        return self.frame(line.datagram("GPOM_ANSWER", self.noise()[:1400]))

    def corrupt_scan(self):
        self.n_corrupt += 1
        return self.frame(line.datagram("GPOM_SCAN", self.message[:-1] +
                                        bytes([self.message[-1] ^ 1])))

    def repeated_scan(self):
        self.n_repeated += 1
        return self.frame(line.datagram("GPOM_SCAN", self.message))


def test_garbage_is_counted_by_cause_and_leaves_the_map_intact(start):
    """Noise, cut, damaged and repeated frames, foreign and damaged messages: each counted once
    under its cause, no cell changes, and the next scan is taken."""
    device = start()
    *first, last = street_messages()
    sent = line.FrameModel()
    for i, message in enumerate(first):
        text = device.frame(line.datagram("GPOM_SCAN", message, i))
        sent.take(text)
        device.uart.sendall(text)
    device.wait_for_counts(scans_inserted=len(first))
    before = device.fresh_map()
    sent.take(line.frame(line.datagram("GPOM_MAP_REQUEST", b""), device.number - 1))
    garbage = Garbage(int(os.environ.get("GPOM_SEED") or 1), device.number, first[-1])
    n_bytes = 0
    while n_bytes < GARBAGE_BYTES:
        text = garbage.chunk()
        n_bytes += len(text)
        sent.take(text)
        device.uart.sendall(text)
        device.take(0)
    device.wait_for_counts(**sent.counts, datagrams_refused=garbage.n_refused,
                           messages_other=garbage.n_other, scans_corrupt=garbage.n_corrupt,
                           scans_repeated=garbage.n_repeated, scans_inserted=len(first),
                           watchdog_resets=0)
    device.number = garbage.number
    assert device.fresh_map() == before
    device.send("GPOM_SCAN", last)
    device.wait_for_counts(scans_inserted=len(first) + 1)
    print(n_bytes, "bytes of garbage:", device.status["counts"])


def test_the_cortex_m4f_makes_the_same_map(start):
    """With double arithmetic in software and another image, every code is the Cortex-M7's."""
    maps = []
    for board in {}, {"machine": "mps2-an386", "image": IMAGE_M4}:
        device = start(**board)
        messages = street_messages()
        for message in messages:
            device.send("GPOM_SCAN", message)
        device.wait_for_counts(scans_inserted=len(messages))
        maps.append(device.fresh_map())
    assert len(maps[0]) == 2048 and maps[0] == maps[1]


def test_scans_in_fragments_and_scans_too_long(start):
    """A scan of two datagrams is put together; one of more ranges than fit is counted."""
    device = start()
    rows = [[str(t), "20", "93.5", "0", "-1.5", "0.01", "34", *["8.0"] * n]
            for t, n in ((1, 350), (2, 361), (3, 500))]
    for i, row in enumerate(rows):
        message = scan_message(row, i)
        for text in line.fragments("GPOM_SCAN", message, i):
            device.uart.sendall(device.frame(text))
    device.wait_for_counts(scans_inserted=2, datagrams_refused=2)


def command(gdb, text):
    """Send a command to QEMU's debugger; its answer, news of stops left out."""
    gdb.sendall(b"$" + text + b"#" + b"%02x" % (sum(text) % 256))
    while True:
        packet = b""
        while b"#" not in packet[:-2]:
            byte = gdb.recv(1)
            assert byte, "QEMU's debugger is gone"
            packet += byte
        gdb.sendall(b"+")
        answer = packet[packet.index(b"$") + 1:packet.index(b"#")]
        if not answer.startswith(b"T"):
            return answer


def test_a_main_loop_that_hangs_is_restarted_by_the_watchdog(start, tmp_path):
    """Put the processor into an endless loop: the device starts again and says why."""
    device = start("-gdb", f"unix:{tmp_path}/gdb,server=on,wait=off")
    device.wait(lambda: device.status is not None)
    assert device.status["counts"]["watchdog_resets"] == 0
    rows = subprocess.run(["arm-none-eabi-nm", str(IMAGE)], capture_output=True, text=True,
                          check=True).stdout.splitlines()
    endless = next(int(row.split()[0], 16) & ~1 for row in rows if row.endswith(" wait_for_ever"))
    gdb = connect(tmp_path / "gdb")
    gdb.settimeout(60)
    command(gdb, b"qXfer:features:read:target.xml:0,ff")  # before it, no register may be set
    assert b"OK" == command(gdb, b"Pf=" + endless.to_bytes(4, "little").hex().encode())
    gdb.sendall(b"$D#44")  # detach: go on
    device.wait_for_counts(watchdog_resets=1)
    assert device.status["state"] == "starting"
    device.send("GPOM_SCAN", street_messages()[0])
    device.wait_for_counts(scans_inserted=1)
