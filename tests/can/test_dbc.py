"""gpom.dbc as cantools reads it, against the C code: every signal, both ways, to its extremes."""
import ctypes
import os
import pathlib
import random

import cantools
import pytest
from cantools.database.can import Message, Signal
from cantools.database.conversion import LinearConversion

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = (ROOT / os.environ.get("GPOM_BUILD", "build/host-release")).resolve()
DBC = cantools.database.load_file(ROOT / "ports" / "can" / "gpom.dbc")
C = ctypes.CDLL(str(BUILD / "libgpom_can.so"))
C.gpom_can_signal_value.restype = ctypes.c_bool
SEED = int(os.environ.get("GPOM_SEED", "1"))
OK, LENGTH, CRC, COUNTER, VALUE = range(5)

U8, I8, I16, U32 = ctypes.c_uint8, ctypes.c_int8, ctypes.c_int16, ctypes.c_uint32


class Status(ctypes.Structure):
    _fields_ = [("alive", U8), ("state", U8), ("age", U8), ("sequence", U8), ("clearance", U8),
                ("bearing", I8), ("fill", U8), ("faults", U8)]


class Clearance(ctypes.Structure):
    _fields_ = [("alive", U8), ("i_part", U8), ("state", U8), ("sequence", U8),
                ("distance", U8 * 5)]


class ClearanceFd(ctypes.Structure):
    _fields_ = [("alive", U8), ("state", U8), ("sequence", U8), ("stamp_ms", U32),
                ("distance", U8 * 28), ("probability", U8 * 28), ("deviation", U8 * 28)]


class Tile(ctypes.Structure):
    _fields_ = [("alive", U8), ("state", U8), ("sequence", U8), ("tile_x", I8), ("tile_y", I8),
                ("cell_cm", U8), ("n_tiles", U8), ("stamp_ms", U32), ("reference_x", I16),
                ("reference_y", I16), ("probability", U8 * 64), ("deviation", U8 * 64)]


HEAD = {"Alive": "alive", "State": "state", "Sequence": "sequence"}
FAULTS = ("FaultScan", "FaultPose", "FaultLcm", "FaultCan", "FaultOverrun", "FaultFull")
# message: C struct, name of its functions, bytes of the CRC, data id, fields by signal
MESSAGES = {
    "GPOM_Status": (Status, "status", 1, 0x6A50, {
        **HEAD, "Age": "age", "MinClearance": "clearance", "Bearing": "bearing", "Fill": "fill"}),
    "GPOM_Clearance": (Clearance, "clearance", 1, 0x6A51, {
        **HEAD, "Part": "i_part",
        **{f"Distance{k:02}": ("distance", k % 5) for k in range(15)}}),
    "GPOM_ClearanceFd": (ClearanceFd, "clearance_fd", 2, 0x6A52, {
        **HEAD, "Stamp": "stamp_ms",
        **{f"{name}{k:02}": (name.lower(), k) for k in range(28)
           for name in ("Distance", "Probability", "Deviation")}}),
    "GPOM_Tile": (Tile, "tile", 2, 0x6A53, {
        **HEAD, "Stamp": "stamp_ms", "TileX": "tile_x", "TileY": "tile_y", "CellSize": "cell_cm",
        "Tiles": "n_tiles", "ReferenceX": "reference_x", "ReferenceY": "reference_y",
        **{f"{name}{k % 8}{k // 8}": (name.lower(), k) for k in range(64)
           for name in ("Probability", "Deviation")}}),
}


def remainder(data, polynomial, n_bits, start, final):
    """A CRC by long division of one large number: start value into the first bits."""
    number = int.from_bytes(data, "big") << n_bits
    number ^= start << (8 * len(data))
    for i in reversed(range(8 * len(data))):
        if number >> (i + n_bits) & 1:
            number ^= ((1 << n_bits) | polynomial) << i
    return number ^ final


def sealed(name, frame):
    """The frame with the CRC that it must have."""
    _, _, n_crc, data_id, _ = MESSAGES[name]
    tag = data_id.to_bytes(2, "little")
    if n_crc == 1:
        crc = remainder(tag + frame[1:], 0x1D, 8, 0xFF, 0xFF)
    else:
        crc = remainder(frame[2:] + tag, 0x1021, 16, 0xFFFF, 0)
    return crc.to_bytes(n_crc, "little") + frame[n_crc:]


def part_of(signal):
    return signal.multiplexer_ids[0] if signal.multiplexer_ids else None


def raw_range(signal):
    return ((-1 << (signal.length - 1), (1 << (signal.length - 1)) - 1) if signal.is_signed
            else (0, (1 << signal.length) - 1))


