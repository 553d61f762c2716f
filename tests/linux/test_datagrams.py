"""What the network itself brings to gpomd: fragments, losses, and datagrams that nobody meant."""
import itertools
import random
import socket
import struct
import time

import pytest
from conftest import (URL, encoded, fresh_status, library_cells, replay, scan, stalled,
                      wait_for_map, wait_for_status, wait_until)
from gpom_watch import Watch

GROUP = ("239.255.76.67", 7667)
SHORT, FRAGMENT = 0x4c433032, 0x4c433033  # LC02, LC03
CHANNEL = b"GPOM_SCAN\0"
N_CONTRADICTIONS = 20


@pytest.fixture
def sender():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bare:
        yield bare


def fragment(sequence, n_bytes, offset, i_fragment, n_fragments, payload):
    return struct.pack(">IIIIHH", FRAGMENT, sequence, n_bytes, offset, i_fragment,
                       n_fragments) + payload


def cut(sequence, data, size):
    """A message in fragments of so many bytes each, the last one shorter."""
    starts = range(0, len(data), size)
    return [fragment(sequence, len(data), start, i, len(starts),
                     (b"" if i else CHANNEL) + data[start:start + size])
            for i, start in enumerate(starts)]


def forged_fragments():
    """Every field at its ends and where it contradicts the others, offsets that wrap round at 2^32
    among them: each combination of them once, a few sequence numbers in turn."""
    numbers = itertools.product((0, 1, 1000, 2**31 - 1, 2**32 - 1), (0, 1, 2, 65535), (0, 1, 65535),
                                (0, 1, 1000))
    for n_bytes, n_fragments, i_fragment, n_payload in numbers:
        ends = {0, 1, n_bytes - n_payload, n_bytes, 2**31, -n_payload, 1 - n_payload, -1, -500}
        for offset in sorted(end % 2**32 for end in ends):
            for head in (b"", CHANNEL):
                yield n_bytes, offset, i_fragment, n_fragments, head + n_payload * b"\xa5"


def contradiction(sequence):
    """Two fragments of a message that do not agree on its size."""
    return [fragment(sequence, 300, 0, 0, 3, CHANNEL + bytes(100)),
            fragment(sequence, 301, 100, 1, 3, b"x")]


def forged_datagrams(rng):
    """Random ones, LCM's or not, some cut short."""
    for _ in range(1000):
        head = struct.pack(">II", SHORT + rng.randrange(3), rng.randrange(4))
        channel = rng.choice([CHANNEL, b"", b"\0", b"x" * 80])
        data = head + rng.randbytes(rng.choice([0, 12])) + channel + rng.randbytes(500)
        yield data[:rng.randrange(len(data))] if rng.randrange(4) == 0 else data


def test_forged_datagrams_change_no_cell(start, street, sender, tmp_path):
    """Each is given up under one counter, or is a message, or a part of one that never comes. Who
    watches joins later: a forged fragment may end a program whose liblcm receives it."""
    daemon, rng = start(), random.Random(4)
    replay(street)
    forged = [fragment(rng.choice([0, 1, 2**32 - 1]), *fields) for fields in forged_fragments()]
    forged += forged_datagrams(rng)
    for i, data in enumerate(forged):
        sender.sendto(data, GROUP)
        if i % 20 == 0:
            time.sleep(0.01)
    for sequence in range(N_CONTRADICTIONS):
        for data in contradiction(100 + sequence):
            sender.sendto(data, GROUP)
        time.sleep(0.01)
    watch = Watch(URL)
    cells, _ = library_cells(daemon, street, tmp_path)
    wait_for_map(watch, cells)

    def are_counted():
        counts = watch.status["counts"]
        return (counts["datagrams_malformed"] > len(forged) / 4
                and counts["datagrams_other"] > len(forged) / 200
                and counts["fragments_overlong"] > len(forged) / 200
                and counts["fragments_inconsistent"] > N_CONTRADICTIONS / 2)
    wait_until(watch, are_counted)
    assert watch.status["counts"]["scans_inserted"] == 40
    assert daemon.stop() == 0
    assert "datagrams malformed" in "".join(daemon.lines)


def test_every_fault_of_fragments_raises_its_counter_alone(start, peer, sender):
    start()
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    good = cut(0, encoded(scan(peer, 0)), 50)
    expected = dict.fromkeys((name for name in watch.status["counts"]
                              if name.startswith(("datagrams", "fragments", "messages", "scans"))),
                             0)

    def check(datagrams, **risen):
        for data in datagrams:
            sender.sendto(data, GROUP)
        expected.update({name: expected[name] + n for name, n in risen.items()})
        wait_for_status(watch, **expected)
    check([b"neither"], datagrams_other=1)
    # what is not whole, or was, is given up within a second: each with its end
    check([*reversed(good), good[0]], scans_received=1, scans_inserted=1, fragments_repeated=1)
    check([fragment(1, 100, 0, 5, 3, b"x")], datagrams_malformed=1)
    check([fragment(1, 1000000, 100, 1, 3, b"x")], fragments_overlong=1)
    check(contradiction(1), fragments_inconsistent=1, messages_timed_out=1)
    check([cut(sequence, bytes(100), 50)[0] for sequence in range(2, 19)], messages_evicted=1,
          messages_timed_out=16)


def test_what_the_socket_has_no_room_for_is_counted(start, peer):
    """While the receiving thread stands still; the scans' own numbers say the same."""
    daemon = start(top=f'lcm_url = "{URL}&recv_buf_size=20000"')
    watch = Watch(URL)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_for_status(watch, scans_inserted=1)
    with stalled(daemon.process, "receiver"):
        for i in range(1, 200):
            watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i)))
    wait_until(watch, lambda: watch.status["counts"]["scans_inserted"] > 1)
    for i in range(200, 220):  # one tells of those before it, unless it finds no room either
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i)))
        counts = fresh_status(watch)["counts"]
        if counts["scans_received"] + counts["scans_lost"] == i + 1:
            break
    assert counts["scans_received"] + counts["scans_lost"] == i + 1
    assert counts["datagrams_lost"] >= counts["scans_lost"] > 0
