"""gpomd under load and under the axe. Short in the tests; at full length by `make soak`.

GPOM_SOAK_S   seconds of 200 scans a second, default 6 (the soak: 600)
GPOM_KILLS    times that the daemon is killed, default 8 (the soak: 200)
What depends on the machine's speed is printed, not judged: pytest -s shows it.
"""
import contextlib
import os
import pathlib
import random
import re
import signal
import subprocess
import tempfile
import time

import numpy as np
import pytest
from conftest import PATIENCE_S, ROOT, URL, fresh_status, run, tool, wait_until
from gpom_watch import Watch

SOAK_S = float(os.environ.get("GPOM_SOAK_S") or 6)
N_KILLS = int(os.environ.get("GPOM_KILLS") or 8)
SCANS_HZ, N_BEAMS = 200, 360
SHIPPED = ROOT / "ports" / "linux" / "gpomd.toml"


class Sender:
    """gpom-replay on a street that is driven there and back, in real time, until it is stopped."""

    def __init__(self, folder, hz, beams, processors=()):
        path = folder / "street.csv"
        done = run("gpom-sim", "--scans", 2000, "--beams", beams, "--fov-deg", 270, "--step", 0.1,
                   "--there-and-back", "--out", path)
        assert done.returncode == 0, done.stderr
        extent = run("gpom-replay", path, "--extent").stdout.split()
        rate = hz * float(extent[4]) / (int(extent[5]) - 1)
        self.process = subprocess.Popen(
            [*processors, tool("gpom-replay"), path, "--now", "--repeat", "1000000", "--rate",
             str(rate)], stdout=subprocess.DEVNULL)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait(PATIENCE_S)


def on_processor(number):
    return ["taskset", "-c", str(number)]


class Ages:
    """How old the newest scan in the map is, as a subscriber sees it at any moment."""

    def __init__(self, watch):
        self.arrivals = []
        watch.bus.subscribe("GPOM_MAP", lambda _, data: self.arrivals.append(
            (time.time(), int.from_bytes(data[8:16], "big") / 1e6))).set_queue_capacity(0)

    def percentiles(self, *wanted):
        """Of the age [s] at moments 1 ms apart."""
        arrived, stamps = np.array(self.arrivals).T
        moments = np.arange(arrived[0], arrived[-1], 1e-3)
        newest = stamps[np.searchsorted(arrived, moments, side="right") - 1]
        return np.percentile(moments - newest, wanted)


def processor_seconds(pid):
    fields = open(f"/proc/{pid}/stat", encoding="ascii").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def thread_seconds(process):
    """How long each thread ran, and was ready to run but had no processor, by its number."""
    seconds = {}
    for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it ended
            ran, waited, _ = (task / "schedstat").read_text().split()
            seconds[task.name] = np.array([int(ran), int(waited)]) / 1e9
    return seconds


def waits_seconds(process):
    """How long each thread was ready to run but had no processor."""
    return [waited_s for _, waited_s in thread_seconds(process).values()]


def stolen_seconds(before, after):
    """How long others had the processor while a thread waited for it, on one processor: what the
    process's own threads had of it meanwhile is not stolen, however slow they are."""
    ran_s, waited_s = np.array([after[thread] - before[thread] for thread in before]).T
    return max(0.0, *(waited_s - (ran_s.sum() - ran_s)))


