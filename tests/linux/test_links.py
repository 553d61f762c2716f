"""What gpomd hangs on: its network interface, who reads its log, and systemd."""
import contextlib
import os
import socket
import struct
import subprocess
import threading

import pytest
from conftest import (PATIENCE_S, URL, encoded, fresh_status, scan, wait_for_status,
                      wait_until)
from gpom_watch import Watch

GROUP = ("239.255.76.67", 7667)


def set_up_pair():
    """A pair of interfaces, one of which carries multicast."""
    for command in ("link add pair0 type veth peer name pair1", "link set pair1 up",
                    "addr add 10.9.9.1/24 dev pair0", "link set pair0 up multicast on",
                    "route add 224.0.0.0/4 dev pair0"):
        subprocess.run(["ip", *command.split()], check=True)


def send(peer, i):
    """A scan from a socket that joins nothing: it must not be heard by a membership of others."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(struct.pack(">II", 0x4c433032, i) + b"GPOM_SCAN\0" + encoded(scan(peer, i)),
                      GROUP)


def wait_for_line(daemon, text):
    """Lines are read until one holds the text; a daemon that is silent for too long is ended."""
    patience = threading.Timer(PATIENCE_S, daemon.process.kill)
    patience.start()
    while text not in daemon.lines[-1]:
        daemon.lines.append(daemon.process.stdout.readline())
        assert daemon.lines[-1], daemon.lines
    patience.cancel()


@pytest.mark.campaign
def test_scans_come_again_after_the_interface_was_removed_and_came_back(start, peer):
    """And each time that it went and came is told once."""
    subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
    set_up_pair()
    daemon = start()
    for i in range(3):
        subprocess.run(["ip", "link", "del", "pair0"], check=True)
        wait_for_line(daemon, "no interface carries LCM's network")
        set_up_pair()
        wait_for_line(daemon, "LCM's network was joined again")
        send(peer, i)
    assert len([line for line in daemon.lines if "LCM's network" in line]) == 6
    wait_for_status(Watch(URL), scans_received=3)


def jump(watch, peer, n):
    """The localiser jumps for the n-th time, which is a line of the log."""
    for i in range(4 * n, 4 * n + 4):  # to agree takes two scans
        pose = [20.0 if i % 4 < 2 else 60.0, 80.0, 0.3]
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i, pose=pose)))
        wait_until(watch, lambda: watch.status is not None and
                   watch.status["counts"]["scans_received"] > i)
    wait_until(watch, lambda: watch.status["counts"]["frame_jumps"] > n)


def test_a_log_that_nobody_reads_any_more_ends_nothing(start, peer, tmp_path):
    """gpomd goes on, and takes its last snapshot at the end."""
    snapshot = f'[snapshot]\npath = "{tmp_path}/map"\nperiod_s = 1000'
    daemon, watch = start(rest=snapshot), Watch(URL)
    daemon.process.stdout.close()
    jump(watch, peer, 0)
    fresh_status(watch)
    daemon.process.terminate()
    assert daemon.process.wait() == 0
    again = start(rest=snapshot)
    assert any("restored" in line for line in again.lines)


def test_a_log_that_is_read_late_holds_nothing_up(start, peer):
    """While there is no room for lines, statuses go out and SIGTERM is heard; the lines lost are
    counted in the log as soon as there is room."""
    daemon, watch = start(), Watch(URL)
    pipe = os.open(f"/proc/self/fd/{daemon.process.stdout.fileno()}", os.O_WRONLY | os.O_NONBLOCK)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(pipe, b"full\n")
    jump(watch, peer, 0)
    fresh_status(watch)
    wait_for_line(daemon, "log lines lost")
    assert "log lines lost: " in daemon.lines[-1]
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(pipe, b"full\n")
    os.close(pipe)
    daemon.process.terminate()
    assert daemon.process.wait() == 0


def test_a_full_queue_of_systemd_loses_no_ready_and_no_stopping(start, tmp_path):
    """Neither is lost while the queue is full of others' messages and the manager is busy."""
    path = str(tmp_path / "notify")

    def fill():
        with contextlib.suppress(BlockingIOError):
            while True:
                other.sendto(b"OTHER=1", path)

    def wait_for(message):
        while listener.recv(100) != message:
            pass
    with (socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener,
          socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as other):
        listener.bind(path)
        listener.settimeout(PATIENCE_S)
        fill()
        daemon, watch = start(environment={"NOTIFY_SOCKET": path}), Watch(URL)
        fresh_status(watch)
        fresh_status(watch)  # the first one was sent after the first try
        wait_for(b"READY=1")
        fill()
        daemon.process.terminate()
        wait_until(watch, lambda: watch.status["state"] == "stopping")
        wait_for(b"STOPPING=1")
        assert daemon.process.wait() == 0
