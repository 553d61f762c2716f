"""gpomd as a process: starts, stops, kills, configuration, memory; and what looks at it."""
import configparser
import math
import os
import pathlib
import re
import resource
import select
import signal
import socket
import subprocess
import threading
import time

import pytest
from conftest import (N_BEAMS, PATIENCE_S, ROOT, T0_US, URL, config_text, encoded, library_cells,
                      own_network, replay, run, scan, stalled, tool, wait_for_map, wait_for_status,
                      wait_until)
from gpom_watch import Watch

# ---- the process --------------------------------------------------------------------------------

def test_a_new_daemon_takes_over_and_subscribers_notice(start, peer):
    first, watch = start(), Watch(URL)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: watch.map.is_whole)
    states = []
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: states.append(
        peer.type("gpom.status_t").decode(data).state))
    assert first.stop() == 0
    wait_until(watch, lambda: states and states[-1] == 3)
    losses = watch.map.n_lost
    start()
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 1)))
    wait_until(watch, lambda: watch.map.n_lost > losses and watch.map.is_whole)
    assert watch.map.tile.stamp_us == T0_US + 100_000


def test_states_follow_the_scans(start, peer):
    start(publish="stale_s = 0.5")
    watch, states = Watch(URL), []
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: states.append(
        peer.type("gpom.status_t").decode(data).state))
    wait_until(watch, lambda: 0 in states)
    for i in range(1000):  # until a status comes while the last one is fresh
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i)))
        if watch.collect(0.05, lambda: 1 in states):
            break
    wait_until(watch, lambda: states[-1] == 2)
    assert 1 in states and 0 not in states[states.index(1):]


def test_systemd_hears_that_it_is_ready_alive_and_stopping(start, tmp_path):
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        listener.settimeout(PATIENCE_S)
        # two pulses a second: there is room for ten while this test has no processor
        daemon = start(environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "1500000"})
        heard = [listener.recv(100) for _ in range(5)]
        assert heard[0] == b"READY=1" and set(heard[1:]) == {b"WATCHDOG=1"}
        daemon.process.send_signal(signal.SIGTERM)
        while heard[-1] != b"STOPPING=1":
            heard.append(listener.recv(100))
        assert daemon.stop() == 0


def heard_in(listener, seconds):
    """How many messages come in so long, those included that are there already."""
    end, n = time.monotonic() + seconds, 0
    while select.select([listener], [], [], max(0.0, end - time.monotonic()))[0]:
        n += len(listener.recv(100)) > 0
    return n


@pytest.mark.parametrize("thread", ["mapping", "receiver", "publisher"])
def test_the_watchdog_is_not_fed_while_a_thread_is_stalled(thread, start, tmp_path):
    """The others go on meanwhile, and so must a daemon whose thread goes on."""
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        listener.settimeout(PATIENCE_S)
        daemon = start(environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "300000"})
        assert [listener.recv(100) for _ in range(2)] == [b"READY=1", b"WATCHDOG=1"]
        with stalled(daemon.process, thread):
            heard_in(listener, 0.0)  # from before it was stalled
            assert heard_in(listener, 1.0) <= 1  # the pulse before it was
            watch = Watch(URL)
            wait_until(watch, lambda: watch.status is not None)  # the process itself lives
        for _ in range(3):
            assert listener.recv(100) == b"WATCHDOG=1"
        assert daemon.stop() == 0


def test_the_unit_file_is_valid(tmp_path):
    text = (ROOT / "ports" / "linux" / "gpomd.service").read_text()
    sections = configparser.ConfigParser(interpolation=None)
    sections.optionxform = str
    sections.read_string(text)
    assert sections["Unit"]["StartLimitIntervalSec"] == "0"  # a route may come late: no last try
    assert sections["Service"]["Restart"] == "on-failure"
    unit = tmp_path / "gpomd.service"
    unit.write_text(text.replace("/usr/local/bin/gpomd", tool("gpomd")))
    try:
        done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True,
                              timeout=60, check=False)
    except FileNotFoundError:
        pytest.skip("no systemd-analyze here")
    ours = [line for line in done.stderr.splitlines() if "gpomd" in line]
    assert done.returncode == 0 and not ours, done.stderr


