"""Queries by lcm-gen's typed publish, which cannot compute a CRC-32 over what it encodes."""
import subprocess

import pytest
from conftest import PATIENCE_S, ROOT, URL, encoded, scan, wait_for_status, wait_until
from gpom_watch import Watch
from test_links import wait_for_line

TTL_1 = f'lcm_url = "{URL.replace("ttl=0", "ttl=1")}"'
NO_CRC = 4


def query(peer, **fields):
    points = [peer("gpom.point_t", x=x, y=80.0) for x in (22.0, 60.0)]
    return peer("gpom.query_t", client=3, n_points=2, points=points, **fields)


@pytest.mark.parametrize("parts, is_answered", [
    ({}, True), ({"publish": "query_crc_optional = false"}, False), ({"top": TTL_1}, False),
    ({"top": TTL_1, "publish": "query_crc_optional = true"}, True)],
    ids=["local", "local, wanted", "network", "network, optional"])
def test_a_typed_query_is_answered_or_told_why_not(parts, is_answered, start, peer):
    """By default it is answered where no datagram leaves the machine. A query that was damaged, and
    so has another crc32 than 0, gets no answer: who asked is not known."""
    daemon, watch, answers = start(**parts), Watch(URL), []
    watch.bus.subscribe("GPOM_ANSWER", lambda _, data: answers.append(
        peer.type("gpom.answer_t").decode(data)))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_for_status(watch, scans_inserted=1)
    watch.bus.publish("GPOM_QUERY", query(peer, crc32=1, sequence=1).encode())
    watch.bus.publish("GPOM_QUERY", query(peer, crc32=0, sequence=2).encode())
    watch.bus.publish("GPOM_QUERY", encoded(query(peer, sequence=3)))
    wait_until(watch, lambda: len(answers) == 2)
    assert [answer.sequence for answer in answers] == [2, 3]
    assert [answer.status for answer in answers] == [0 if is_answered else NO_CRC, 0]
    assert [answer.n_points for answer in answers] == [2 if is_answered else 0, 2]
    n_refused = 1 if is_answered else 2
    wait_for_status(watch, queries_answered=3 - n_refused, queries_refused=n_refused)
    if not is_answered:  # the damaged one was told first, and a kind is told once
        wait_for_line(daemon, "damaged: CRC-32 does not fit")


def test_a_query_without_crc_is_told_with_what_to_do(start, peer):
    daemon, watch = start(publish="query_crc_optional = false"), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    watch.bus.publish("GPOM_QUERY", query(peer, crc32=0).encode())
    wait_for_line(daemon, "crc32 is 0")
    assert daemon.lines[-1] == (
        "gpomd: gpom.query_t on GPOM_QUERY: crc32 is 0, as lcm-gen's publish leaves it: compute it "
        "(lcmtypes/README.md), or set publish.query_crc_optional = true\n")


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """The example in C++, built as its comment says."""
    folder = tmp_path_factory.mktemp("client")
    types = sorted(map(str, (ROOT / "lcmtypes").glob("gpom_*.lcm")))
    subprocess.run(["lcm-gen", "-x", "--cpp-hpath", folder, *types], check=True, timeout=PATIENCE_S)
    subprocess.run(["c++", "-std=c++17", "-Wall", "-Wextra", "-Wno-unused-parameter",
                    f"-isystem{folder}", ROOT / "examples" / "query_map.cpp", "-llcm",
                    "-o", folder / "query_map"], check=True, timeout=5 * PATIENCE_S)
    return folder / "query_map"


def asked(client):
    return subprocess.run([client, URL, "22", "80", "60", "80"], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)


def test_the_example_client_prints_what_the_map_says(client, start, peer):
    start()
    watch = Watch(URL)
    for i in range(2):
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i)))
    wait_for_status(watch, scans_inserted=2)
    done = asked(client)
    assert done.returncode == 0, done.stderr
    near, far = done.stdout.splitlines()
    assert near.startswith("22 80: p = 0.") and near.endswith(", free")
    assert far.startswith("60 80: p = 0.") and not far.endswith(", free")


def test_the_example_client_says_why_there_is_no_answer(client, start):
    done = asked(client)
    assert done.returncode == 1 and "gpomd is not running" in done.stderr
    start(publish="query_crc_optional = false")
    done = asked(client)
    assert done.returncode == 0 and done.stdout.startswith("refused with status 4"), done
