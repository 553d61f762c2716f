"""gpom-replay, and the five minutes of ports/linux/README.md as a newcomer would spend them."""
import contextlib
import gzip
import os
import re
import signal
import struct
import subprocess

import pytest
from conftest import BUILD, PATIENCE_S, ROOT, URL, run, tool, wait_until
from gpom_watch import Watch

PLACES_M = (10.0, 10.5, 11.0)


def carmen_log(n_beams=181):
    """A robot that drives along x and sees a wall 5 m around; times of the logger."""
    lines = ["# a comment", "ODOM 1 2 3"]
    for i, x_m in enumerate(PLACES_M):
        ranges = " ".join(["5.0"] * n_beams)
        lines.append(f"FLASER {n_beams} {ranges} {x_m} 80.0 0.0 0 0 0 {100.0 + i} robot {i}.0")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", ["log.carmen", "log.carmen.gz"])
def test_a_carmen_log_is_sent_scan_by_scan(name, peer, tmp_path):
    path = tmp_path / name
    (gzip.open if name.endswith("gz") else open)(path, "wt").write(carmen_log())
    watch, scans = Watch(URL), []
    watch.bus.subscribe("GPOM_SCAN", lambda _, data: scans.append(
        peer.type("gpom.scan_t").decode(data)))
    done = run("gpom-replay", path, "--rate", 100, "--sensor-id", 7, "--repeat", 2)
    assert done.returncode == 0 and done.stdout == "gpom-replay: 6 messages sent\n"
    wait_until(watch, lambda: len(scans) == 6)
    assert [scan.pose[0] for scan in scans] == [*PLACES_M, *PLACES_M]
    assert [scan.sequence for scan in scans] == list(range(6))
    assert [scan.utime for scan in scans] == [10**6 * t for t in range(100, 106)]  # time goes on
    assert {(scan.sensor_id, scan.n_ranges, scan.ranges[90]) for scan in scans} == {(7, 181, 5.0)}


def test_stamps_of_now_follow_the_rate(peer, tmp_path):
    """At ten times the speed, scans that were a second apart are stamped 0.1 s apart."""
    path = tmp_path / "log.carmen"
    path.write_text(carmen_log())
    watch, stamps = Watch(URL), []
    watch.bus.subscribe("GPOM_SCAN", lambda _, data: stamps.append(
        peer.type("gpom.scan_t").decode(data).utime))
    assert run("gpom-replay", path, "--rate", 10, "--now").returncode == 0
    wait_until(watch, lambda: len(stamps) == 3)
    assert [stamp - stamps[0] for stamp in stamps] == [0, 100_000, 200_000]


def event_log(n=2):
    """An LCM log of n events on channel A, 34 bytes each."""
    return b"".join(struct.pack(">IqqII", 0xeda1da01, i, i, 1, 5) + b"A12345"
                    for i in range(n)).decode("latin-1")


@pytest.mark.parametrize("content, options, text", [
    ("", [], "log:1: no scans in this file; need CSV scans or CARMEN FLASER, "
     "ROBOTLASER or RAWLASER lines"),
    ("what is this", [], "log:1: scan has 1 fields; need t,x,y,theta"),
    (carmen_log(), ["--channel", "A"], "--channel: only for an LCM event log"),
    (carmen_log(), ["--family", "ros"], "--family: ros not in {gpom,bot_core,mbot}"),
    (carmen_log(), ["--rate", "0"], "--rate: "),
    (carmen_log(), ["--url", "udpm://1.2.3.4:7667"], "the address is not a multicast address"),
    *[(event_log(), option, f"{option[0]}: not for an LCM event log") for option in (
        ["--now"], ["--repeat", "2"], ["--family", "mbot"], ["--sensor-id", "1"], ["--extent"],
        ["--range-max", "9"], ["--scan-channel", "A"], ["--pose-channel", "A"])],
    *[(event_log()[:n_bytes], [], f"log: cut or damaged after its first {n_whole} bytes; "
       f"{n_whole // 34} messages sent") for n_bytes, n_whole in (
        (4, 0), (28, 0), (33, 0), (35, 34), (62, 34), (67, 34))],
    *[(event_log(1) + struct.pack(">IqqII4s", 0xeda1da01, 0, 0, *sizes, b"Xabc").decode("latin-1"),
       [], "log: cut or damaged after its first 34 bytes; 1 messages sent") for sizes in (
        (1, 2**31 - 1), (2**31 - 1, 1), (2**32 - 1, 2**32 - 1), (0, 2**31), (5, 0))],
    (event_log(), ["--channel", "NOPE"], "log: has no event to send on these channels")])