SENSOR = '[[sensor]]\ntype = "gpom.scan_t"\nrange_max_m = 34.0'


@pytest.mark.parametrize("parts, line, text", [
    ({"map": "beam_max = 0"}, 7, "map.beam_max: must be a whole number from 1 to 20000000"),
    ({"map": "beams = 5"}, 7, "map.beams: unknown key; remove it"),
    ({"map": "beam_maks = 5"}, 7, "map.beam_maks: unknown key; did you mean beam_max?"),
    ({"rest": "[snapshots]"}, 18, "snapshots: unknown key; did you mean snapshot?"),
    ({"map": "keep_m = 1e-4"}, 7, "map.keep_m: must be 0 or at least 0.001"),
    ({"map": "clear_scans = 1"}, 7, "map.clear_scans: must be 0, or 2 to 4 with keep_m over 0"),
    ({"raster": "nx = 5\nny = 5"}, 8, "raster.cell_m: missing; add it"),
    ({"raster": "cell_m = 1\nnx = 30000\nny = 30000"}, 10, "raster.nx: a raster of so many cells "
     "cannot be published; make cells larger"),
    ({"sensors": ""}, None, "sensor: missing; add it"),
    ({"sensors": SENSOR + "\nid = 0\n" + SENSOR}, 7,
     "sensor[1].id: is also that of sensor[0] on this "
     "channel"),
    ({"sensors": '[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 9'}, 4,
     "sensor[0].type: scans of this type carry no pose; add a [pose] table"),
    ({"sensors": SENSOR + '\nchannel = "A*"'}, 6, "sensor[0].channel: must be a channel's name of "
     "letters, digits and _-/.:#"),
    ({"sensors": SENSOR + "\nmasks = [[1]]"}, 6,
     "sensor[0].masks: each must be [from, to], bearings in rad"),
    ({"sensors": SENSOR + "\nmount = [0, 0]"}, 6, "sensor[0].mount: must be a list of 3 finite "
     "numbers"),
    ({"sensors": SENSOR + '\nzero = "free"'}, 6, 'sensor[0].zero: "free" is not one of ignore, '
     "no_return"),
    ({"sensors": SENSOR + "\nrange_min_m = 40"}, 5, "sensor[0].range_max_m: must be over "
     "range_min_m"),
    ({"rest": '[jump]\nrule = "wipe"'}, 19, 'jump.rule: "wipe" is not one of none, keep, forget, '
     "clear"),
    ({"rest": "[jump]\nforget_m = 0"}, 19, "jump.forget_m: must be from 0.001 to 8000"),
    ({"intake": "step_ops = 5"}, 14, "intake.step_ops: must be a whole number from "),
    ({"publish": "map_hz = 0"}, 17, "publish.map_hz: must be from 0.01 to 1000"),
    ({"publish": "stale_s = [1]"}, 17, "publish.stale_s: must be a number"),
    ({"publish": 'map = "GPOM_SCAN"'}, 17, "publish.map: is also sensor[0].channel; a channel has "
     "one type"),
    ({"publish": 'status = "GPOM_QUERY"'}, 17, "publish.status: is also publish.query; a channel"),
    ({"publish": 'grid = "POSE"', "rest": '[pose]\ntype = "bot_core.pose_t"'}, 17, "publish.grid: "
     "is also pose.channel"),
    ({"sensors": SENSOR + '\nchannel = "GPOM_ANSWER"'}, 16, "publish.answer: is also "
     "sensor[0].channel"),
    ({"sensors": SENSOR + '\nchannel = "POSE"', "rest": '[pose]\ntype = "bot_core.pose_t"'}, 6,
     "sensor[0].channel: is also pose.channel"),
    ({"top": 'lcm_url = "file://bus.log"'}, 2, "lcm_url: must be udpm://ADDRESS:PORT?ttl=0"),
    ({"top": "what is this"}, 2, "not TOML: "),
    ({"top": 'lcm_url = "udpm://nonsense:7667"'}, 2, "lcm_url: LCM's URL must be udpm://ADDRESS"),
    ({"top": 'lcm_url = "udpm://10.0.0.1:7667"'}, 2,
     "lcm_url: LCM's URL: the address is not a multicast"),
    ({"top": 'lcm_url = "udpm://239.1.2.3:7667?tll=1"'}, 2, "lcm_url: LCM's URL: options are ttl"),
    ({"map": "origin = [1e300, 0.0]"}, 7, "map.origin: must be a list of 2 finite numbers of at"),
    ({"raster": "cell_m = 1\nnx = 5\nny = 5\ncorner = [0, 2e9]"}, 12, "raster.corner: must be a"),
    ({"raster": "cell_m = 0.1\nnx = 5\nny = 5\ncorner = [0, 5400000.13]",
      "publish": 'grid = "SLAM_MAP"'}, 12, "raster.corner: publish.grid is in float32, which"),
    ({"sensors": SENSOR + "\nmount = [0, 0, 1e300]"}, 6, "sensor[0].mount: must be a list of 3"),
    ({"params": "none.toml"}, 1, "params: none.toml: cannot open; give the name of a parameters"),
])
def test_a_wrong_configuration_is_refused_with_file_line_and_field(parts, line, text, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(config_text(**parts))
    done = run("gpomd", "--config", path, "--check")
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1
    place = f"gpomd: {path}" + (f":{line}" if line else "") + ": "
    assert done.stderr.startswith(place), done.stderr
    assert text in done.stderr.replace(str(tmp_path) + "/", "")


SHIPPED = (ROOT / "ports" / "linux" / "gpomd.toml").read_text().replace("../..", str(ROOT))
SETTING = re.compile(r"# [\w.]+ = ")  # a default in a comment
EXAMPLE = re.compile(r"#     [\w.]+ = ")


def checked(lines, tmp_path):
    path = tmp_path / "shipped.toml"
    path.write_text("\n".join(lines))
    return run("gpomd", "--config", path, "--check")


def with_comments_off(patterns, numbers=None):
    """The lines of the shipped file, those that match switched on: all, or those of numbers."""
    return [re.sub("^# +", "", line) if any(map(lambda p: p.match(line), patterns))
            and (numbers is None or i in numbers) else line
            for i, line in enumerate(SHIPPED.splitlines())]


@pytest.mark.parametrize("number", [i for i, line in enumerate(SHIPPED.splitlines())
                                    if SETTING.match(line)])
def test_each_commented_line_of_the_shipped_configuration_is_right_by_itself(number, tmp_path):
    """It is a default: what is said of the configuration stays the same."""
    done = checked(with_comments_off([SETTING], {number}), tmp_path)
    assert done.returncode == 0, done.stderr
    plain = checked(SHIPPED.splitlines(), tmp_path)
    assert plain.stdout.split(";")[0] == done.stdout.split(";")[0]


def test_the_whole_shipped_configuration_is_right_with_its_examples_too(tmp_path):
    for patterns in ([SETTING], [EXAMPLE], [SETTING, EXAMPLE]):
        done = checked(with_comments_off(patterns), tmp_path)
        assert done.returncode == 0, done.stderr
    n_settings = sum(SETTING.match(line) is not None for line in SHIPPED.splitlines())
    assert n_settings > 60 and sum(map(bool, map(EXAMPLE.match, SHIPPED.splitlines()))) == 3


def test_without_a_multicast_route_all_say_so_in_one_sentence(street, tmp_path):
    path = tmp_path / "gpomd.toml"
    path.write_text(config_text())
    os.close(own_network()[0])  # a fresh one, where nothing is set up; network() leads back
    for command in (["gpomd", "--config", path], ["gpom-watch", "--seconds", 1],
                    ["gpom-replay", street]):
        done = run(*command)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert "ip route add 224.0.0.0/4 dev lo" in done.stderr


@pytest.mark.parametrize("url, text", [
    ("udpm://127.0.0.1:7667", "the address is not a multicast address"),
    ("udpm://nonsense:7667", "must be udpm://ADDRESS:PORT"),
    ("udpm://239.1.2.3:99999", "must be udpm://ADDRESS:PORT")])
def test_an_address_that_is_no_network_is_refused(url, text, tmp_path):
    path = tmp_path / "gpomd.toml"
    path.write_text(config_text(top=f'lcm_url = "{url}"'))
    done = run("gpomd", "--config", path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and text in done.stderr


def test_memory_is_taken_at_start_and_stays(start, street):
    start()
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    at_start = watch.status["process_bytes"]
    replay(street)
    wait_for_status(watch, scans_inserted=40)
    after_first = watch.status["process_bytes"]
    replay(street)
    wait_until(watch, lambda: watch.status["counts"]["scans_received"] == 80)
    assert after_first - at_start < 400_000  # pages of code and of stacks, when first used
    assert watch.status["process_bytes"] - after_first < 50_000


# ---- snapshots ----------------------------------------------------------------------------------

def restored(daemon):
    """(beams, sequence) of the snapshot that a daemon said it restored."""
    found = re.search(r"restored (\d+) beams from snapshot (\d+)", "".join(daemon.lines))
    assert found, daemon.lines
    return int(found[1]), int(found[2])


def test_a_stopped_daemon_s_map_is_there_again_after_the_start(start, street, tmp_path):
    snapshot = f'[snapshot]\npath = "{tmp_path}/map"\nperiod_s = 1000'
    daemon, watch = start(rest=snapshot), Watch(URL)
    assert "no whole snapshot" in "".join(daemon.lines)
    replay(street)
    cells, _ = library_cells(daemon, street, tmp_path)
    wait_for_map(watch, cells)
    n_beams = wait_for_status(watch, scans_inserted=40)["n_beams"]
    stamp_us = watch.map.tile.stamp_us
    assert daemon.stop() == 0
    again, watch = start(rest=snapshot), Watch(URL)
    assert restored(again)[0] == n_beams
    wait_for_map(watch, cells)
    assert abs(watch.map.tile.stamp_us - stamp_us) < 1000 and math.isnan(watch.map.tile.pose[0])


def test_a_snapshot_that_cannot_be_written_is_counted(start, peer, tmp_path):
    """And the older one stays."""
    snapshot = f'[snapshot]\npath = "{tmp_path}/map"\nperiod_s = 0.1'
    daemon, watch = start(rest=snapshot), Watch(URL)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: watch.status is not None and watch.status["n_beams"] > 0)
    written = watch.status["counts"]["snapshots_written"]
    wait_until(watch, lambda: watch.status["counts"]["snapshots_written"] > written + 1)
    resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
    wait_until(watch, lambda: watch.status["counts"]["snapshots_failed"] > 1)
    assert daemon.stop() == 0
    assert restored(start(rest=snapshot))[0] > 0


def test_a_smaller_beam_max_loses_no_snapshot(start, peer, tmp_path):
    """The youngest beams are taken, the whole snapshot stays beside; with the former beam_max it is
    read again."""
    snapshot = f'[snapshot]\npath = "{tmp_path}/map"\nperiod_s = 0.2'
    daemon, watch = start(rest=snapshot, map="beam_max = 4000\nkeep_m = 0.0"), Watch(URL)
    for i in range(40):
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i + 1)))
    n_beams = 40 * N_BEAMS
    wait_for_status(watch, scans_inserted=40)
    assert daemon.stop() == 0
    small, watch = start(rest=snapshot, map="beam_max = 500\nkeep_m = 0.0"), Watch(URL)
    assert restored(small)[0] == 500
    said = "".join(small.lines)
    assert f"; {n_beams - 500} did not fit" in said
    kept = re.search(r"larger map.beam_max; gpomd keeps all of it in (\S+)", said)[1]
    wait_until(watch, lambda: watch.status is not None
               and watch.status["counts"]["snapshots_written"] > 2)
    assert small.stop() == 0
    for slot in (0, 1):
        (tmp_path / f"map.{slot}").unlink()
    pathlib.Path(kept).rename(kept.removesuffix(".larger"))
    again = start(rest=snapshot, map="beam_max = 4000\nkeep_m = 0.0")
    assert restored(again)[0] == n_beams


