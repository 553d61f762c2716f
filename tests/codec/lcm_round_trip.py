"""Messages over real LCM to codec-echo and back; prints "N of N came back", exit code 0 if all did.

usage: lcm_round_trip.py CODEC_ECHO LOG < MESSAGES, with PYTHONPATH naming lcm-gen's Python modules

Run in a network namespace of its own, with loopback up and its multicast route: what is sent must
not leave. Each message of MESSAGES (hex, one a line) is sent by PyPI's liblcm, which fragments the
large ones, received and sent by the codec's own datagrams, and received by liblcm again. LOG is
where the distribution's lcm-logger, another version of liblcm, writes all that passed.
"""
import pathlib
import subprocess
import sys
import time

import lcm

GROUP, PORT, CHANNEL = "239.255.76.67", "7667", "TO_CODEC"
URL = f"udpm://{GROUP}:{PORT}?ttl=0&recv_buf_size=4194304"
PATIENCE_S = 60  # UDP may lose; a message is sent again, and again, until then


def exchange(bus, received, message):
    """True if the message came back with the same bytes; answers to earlier ones may come late."""
    del received[:]
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        bus.publish(CHANNEL, message)
        while bus.handle_timeout(300) > 0:
            if message in received:
                return True
    return False


def logged(path):
    """The messages that came back, as the logger wrote them so far."""
    if not path.exists():
        return set()
    return {event.data for event in lcm.EventLog(str(path), "r")
            if event.channel == CHANNEL + "_BACK"}


def complete_log(bus, path, messages):
    """How many of the messages the log has; what it lacks is sent again until it has them all.

    The logger does not tell when it listens, loses what its socket cannot take, and writes what it
    heard only when something more comes.
    """
    until = time.monotonic() + PATIENCE_S
    missing = set(messages) - logged(path)
    while missing and time.monotonic() < until:
        for message in missing:
            bus.publish(CHANNEL, message)
            time.sleep(0.1)
        missing = set(messages) - logged(path)
    return len(messages) - len(missing)


def main():
    codec_echo, log = sys.argv[1], pathlib.Path(sys.argv[2])
    messages = [bytes.fromhex(line) for line in sys.stdin]
    logger = subprocess.Popen(["/usr/bin/lcm-logger", "--quiet", "--force", "--flush-interval=100",
                               f"--lcm-url={URL}", str(log)], stdout=subprocess.DEVNULL)
    echo = subprocess.Popen([codec_echo, GROUP, PORT, CHANNEL], stdout=subprocess.PIPE, text=True)
    try:
        assert echo.stdout.readline() == "ready\n", "codec-echo did not start"
        bus = lcm.LCM(URL)
        received = []
        bus.subscribe(CHANNEL + "_BACK", lambda _, data: received.append(bytes(data)))
        n_same = sum(exchange(bus, received, message) for message in messages)
        n_logged = complete_log(bus, log, messages)
    finally:
        for process in echo, logger:
            process.terminate()
            process.wait()
    print(f"{n_same} of {len(messages)} came back, {n_logged} were logged")
    return 0 if n_same == n_logged == len(messages) else 1


if __name__ == "__main__":
    sys.exit(main())