def allowed(signal):
    """Least and largest bits that the DBC allows, and those with a name."""
    scale = signal.conversion
    low = round((signal.minimum - scale.offset) / scale.scale)
    high = round((signal.maximum - scale.offset) / scale.scale)
    named = list(signal.choices or ())
    return [low, high, *named] if signal.name != "Part" else [low]


def fields_of(name, part):
    """Signals of a message, of one part, without the CRC."""
    return [signal for signal in DBC.get_message_by_name(name).signals
            if signal.name != "Crc" and part_of(signal) in (None, part)]


def random_values(name, part, random_):
    """Bits for each signal, within what the DBC allows."""
    values = {}
    for signal in fields_of(name, part):
        low, high = allowed(signal)[0], max(allowed(signal))
        values[signal.name] = random_.randint(low, high)
    if name == "GPOM_Clearance":
        values["Part"] = part
    if name == "GPOM_Status":
        values["Bearing"] = random_.choice([-128, *range(-90, 91)])
    return values


def struct_of(name, values):
    struct = MESSAGES[name][0]()
    for signal, value in values.items():
        if signal in FAULTS:
            struct.faults |= value << FAULTS.index(signal)
            continue
        place = MESSAGES[name][4][signal]
        if isinstance(place, tuple):
            getattr(struct, place[0])[place[1]] = value
        else:
            setattr(struct, place, value)
    return struct


def value_in(name, struct, signal):
    if signal in FAULTS:
        return struct.faults >> FAULTS.index(signal) & 1
    place = MESSAGES[name][4][signal]
    return getattr(struct, place[0])[place[1]] if isinstance(place, tuple) else getattr(
        struct, place)


def packed(name, struct):
    frame = (U8 * DBC.get_message_by_name(name).length)()
    getattr(C, f"gpom_can_{MESSAGES[name][1]}_pack")(ctypes.byref(struct), frame)
    return bytes(frame)


def unpacked(name, frame, length=None):
    struct = MESSAGES[name][0]()
    buffer = (U8 * max(len(frame), 1))(*frame)
    unpack = getattr(C, f"gpom_can_{MESSAGES[name][1]}_unpack")
    unpack.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]
    return unpack(ctypes.byref(struct), buffer, len(frame) if length is None else length), struct


def check_both_ways(name, values):
    message = DBC.get_message_by_name(name)
    frame = packed(name, struct_of(name, values))
    read = message.decode(frame, decode_choices=False, scaling=False)
    assert {signal: read[signal] for signal in values} == values
    assert sealed(name, frame) == frame, "CRC"
    encoded = sealed(name, message.encode({**values, "Crc": 0}, scaling=False, strict=False))
    fault, struct = unpacked(name, encoded)
    assert fault == OK
    assert {signal: value_in(name, struct, signal) for signal in values} == values


def all_signals():
    for name in MESSAGES:
        for part in (0, 1, 2) if name == "GPOM_Clearance" else (None,):
            for signal in fields_of(name, part):
                if part_of(signal) is not None or part in (None, 0):
                    yield name, part, signal


@pytest.mark.parametrize("name", MESSAGES)
def test_every_signal_of_the_dbc_is_a_field(name):
    signals = {signal.name for signal in DBC.get_message_by_name(name).signals}
    assert signals - {"Crc", *FAULTS} == set(MESSAGES[name][4])


@pytest.mark.parametrize("name, part, signal", [
    pytest.param(*row, id=f"{row[0]}.{row[2].name}") for row in all_signals()])
def test_signals_go_both_ways_extremes_and_unknown_included(name, part, signal):
    random_ = random.Random(SEED)
    for value in allowed(signal):
        check_both_ways(name, {**random_values(name, part, random_), signal.name: value})
        others = {other.name: allowed(other)[0] for other in fields_of(name, part)}
        if name == "GPOM_Clearance":
            others["Part"] = part
        if name == "GPOM_Status":
            others["Bearing"] = 0
        if signal.name != "Part":
            check_both_ways(name, {**others, signal.name: value})


@pytest.mark.parametrize("name", MESSAGES)
def test_random_messages_go_both_ways(name):
    random_ = random.Random(SEED)
    for i in range(100):
        check_both_ways(name, random_values(name, i % 3 if name == "GPOM_Clearance" else None,
                                            random_))


