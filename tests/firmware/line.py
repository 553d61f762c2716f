"""The device's serial line, written from ports/uart/frame.h and lcmtypes/ alone: an oracle.

Frames are made and taken apart here without the C code that they test; FrameModel counts what a
reader of a line must count.
"""
import struct
import zlib

FRAME_WINDOW = 32
DATAGRAM_MAX = 1472
BODY_MAX = DATAGRAM_MAX + 8


def cobs(body):
    """Consistent overhead byte stuffing: no zeros."""
    out = bytearray()
    piece = bytearray()
    for byte in body:
        if byte:
            piece.append(byte)
        if not byte or len(piece) == 254:
            out += bytes([len(piece) + 1]) + piece
            piece.clear()
    return bytes(out) + bytes([len(piece) + 1]) + bytes(piece)


def uncobs(text):
    """(body, whether the last piece is whole)."""
    body, at, zero = bytearray(), 0, False
    while at < len(text):
        if zero:
            body.append(0)
        n = text[at] - 1
        body += text[at + 1:at + 1 + n]
        if at + 1 + n > len(text):
            return bytes(body), False
        at, zero = at + 1 + n, n < 254
    return bytes(body), True


def frame(datagram, number):
    body = struct.pack(">HH", len(datagram), number) + datagram
    return b"\0" + cobs(body + struct.pack(">I", zlib.crc32(body))) + b"\0"


def datagram(channel, message, sequence=0):
    """A short LCM datagram."""
    return b"LC02" + struct.pack(">I", sequence) + channel.encode() + b"\0" + message


def next_number(number):
    return 1 if number == 65535 else number + 1


class FrameModel:
    """Takes a line apart: counts by cause, and the datagrams of whole frames."""

    def __init__(self):
        self.counts = dict.fromkeys(("frames_received", "frames_short", "frames_long",
                                     "frames_corrupt", "frames_repeated", "frames_lost"), 0)
        self.newest = None
        self._rest = b""

    def take(self, data):
        """Datagrams in these bytes, which go on where the last ones ended."""
        *texts, self._rest = (self._rest + data).split(b"\0")
        return [out for text in texts if text and (out := self._frame(text)) is not None]

    def _frame(self, text):
        body, is_whole = uncobs(text)
        if len(body) > BODY_MAX:
            cause = "long"
        elif not is_whole or len(body) < 8:
            cause = "short"
        else:
            n, number = struct.unpack(">HH", body[:4])
            n_there = len(body) - 8
            cause = "short" if n > n_there else "long" if n < n_there else None
            if cause is None and zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "big"):
                cause = "corrupt"
            if cause is None and not self._is_new(number):
                cause = "repeated"
        self.counts[f"frames_{cause or 'received'}"] += 1
        return body[4:-4] if cause is None else None

    def _is_new(self, number):
        if self.newest is not None and number != 0:
            ahead = (number - self.newest) % 65535
            if ahead == 0 or ahead >= 65535 - FRAME_WINDOW:
                return False
            if ahead < 65535 // 2:
                self.counts["frames_lost"] += ahead - 1
        self.newest = number
        return True


def fragments(channel, message, sequence):
    """LCM datagrams of a message that does not fit one, cut as liblcm does."""
    name, room = channel.encode() + b"\0", DATAGRAM_MAX - 20
    pieces = [message[:room - len(name)]]
    while (at := sum(map(len, pieces))) < len(message):
        pieces.append(message[at:at + room])
    offsets = [sum(map(len, pieces[:i])) for i in range(len(pieces))]
    return [b"LC03" + struct.pack(">IIIHH", sequence, len(message), offset, i, len(pieces))
            + (name if i == 0 else b"") + piece
            for i, (offset, piece) in enumerate(zip(offsets, pieces))]
