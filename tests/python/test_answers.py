"""Answers, parameters and scans of the package are those of the C library and of gpom-query, bit
for bit; threads may share a map."""
import csv
import ctypes
import pathlib
import re
import threading

import gpom
import numpy as np
import pytest

N_POINTS = 10_000


@pytest.fixture(scope="module")
def street(run, tmp_path_factory):
    """Scans and parameters as files, and points."""
    folder = tmp_path_factory.mktemp("street")
    run("gpom-sim", "--seed", 5, "--out", folder / "scans.csv")
    (folder / "params.toml").write_text(gpom.preset("street").to_toml())
    points = np.random.default_rng(1).uniform((-20.0, -20.0), (170.0, 140.0), (N_POINTS, 2))
    np.savetxt(folder / "points.csv", points, delimiter=",", fmt="%.17g")
    return folder, points


@pytest.fixture(scope="module")
def recording(street):
    return gpom.io.read(street[0] / "scans.csv")


def asked(run, street, *words):
    """(mean, variance, probability) of gpom-query, float32."""
    folder, _ = street
    run("gpom-query", "--scans", folder / "scans.csv", "--params", folder / "params.toml",
        "--points", folder / "points.csv", "--out", folder / "out.csv", *words)
    with open(folder / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return [np.array([row[name] for row in rows], np.float32)
            for name in ("mean", "variance", "probability")]


@pytest.mark.parametrize("words, live", [((), False), (("--live", "--beam-max", "300"), True)])
def test_answers_are_those_of_gpom_query(run, street, recording, words, live):
    expected = asked(run, street, *words)
    made = gpom.map_of(recording.scans, gpom.preset("street"), live=live,
                       beam_max=300 if live else None)
    answers = made.query(street[1])
    for name, values in zip(("mean", "variance", "probability"), expected):
        assert np.array_equal(answers[name].view(np.uint32), values.view(np.uint32)), name


def answers_of_c(peer, scans, record, points):
    """What the C library alone answers (peer.c)."""
    heads = np.array([(*scan.pose, scan.angle_min_rad, scan.angle_step_rad,
                       scan.sensor.range_max_m) for scan in scans])
    stamps_us = np.array([scan.stamp_us for scan in scans], np.int64)
    ranges_m = np.stack([scan.ranges_m for scan in scans])
    assert peer.peer_map(record, ctypes.c_size_t(len(record)), ctypes.c_void_p(heads.ctypes.data),
                         ctypes.c_void_p(stamps_us.ctypes.data),
                         ctypes.c_void_p(ranges_m.ctypes.data), *ranges_m.shape) == 0
    answers = np.empty(len(points), gpom.ANSWER)
    assert peer.peer_query(ctypes.c_void_p(points.ctypes.data), ctypes.c_size_t(len(points)),
                           ctypes.c_void_p(answers.ctypes.data)) == 0
    return answers


def test_answers_are_those_of_the_c_library(peer, street, recording):
    params = gpom.preset("street")
    expected = answers_of_c(peer, recording.scans, params.to_record(), street[1])
    answers = gpom.map_of(recording.scans, params, live=False).query(street[1])
    assert answers.tobytes() == expected.tobytes()


def test_a_raster_answers_as_its_points(recording):
    made = gpom.map_of(recording.scans, gpom.preset("street"), live=False)
    raster = made.query_raster(10.0, 20.0, 0.5, 40, 30)
    x_m, y_m = np.meshgrid(10.0 + 0.5 * (np.arange(40) + 0.5), 20.0 + 0.5 * (np.arange(30) + 0.5))
    points = np.stack([x_m.ravel(), y_m.ravel()], axis=1)
    assert raster.tobytes() == made.query(points).tobytes()


def test_points_of_other_types_and_layouts_are_answered_alike(recording):
    made = gpom.map_of(recording.scans, gpom.preset("street"), live=False)
    points = np.array([[30.0, 40.0], [50.0, 60.0], [70.0, 80.0]])
    expected = made.query(points).tobytes()
    assert made.query(points.tolist()).tobytes() == expected
    assert made.query(np.asfortranarray(points)).tobytes() == expected
    assert made.query(points.astype(np.float32)).tobytes() == expected


def test_a_snapshot_restores_the_map_and_gpomd_could_read_it(recording):
    params = gpom.preset("street")
    made = gpom.map_of(recording.scans, params)
    stored = made.snapshot()
    other = gpom.Map(params, beam_max=16384, keep_m=0.05, clear_scans=3)
    report = other.restore(stored)
    points = np.random.default_rng(2).uniform(0.0, 100.0, (500, 2))
    assert report["n_beams"] == made.n_beams and not report["params_differ"]
    assert other.query(points).tobytes() == made.query(points).tobytes()


def test_every_damaged_snapshot_is_refused_and_the_map_stays(recording):
    made = gpom.map_of(recording.scans[:3], gpom.preset("street"))
    stored = made.snapshot()
    random = np.random.default_rng(3)
    before = made.query([[50.0, 50.0]]).tobytes()
    for at in random.integers(0, len(stored), 50):
        damaged = bytearray(stored)
        damaged[at] ^= 1 << int(random.integers(8))
        with pytest.raises(gpom.Error) as refused:
            made.restore(bytes(damaged[:at] if at % 2 else damaged))
        assert refused.value.status == -7
    assert made.query([[50.0, 50.0]]).tobytes() == before


def test_the_low_resolution_map_equals_queries_of_its_centres(recording):
    params = gpom.preset("street")
    made = gpom.map_of(recording.scans, params, lowres_cell_m=1.0, lowres_nx=60, lowres_ny=40,
                       lowres_x0_m=20.0, lowres_y0_m=30.0)
    while made.step(10_000_000):
        pass
    cells, info = made.lowres()
    answers = made.query_raster(info["x0_m"], info["y0_m"], info["cell_m"], 60, 40)
    assert info["n_dirty"] == 0 and cells.shape == (40, 60)
    exact = 65535.0 * answers["probability"].astype(float)
    assert np.all(np.abs(cells["probability"] - exact) <= 0.51)
    grid = made.lowres_grid()
    assert np.array_equal(grid.cls, cells["cls"])
    own = made.grid(1.0, (20.0, 30.0, 80.0, 70.0))  # the package's rule for unknown, and the core's
    assert np.array_equal(own.cls, cells["cls"]) and np.any(cells["cls"] == gpom.UNKNOWN)


def test_distances_are_those_of_brute_force(recording):
    """To the nearest occupied cell, and to the nearest that is not free, with the gradient away."""
    made = gpom.map_of(recording.scans, gpom.preset("street"), lowres_cell_m=1.0, lowres_nx=60,
                       lowres_ny=40, lowres_x0_m=20.0, lowres_y0_m=30.0)
    while made.step(10_000_000):
        pass
    cls = made.lowres()[0]["cls"]
    iy, ix = np.indices(cls.shape)
    centres = np.stack([20.5 + ix.ravel(), 30.5 + iy.ravel()], axis=1)
    for name, chosen in ("occupied", cls == gpom.OCCUPIED), ("not_free", cls != gpom.FREE):
        field = made.distances(centres)[name]
        away = centres[:, None] - centres[chosen.ravel()][None]
        expected_m = np.sqrt((away ** 2).sum(axis=2)).min(axis=1)
        assert np.allclose(field["distance_m"], expected_m, atol=1e-4) and expected_m.max() > 2
        far = expected_m > 0
        length = np.hypot(field["grad_x"], field["grad_y"])
        assert np.allclose(length[far], 1.0, atol=1e-5)
        nearest = centres - field["distance_m"][:, None] * np.stack([field["grad_x"],
                                                                     field["grad_y"]], axis=1)
        at = np.rint(nearest - [20.5, 30.5]).astype(int)
        assert np.all(chosen[at[far, 1], at[far, 0]])


def test_sectors_are_free_as_far_as_the_cells_are(recording):
    """Along the bearing of each sector: the cells at steps of 5 cm up to free_m are free."""
    made = gpom.map_of(recording.scans, gpom.preset("street"), lowres_cell_m=0.5, lowres_nx=200,
                       lowres_ny=200, lowres_x0_m=20.0, lowres_y0_m=20.0)
    while made.step(10_000_000):
        pass
    cls = made.lowres()[0]["cls"]
    x_m, y_m, yaw_rad = recording.scans[10].pose
    sectors = made.sectors((x_m, y_m, yaw_rad), range_m=15.0, n_sectors=36)
    assert len(sectors) == 36 and np.any(sectors["free_m"] > 5.0)
    for i, sector in enumerate(sectors):
        bearing_rad = yaw_rad + 2.0 * np.pi * i / 36
        steps_m = np.arange(0.0, sector["free_m"] - 0.01, 0.05)
        cells = [cls[int((y_m + r * np.sin(bearing_rad) - 20.0) / 0.5),
                     int((x_m + r * np.cos(bearing_rad) - 20.0) / 0.5)] for r in steps_m]
        assert all(cell == gpom.FREE for cell in cells)


def test_a_path_is_as_dangerous_as_its_worst_sample(recording):
    made = gpom.map_of(recording.scans, gpom.preset("street"), live=False)
    ends = np.array([[30.0, 40.0], [60.0, 40.0]])
    worst = made.query_path(ends, 0.0, 0.25)
    line = np.stack([np.linspace(30.0, 60.0, 121), np.full(121, 40.0)], axis=1)
    assert worst["probability"] == made.query(line)["probability"].max()
    assert worst["x_m"] == line[int(np.argmax(made.query(line)["probability"])), 0]


def test_a_sweep_with_equal_poses_is_the_scan(recording):
    params, scan = gpom.preset("street"), recording.scans[0]
    one, other = gpom.Map(params), gpom.Map(params)
    one.insert(scan)
    n = len(scan.ranges_m)
    other.insert(gpom.Scan(scan.stamp_us, scan.ranges_m, 0.0, 0.0, scan.pose, scan.sensor, None,
                           scan.bearings().astype(np.float32), np.tile(scan.pose, (n, 1))))
    a, b = one.beams(), other.beams()
    assert len(a) == len(b) > 0
    assert np.allclose(a["dir_x"], b["dir_x"], atol=1e-6) and np.array_equal(a["range_m"],
                                                                             b["range_m"])


def test_threads_query_one_map_while_another_inserts(recording):
    """Each answer is that of the map before or after a scan, never of half a scan."""
    params, point = gpom.preset("street"), [[recording.scans[5].pose[0] + 1.0,
                                             recording.scans[5].pose[1]]]
    allowed = set()
    made = gpom.Map(params, beam_max=1000)
    for scan in [None, *recording.scans]:
        if scan is not None:
            made.insert(scan)
        allowed.add(made.query(point).tobytes())
    made = gpom.Map(params, beam_max=1000)
    seen = []

    def ask():
        while not done.is_set():
            seen.append(made.query(point).tobytes())
    done = threading.Event()
    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for scan in recording.scans:
        made.insert(scan)
    done.set()
    for thread in threads:
        thread.join()
    assert seen and set(seen) <= allowed


def test_a_long_query_lets_other_threads_run(recording):
    """Another thread counts while a query runs. With Python's lock held it would count only beside
    the query: some 50,000, for the few milliseconds of a change of threads."""
    made = gpom.map_of(recording.scans, gpom.preset("street"), live=False)
    points = np.random.default_rng(4).uniform(0.0, 150.0, (300_000, 2))
    counted = [0]
    done = threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    made.query(points)
    during = counted[0] - before
    done.set()
    thread.join()
    assert during > 400_000


# --- Parameters ---------------------------------------------------------------------------------

@pytest.mark.parametrize("name", gpom.preset_names())
def test_a_preset_survives_toml_and_record(name):
    params = gpom.preset(name)
    params.check()
    assert gpom.Params.from_toml(params.to_toml()) == params
    assert gpom.Params.from_record(params.to_record()).to_record() == params.to_record()


def test_a_refused_parameter_is_named_with_its_value():
    with pytest.raises(gpom.Error, match=r"sf2.*-1.*out of range") as refused:
        gpom.Params(sf2=-1.0).check()
    assert refused.value.status == -3


@pytest.mark.parametrize("call, error, text", [
    (lambda: gpom.Params(hits=3), TypeError, "'hits'"),
    (lambda: gpom.Params(kernel="rbf"), ValueError, "nn, matern12"),
    (lambda: gpom.Map(gpom.Params(), beams=3), TypeError, "gpom_config_t"),
    (lambda: gpom.Map(gpom.Params(), keep_m=-1.0), gpom.Error, "keep_m"),
    (lambda: gpom.preset("moon"), ValueError, "indoor"),
    (lambda: gpom.Map(gpom.Params()).query([1.0, 2.0]), ValueError, "points: .*2 columns"),
    (lambda: gpom.Map(gpom.Params()).insert_scan([1.0], 0.0, 0.1, [0.0, 0.0]), ValueError,
     "pose: must be three numbers"),
    (lambda: gpom.Map(gpom.Params()).insert_scan([1.0], 0.0, 0.1, [np.nan, 0.0, 0.0]), gpom.Error,
     "stamp_us 0"),
    (lambda: gpom.simulate_street(n_beam=3), TypeError, "n_beam"),
    (lambda: gpom.simulate_street(n_beams=-3), ValueError, "beams"),
])
def test_a_wrong_argument_is_named(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_every_counter_is_there():
    """stats() and gpom_stats_t have the same names."""
    header = pathlib.Path(__file__).resolve().parents[2] / "include" / "gpom" / "map.h"
    body = re.search(r"typedef struct \{([^}]*)\} gpom_stats_t;", header.read_text()).group(1)
    assert list(gpom.Map(gpom.Params()).stats()) == re.findall(r"uint64_t (\w+);", body)


def test_every_field_of_a_beam_is_there(recording):
    """beams() has the fields of gpom_beam_t."""
    header = pathlib.Path(__file__).resolve().parents[2] / "include" / "gpom" / "map.h"
    body = re.search(r"typedef struct \{([^}]*)\} gpom_beam_t;", header.read_text()).group(1)
    names = re.findall(r"^    \w+ (\w+);", body, re.MULTILINE)
    beams = gpom.map_of(recording.scans, gpom.preset("street")).beams()
    assert sorted(beams.dtype.names) == sorted(names) and len(names) > 15
    assert np.allclose(np.hypot(beams["dir_x"], beams["dir_y"]), 1.0, atol=1e-6)


def test_the_simulator_is_gpom_sim(run, tmp_path):
    run("gpom-sim", "--seed", 9, "--scans", 6, "--out", tmp_path / "s.csv", "--truth",
        tmp_path / "t.pgm")
    street = gpom.simulate_street(seed=9, n_scans=6)
    gpom.io.write_scans(tmp_path / "python.csv", street.scans)
    lines = [[line for line in (tmp_path / name).read_text().splitlines() if line[0] != "#"]
             for name in ("s.csv", "python.csv")]
    assert lines[0] == lines[1]
    image = (tmp_path / "t.pgm").read_bytes()[-street.occupied.size:]
    assert np.array_equal(np.frombuffer(image, np.uint8).reshape(street.occupied.shape)[::-1] == 0,
                          street.occupied == 1)
