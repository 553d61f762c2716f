"""What gpomd hangs on: its network interface."""
import socket
import struct
import subprocess
import threading

from conftest import PATIENCE_S, URL, encoded, scan, wait_for_status
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