def test_a_snapshot_folder_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "gpomd.toml"
    path.write_text(config_text(rest='[snapshot]\npath = "none/map"'))
    done = run("gpomd", "--config", path)
    assert done.returncode == 2 and f"{tmp_path}/none/map.0: cannot open" in done.stderr


def test_two_daemons_do_not_write_the_same_snapshots(start, tmp_path):
    """The second one says so and leaves; after the first one's end, killed or not, it may."""
    snapshot = f'[snapshot]\npath = "{tmp_path}/map"\nperiod_s = 1000'
    for how, code in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGTERM, 0)):
        daemon = start(rest=snapshot)
        second = run("gpomd", "--config", daemon.config)
        assert second.returncode == 2 and second.stderr.count("\n") == 1
        assert f"{tmp_path}/map.0: another process writes its snapshots here" in second.stderr
        assert daemon.stop(how) == code


# ---- gpom-watch ---------------------------------------------------------------------------------

def test_gpom_watch_draws_the_map_and_prints_it(start, street, tmp_path):
    start()
    replay(street)
    picture = tmp_path / "map.png"
    done = run("gpom-watch", "--settled", "--out", picture, "--json")
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and '"is_whole": true' in done.stdout
    status = run("gpom-watch", "--status")
    assert status.returncode == 0 and '"scans_inserted": 40' in status.stdout
    with subprocess.Popen([tool("gpom-watch")], stdout=subprocess.PIPE, text=True) as live:
        drawn = ""
        while not ("R" in drawn and "#" in drawn and "losses, whole" in drawn):
            line = live.stdout.readline()
            assert line, drawn
            drawn += line
        live.terminate()
    assert run("gpom-watch", "--seconds", "0.5").returncode == 0


