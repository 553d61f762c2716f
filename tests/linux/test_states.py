"""What gpomd says of how fresh its map is."""
from conftest import URL, config_text, encoded, scan, wait_until
from gpom_watch import Watch


def test_a_rare_status_tells_how_old_the_map_is_when_it_is_sent(start, peer):
    """The only scan comes right after a status: at the next one, seconds later, the map is stale,
    whether or not somebody looked in between."""
    start(text=config_text(publish="stale_s = 0.5").replace("status_s = 0.1", "status_s = 4.0"))
    watch, states = Watch(URL), []
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: states.append(
        peer.type("gpom.status_t").decode(data).state))
    wait_until(watch, lambda: states)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: states[-1] != 0)
    assert states[-1] == 2