@pytest.mark.campaign
def test_no_scan_is_lost_at_200_a_second_on_one_processor(start, tmp_path):
    """360 beams each, and memory stays flat. As shipped, but with a queue of 2.5 s: what else runs
    on this machine may hold the daemon up for longer than the 0.3 s of the default. Where it takes
    a tenth of the processor from the daemon, scans may be dropped, but each is accounted for."""
    *others, own = sorted(os.sched_getaffinity(0))
    text = SHIPPED.read_text().replace("../..", str(ROOT))
    assert "# intake.queue_scans = 64" in text
    text = text.replace("# intake.queue_scans = 64", "intake.queue_scans = 512")
    daemon = start(text=text, before=on_processor(own))
    watch = Watch(URL)
    ages, states = Ages(watch), []
    with Sender(tmp_path, SCANS_HZ, N_BEAMS, on_processor(others[0]) if others else ()):
        wait_until(watch, lambda: watch.status and watch.status["counts"]["scans_inserted"] > 400)
        del ages.arrivals[:]
        pid = daemon.process.pid
        used_s, threads = processor_seconds(pid), thread_seconds(daemon.process)
        first, began_s = watch.status, time.monotonic()

        def is_enough():
            return len(ages.arrivals) >= 100 and watch.status is not first
        while (passed_s := time.monotonic() - began_s) < SOAK_S or not is_enough():
            assert passed_s < SOAK_S + PATIENCE_S, f"{len(ages.arrivals)} tiles came"
            watch.collect(min(1.0, max(0.1, SOAK_S - passed_s)))
            states.append(watch.status)
        used_s = processor_seconds(pid) - used_s
        stolen_s = stolen_seconds(threads, thread_seconds(daemon.process))
        p50, p99, most = ages.percentiles(50, 99, 100)
    watch.collect(1.5)  # what was on its way when the sender ended

    def is_every_scan_accounted_for():
        counts = fresh_status(watch)["counts"]
        return counts["scans_received"] == counts["scans_inserted"] + counts["scans_overrun"]
    wait_until(watch, is_every_scan_accounted_for)
    counts, last = watch.status["counts"], states[-1]
    n_scans = last["counts"]["scans_inserted"] - first["counts"]["scans_inserted"]
    hz = 1e6 * n_scans / (last["stamp_us"] - first["stamp_us"])
    grown = max(state["process_bytes"] for state in states) - first["process_bytes"]
    lags = [state["scan_lag_max_s"] for state in states]
    print(f"\n{passed_s:.0f} s, {counts['scans_inserted']} scans of {N_BEAMS} beams, {hz:.1f} a "
          f"second; {100 * used_s / passed_s:.0f} % of one processor, others had it while it "
          f"waited for {100 * stolen_s / passed_s:.1f} % of the time\n"
          f"map age: median {1e3 * p50:.0f} ms, 99 % {1e3 * p99:.0f} ms, most {1e3 * most:.0f} ms; "
          f"insertion at most {1e3 * max(lags):.0f} ms after the stamp\n"
          f"memory: {first['process_bytes'] / 1e6:.1f} MB, grown by {grown} bytes; "
          f"load {os.getloadavg()[0]:.1f}\n"
          f"lost on the way {counts['scans_lost']}, overrun {counts['scans_overrun']}")
    assert counts["scans_overrun"] + counts["scans_lost"] == 0 or stolen_s > 0.1 * passed_s
    assert grown < 100_000  # first uses of stacks


def restored(daemon):
    """(beams, sequence, stamp of the newest scan [s]) of what a daemon said it restored."""
    found = re.search(r"restored (\d+) beams from snapshot (\d+), its newest scan of ([\d.]+) s",
                      "".join(daemon.lines))
    assert found, daemon.lines
    return int(found[1]), int(found[2]), float(found[3])


