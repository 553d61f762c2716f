"""gpom-bridge on a serial port (a pseudo-terminal), without a device behind it."""
import importlib.util
import os
import pty
import select
import signal
import socket
import subprocess
import time

import line
import pytest
from conftest import PATIENCE_S, ROOT

BRIDGE = ROOT / "build/host-release/gpom-bridge"
URL = "udpm://239.255.76.67:7667?ttl=0"


def linux_tests():
    """The daemon's conftest: a network of one's own."""
    spec = importlib.util.spec_from_file_location("linux_tests", ROOT / "tests/linux/conftest.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


network = linux_tests().network  # every test of this file in a network of its own


@pytest.fixture
def port():
    """A running bridge and the device's end of its serial port."""
    device_end, bridge_end = pty.openpty()
    bridge = subprocess.Popen([BRIDGE, os.ttyname(bridge_end), "--baud", "115200", "--url", URL,
                               "--to-device", "GPOM_SCAN", "--to-device", "LONG"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if not select.select([bridge.stdout], [], [], PATIENCE_S)[0]:
        bridge.kill()
    assert bridge.stdout.readline() == "gpom-bridge: ready\n"
    yield bridge, device_end
    if bridge.poll() is None:
        bridge.kill()
        bridge.wait()
    os.close(device_end)
    os.close(bridge_end)


def read_datagrams(device_end, model, n_wanted):
    datagrams, end = [], time.monotonic() + PATIENCE_S
    while len(datagrams) < n_wanted:
        assert time.monotonic() < end, (datagrams, model.counts)
        if select.select([device_end], [], [], 0.1)[0]:
            datagrams += model.take(os.read(device_end, 65536))
    return datagrams


def test_messages_go_to_the_device_whole_or_in_fragments(port):
    """Each message becomes an LCM datagram in a frame; one too long for it becomes fragments."""
    import lcm
    _, device_end = port
    bus, model = lcm.LCM(URL), line.FrameModel()
    every_byte = bytes(range(256)) * 4
    bus.publish("GPOM_SCAN", every_byte)
    assert read_datagrams(device_end, model, 1) == [line.datagram("GPOM_SCAN", every_byte, 0)]
    long = bytes(i % 251 for i in range(5000))
    bus.publish("LONG", long)
    assert read_datagrams(device_end, model, 4) == line.fragments("LONG", long, 1)
    assert model.counts == {**dict.fromkeys(model.counts, 0), "frames_received": 5}


def test_frames_of_the_device_are_published_and_noise_is_not(port):
    """What the device sends appears on the channel that it names; SIGTERM ends with the counts."""
    import lcm
    bridge, device_end = port
    bus, came = lcm.LCM(URL), []
    bus.subscribe("GPOM_.*", lambda channel, data: came.append((channel, data)))
    status = line.frame(line.datagram("GPOM_STATUS", b"status"), 0)
    os.write(device_end, b"noise" + status + status[:-5] + b"\0"
             + line.frame(line.datagram("GPOM_MAP", b"\0tile\0"), 2))
    end = time.monotonic() + PATIENCE_S
    while len(came) < 2 and time.monotonic() < end:
        bus.handle_timeout(100)
    assert came == [("GPOM_STATUS", b"status"), ("GPOM_MAP", b"\0tile\0")]
    bridge.send_signal(signal.SIGTERM)
    output, _ = bridge.communicate(timeout=PATIENCE_S)
    assert bridge.returncode == 0
    assert "2 from it, frames 2 short, 0 long, 0 corrupt, 0 repeated, 1 lost" in output


@pytest.mark.parametrize("arguments, words", [
    (["/nowhere"], ["/nowhere", "No such file"]),
    (["/dev/null"], ["/dev/null", "no serial port"]),
    (["unix:/nowhere"], ["unix:/nowhere", "-serial unix:"]),
    (["tcp:localhost"], ["tcp:HOST:PORT"]),
    (["/dev/null", "--baud", "1"], ["--baud 1", "115200"]),
    ([], ["line is required"])])
def test_errors_are_one_line(arguments, words):
    """What is wrong, and what to do, in one line; exit code 2."""
    done = subprocess.run([BRIDGE, *arguments], capture_output=True, text=True, timeout=PATIENCE_S,
                          check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    for word in words:
        assert word in done.stderr, done.stderr


def test_a_line_that_ends_is_told(tmp_path):
    """QEMU, or the device, is gone: one line, exit code 2."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "uart"))
        server.listen()
        server.settimeout(PATIENCE_S)
        bridge = subprocess.Popen([BRIDGE, f"unix:{tmp_path}/uart", "--url", URL],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        server.accept()[0].close()
    _, errors = bridge.communicate(timeout=PATIENCE_S)
    assert bridge.returncode == 2 and errors.count("\n") == 1
    assert "the device, or QEMU, is gone" in errors