def test_unknown_is_a_value_of_its_own_in_every_message():
    for name, signals in {"GPOM_Status": ("Age", "MinClearance", "Bearing"),
                          "GPOM_Clearance": [f"Distance{k:02}" for k in range(15)],
                          "GPOM_ClearanceFd": [f"{what}{k:02}" for k in range(28) for what in
                                               ("Distance", "Probability", "Deviation")],
                          "GPOM_Tile": [f"Probability{k % 8}{k // 8}" for k in range(64)]}.items():
        for signal in signals:
            choices = DBC.get_message_by_name(name).get_signal_by_name(signal).choices
            assert "Unknown" in map(str, choices.values()), signal


def test_scaled_values_are_what_the_codes_say():
    frame = packed("GPOM_Clearance", struct_of("GPOM_Clearance", {
        "Alive": 1, "Part": 1, "State": 1, "Sequence": 9, "Distance05": 123, "Distance06": 254,
        "Distance07": 255, "Distance08": 0, "Distance09": 253}))
    read = DBC.decode_message("GPOM_Clearance", frame)
    assert read["State"] == "Mapping" and read["Distance05"] == pytest.approx(12.3)
    assert (read["Distance06"], read["Distance07"]) == ("Clear", "Unknown")
    assert (read["Distance08"], read["Distance09"]) == (0, pytest.approx(25.3))


@pytest.mark.parametrize("name", MESSAGES)
def test_wrong_lengths_and_any_bit_changed_are_refused(name):
    random_ = random.Random(SEED)
    part = 0 if name == "GPOM_Clearance" else None
    frame = packed(name, struct_of(name, random_values(name, part, random_)))
    assert unpacked(name, frame)[0] == OK
    for length in range(65):
        if length != len(frame):
            assert unpacked(name, frame.ljust(64, b"\0"), length)[0] == LENGTH
    for bit in range(8 * len(frame)):
        damaged = bytearray(frame)
        damaged[bit // 8] ^= 1 << bit % 8
        assert unpacked(name, damaged)[0] == CRC
    for other in MESSAGES:
        if other != name and len(frame) == DBC.get_message_by_name(other).length:
            assert unpacked(other, frame)[0] == CRC, "another message under this identifier"


def test_values_that_nothing_defines_are_refused():
    for name, bad in (("GPOM_Status", {"Alive": 15}), ("GPOM_Status", {"State": 4}),
                      ("GPOM_Status", {"Bearing": 91}), ("GPOM_Status", {"Fill": 101}),
                      ("GPOM_Clearance", {"Alive": 15}), ("GPOM_Clearance", {"Part": 3}),
                      ("GPOM_ClearanceFd", {"Alive": 15}), ("GPOM_Tile", {"Alive": 15}),
                      ("GPOM_Tile", {"CellSize": 0})):
        part = 0 if name == "GPOM_Clearance" else None
        values = {**random_values(name, part, random.Random(SEED)), **bad}
        assert unpacked(name, packed(name, struct_of(name, values)))[0] == VALUE, bad


# ---- signals of the configuration ---------------------------------------------------------------

class CSignal(ctypes.Structure):
    _fields_ = [("start_bit", ctypes.c_uint16), ("n_bits", U8), ("is_motorola", ctypes.c_bool),
                ("is_signed", ctypes.c_bool), ("factor", ctypes.c_double),
                ("offset", ctypes.c_double)]


def test_configured_signals_are_read_as_cantools_reads_them():
    random_ = random.Random(SEED)
    n_read = 0
    while n_read < 1500:
        n_bytes = random_.choice([8, 8, 8, 12, 64])
        length, order = random_.randint(1, 64), random_.choice(["little_endian", "big_endian"])
        start, is_signed = random_.randrange(8 * n_bytes), random_.random() < 0.5
        factor, offset = random_.choice([1.0, 0.0087, -0.5, 1e3]), random_.choice([0.0, -40.0])
        signal = Signal("s", start, length, order, is_signed,
                        conversion=LinearConversion(factor, offset, False))
        try:
            message = Message(1, "m", n_bytes, [signal], is_fd=n_bytes > 8)
        except cantools.database.errors.Error:
            continue  # fits no such frame
        n_read += 1
        frame = bytes(random_.randrange(256) for _ in range(n_bytes))
        low, high = raw_range(signal)
        for raw in (low, high, random_.randint(low, high), None):
            if raw is not None:
                frame = message.encode({"s": raw}, scaling=False, strict=False)
            value = ctypes.c_double()
            assert C.gpom_can_signal_value(
                ctypes.byref(CSignal(start, length, order == "big_endian", is_signed, factor,
                                     offset)), frame, ctypes.c_size_t(n_bytes),
                ctypes.byref(value)), signal
            assert value.value == pytest.approx(message.decode(frame)["s"], rel=1e-12, abs=1e-12)