class Losses:
    """What kills cost, of scans that are seen on the bus. A scan is lost if it came while the
    daemon ran and is not in the snapshot that is restored after the kill. The newest one there was
    perhaps still coming in when its beams were written: its age at the kill is more than is lost by
    the gap to the next scan, but surely all."""

    def __init__(self, watch):
        self.stamps_s = []
        watch.bus.subscribe("GPOM_SCAN", lambda _, data: self.stamps_s.append(
            int.from_bytes(data[8:16], "big") / 1e6)).set_queue_capacity(0)
        self.ages_s, self.lost_s, self.waits_s, self.n_lost = [], [], [], []

    def note(self, ready_s, killed_s, waited_s, newest_s):
        """When a daemon was ready and was killed, how long it and the sender had waited for a
        processor meanwhile, and the newest scan that the next one restored, known to a
        millisecond."""
        since_s = max(ready_s, newest_s + 1e-3)
        lost = [stamp_s for stamp_s in self.stamps_s if since_s < stamp_s <= killed_s]
        self.ages_s.append(killed_s - max(ready_s, newest_s))
        self.lost_s.append(killed_s - min(lost, default=killed_s))
        self.waits_s.append(waited_s)
        self.n_lost.append(len(lost))

    def summary(self, period_s):
        def line(what, values, unit, digits=3):
            shares = [f"{share:.{digits}f}" for share in np.percentile(values, (50, 90, 99, 100))]
            return "{}: median {}, 90 % {}, 99 % {}, at most {}{}".format(what, *shares, unit)
        n_over = sum(lost_s > period_s for lost_s in self.lost_s)
        return "\n".join([
            line("waited for a processor", self.waits_s, " s"),
            line("from the first scan lost to the kill", self.lost_s, " s")
            + f"; {n_over} of {len(self.lost_s)} over the period of {period_s} s",
            line("age of the newest scan restored, at the kill", self.ages_s, " s"),
            line("scans lost", self.n_lost, "", 0)])


@pytest.fixture
def in_memory(tmp_path):
    """A folder there; on the disk where the system has none."""
    memory = pathlib.Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else tmp_path) as folder:
        yield folder


@pytest.mark.campaign
def test_a_daemon_killed_at_any_moment_comes_back_with_the_last_snapshot(start, tmp_path,
                                                                         in_memory):
    """Nothing that was reported as written is missing, what is there is whole, and a kill costs no
    more than a period and what daemon and sender waited for a processor. The files are in memory:
    a kill takes nothing from the disk, and how long the disk takes is another's affair."""
    period_s = 1.0  # a slow machine may need half of it to write a snapshot
    snapshot = f'[snapshot]\npath = "{in_memory}/map"\nperiod_s = {period_s}'
    rng, n_known, starts_s, ready_s = random.Random(3), 0, [], 0.0
    watch = Watch(URL)
    losses = Losses(watch)

    def count_of_this_one(name):
        """In the newest status of the daemon started last; 0 as long as it has sent none."""
        state = watch.status
        is_its_own = state is not None and state["stamp_us"] > 1e6 * began_s
        return state["counts"][name] if is_its_own and state["n_beams"] > 0 else 0
    with Sender(tmp_path, 50, 91) as sender:
        for i in range(N_KILLS + 1):
            began_s = time.time()
            daemon = start(rest=snapshot, map="beam_max = 8000\nold_s = 10")
            before_s, ready_s = ready_s, time.time()
            waited_before_s = sum(waits_seconds(sender.process))
            if i > 0:
                starts_s.append(ready_s - began_s)
                n_beams, sequence, newest_s = restored(daemon)
                wait_until(watch, lambda: losses.stamps_s[-1] > killed_s)
                losses.note(before_s, killed_s, waited_s, newest_s)
                assert sequence >= n_known and n_beams > 0
                n_known = sequence
            else:
                wait_until(watch, lambda: count_of_this_one("snapshots_written") > 0)
            watch.collect(rng.uniform(0.0, 2 * period_s))
            n_known += count_of_this_one("snapshots_written")
            assert count_of_this_one("snapshots_failed") == 0
            killed_s = time.time()
            waited_s = sum(waits_seconds(daemon.process) + waits_seconds(sender.process))
            waited_s -= waited_before_s
            daemon.stop(signal.SIGKILL)
    print(f"\nkilled {N_KILLS} times: ready again after {np.mean(starts_s):.3f} s, at most "
          f"{max(starts_s):.3f} s; load {os.getloadavg()[0]:.1f}\n{losses.summary(period_s)}")
    for lost_s, held_up_s in zip(losses.lost_s, losses.waits_s):
        assert lost_s <= period_s + held_up_s