def test_gpom_watch_lists_the_channels_of_the_bus(start, peer):
    """With the types that it knows, and the fingerprints of others."""
    start()
    watch, stop = Watch(URL), threading.Event()

    def send():
        for i in range(10**6):
            if stop.wait(0.05):
                return
            watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i)))
            watch.bus.publish("CAMERA", bytes(range(1, 90)))
    sender = threading.Thread(target=send)
    sender.start()
    try:
        done = run("gpom-watch", "--channels", "--seconds", 2)
    finally:
        stop.set()
        sender.join()
    assert done.returncode == 0, done.stderr
    head, *lines = done.stdout.splitlines()
    assert head.split() == ["channel", "messages/s", "bytes/s", "type"]
    rows = {line.split()[0]: line.split(None, 3)[1:] for line in lines}
    assert rows["GPOM_SCAN"][2] == "gpom.scan_t" and rows["GPOM_STATUS"][2] == "gpom.status_t"
    assert rows["CAMERA"][2] == "not known, fingerprint 0x0102030405060708"
    for rate_hz, n_bytes in ((float(rows[name][0]), float(rows[name][1]))
                             for name in ("GPOM_SCAN", "CAMERA")):
        assert 0 < rate_hz <= 20.5 and n_bytes >= 89 * rate_hz - 50


def test_gpom_watch_says_when_nothing_comes():
    done = run("gpom-watch", "--status", "--seconds", "0.5")
    assert done.returncode == 2 and "gpomd is not running" in done.stderr
    done = run("gpom-watch", "--channels", "--seconds", "0.5")
    assert done.returncode == 2 and "nobody sends on udpm://239.255.76.67" in done.stderr


@pytest.mark.parametrize("command, meant", [
    (["gpomd", "--confg", "x"], "--config"), (["gpom-replay", "--rat=3", "x"], "--rate"),
    (["gpom-watch", "--stauts"], "--status"), (["gpom-query", "--scnas", "x"], "--scans"),
    (["gpom-query", "--nothing-like-it"], None)])
def test_a_mistyped_option_is_answered_with_what_was_meant(command, meant):
    done = run(*command)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    if meant is None:
        assert "did you mean" not in done.stderr
    else:
        assert f"; did you mean {meant}?; see {command[0]} --help" in done.stderr