def test_gpom_replay_says_in_one_line_what_is_wrong(content, options, text, tmp_path):
    path = tmp_path / "log"
    path.write_bytes(content.encode("latin-1"))
    done = run("gpom-replay", path, *options)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and text in done.stderr


@pytest.mark.parametrize("tool", ["gpomd", "gpom-replay", "gpom-watch"])
def test_help_names_every_option(tool):
    done = run(tool, "--help")
    assert done.returncode == 0 and done.stderr == "" and "--" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 200


def commands_after(words):
    """The lines of the README's first block after some words."""
    text = (ROOT / "ports" / "linux" / "README.md").read_text()
    block = re.search(re.escape(words) + r"[^\n]*\n\n((    .*\n)+)", text)[1]
    return [line.split(" #")[0].strip() for line in block.splitlines()]


WAIT_FOR_READY = """
until grep -q 'ready on' {folder}/gpomd.txt; do
    kill -0 %1
    sleep 0.1
done"""
N_SCANS = 220


def five_minutes(tmp_path):
    """The README's commands as they stand there, but for building and the network, which are there;
    for a slow machine gpomd is waited for. Before the end a line is read, so that one can look."""
    commands = commands_after("Five minutes\n------------")
    assert commands[0].startswith("make ") and commands[1].startswith("sudo ip link set lo up")
    script = "\n".join(commands[2:])
    for words, instead in (
            ("build/host-release", str(BUILD)), (f"{BUILD}/gpomd", tool("gpomd")),
            ("gpomd.toml &", f"gpomd.toml >{tmp_path}/gpomd.txt 2>&1 &"
             + WAIT_FOR_READY.format(folder=tmp_path)),
            ("scans.csv", f"{tmp_path}/scans.csv"),
            ("gpom-watch", "gpom-watch --seconds 6\nwait $!\nread -r line")):
        assert words in script
        script = script.replace(words, instead)
    return script + "\nwait"


@pytest.mark.campaign
def test_the_five_minutes_of_the_readme_work(tmp_path):
    output, watch = tmp_path / "output.txt", Watch(URL)

    def is_every_scan_accounted_for():
        if script.poll() is not None or watch.status is None:
            return script.poll() is not None
        counts = watch.status["counts"]
        n_used = sum(counts[f"scans_{end}"] for end in ("inserted", "overrun", "at_jump"))
        return counts["scans_received"] + counts["scans_lost"] == N_SCANS and (
            n_used == counts["scans_received"])
    with output.open("w") as file:
        script = subprocess.Popen(["bash", "-ec", five_minutes(tmp_path)], cwd=ROOT, text=True,
                                  stdin=subprocess.PIPE, stdout=file, stderr=subprocess.STDOUT,
                                  start_new_session=True)
    try:
        is_there = watch.collect(4 * PATIENCE_S, is_every_scan_accounted_for)
        script.communicate("\n", timeout=PATIENCE_S)
    finally:
        with contextlib.suppress(ProcessLookupError):  # all have ended
            os.killpg(script.pid, signal.SIGKILL)
    said = output.read_text() + (tmp_path / "gpomd.txt").read_text()
    assert is_there and script.returncode == 0, (said, watch.status)
    n_inserted = watch.status["counts"]["scans_inserted"]
    assert n_inserted > N_SCANS / 2, watch.status
    for line in f"{N_SCANS} messages sent", " 0 losses", f"stopped after {n_inserted} scans":
        assert line in said, said
    assert "#" in said and "R" in said
