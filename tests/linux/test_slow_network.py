"""A network interface that is far slower than the map: nothing but the map may wait for it.

What is sent on it also comes back to this machine at once, and that is what the tests hear."""
import re
import signal
import socket
import subprocess

import pytest
from conftest import PATIENCE_S, URL, config_text, encoded, wait_for_status, wait_until
from gpom_watch import Watch
from test_links import send, set_up_pair

TOP = f'lcm_url = "{URL.replace("ttl=0", "ttl=1")}"'
N_SCANS = 60
RASTER = "cell_m = 0.25\nnx = 320\nny = 320\ncorner = [0.0, 50.0]"


def set_up_slow_pair():
    """8 kbit/s: a tile takes more than a second, a whole map four minutes."""
    subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
    set_up_pair()
    done = subprocess.run("tc qdisc add dev pair0 root tbf rate 8kbit burst 3000 limit 20000000"
                          .split(), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"no slow interface can be made here: {done.stderr}")


@pytest.mark.campaign
def test_a_slow_network_holds_up_neither_scans_nor_answers_nor_watchdog_nor_stop(
        start, peer, tmp_path):
    """liblcm would wait in each of them until the network took the message: minutes here. What did
    not go out is told."""
    set_up_slow_pair()
    path = str(tmp_path / "notify")
    query = encoded(peer("gpom.query_t", client=1, n_points=1,
                         points=[peer("gpom.point_t", x=20.0, y=80.0)]))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(path)
        listener.settimeout(PATIENCE_S)
        text = config_text(top=TOP, raster=RASTER,
                           publish='keyframe_s = 0.2\npixels = "PIXEL_MAP"')
        daemon = start(text=text.replace("status_s = 0.1", "status_s = 0.5"),  # few: all have room
                       environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "300000"})
        watch = Watch(URL)
        send(peer, 0)
        wait_until(watch, lambda: watch.map.n_tiles > 2)  # the interface has more than it can take
        for i in range(1, N_SCANS):
            send(peer, i)
            watch.bus.publish("GPOM_QUERY", query)
            if i % 20 == 19:  # fewer than may wait in gpomd
                wait_for_status(watch, scans_inserted=i + 1, queries_answered=i)
        assert watch.status["counts"]["scans_received"] == N_SCANS
        heard = [listener.recv(100) for _ in range(N_SCANS)]
        assert heard[0] == b"READY=1" and set(heard[1:]) == {b"WATCHDOG=1"}
        assert daemon.stop(signal.SIGTERM) == 0
    assert re.search(r"[1-9]\d* messages not sent", "".join(daemon.lines)), daemon.lines


@pytest.mark.campaign
def test_answers_beyond_what_the_network_takes_are_dropped_and_counted(start, peer):
    """The socket of answers holds a few hundred; the status, which has another one, goes out."""
    set_up_slow_pair()
    start(top=TOP, publish="map_hz = 0.01")
    points = [peer("gpom.point_t", x=20.0, y=80.0)] * 80
    query, watch = encoded(peer("gpom.query_t", client=1, n_points=80, points=points)), Watch(URL)

    def is_counted():
        watch.bus.publish("GPOM_QUERY", query)
        return watch.status is not None and watch.status["counts"]["messages_not_sent"] > 10
    wait_until(watch, is_counted)
    counts = watch.status["counts"]
    assert counts["queries_answered"] > 10
    assert counts["queries_refused"] >= counts["messages_not_sent"] > 10
