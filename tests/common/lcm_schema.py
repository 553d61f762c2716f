"""The definitions in lcmtypes/, read without lcm-gen: fields, fingerprints, random messages.

The fingerprint is LCM's: a hash over the members' names, primitive types and dimensions, to which
the members' own fingerprints are added; rotated left by one bit at every level.
"""
import dataclasses
import pathlib
import random
import re
import struct

LCMTYPES = pathlib.Path(__file__).resolve().parents[2] / "lcmtypes"
PRIMITIVES = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64, "byte": None,
              "float": None, "double": None}
MASK = 2**64 - 1


@dataclasses.dataclass
class Member:
    name: str
    type: str
    dims: list  # numbers, or names of earlier members


@dataclasses.dataclass
class Schema:
    package: str
    name: str
    members: list

    @property
    def full_name(self):
        return f"{self.package}.{self.name}"


def read(path):
    text = re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))
    package = re.search(r"package (\w+);", text).group(1)
    name, body = re.search(r"struct (\w+) \{(.*)\}", text, re.DOTALL).groups()
    members = []
    for statement in body.split(";"):
        if not statement.strip() or statement.split()[0] == "const":
            continue
        kind, names = statement.strip().split(None, 1)
        for declared in names.split(","):
            dims = [int(dim) if dim.isdigit() else dim
                    for dim in re.findall(r"\[(\w+)\]", declared)]
            members.append(Member(declared.split("[")[0].strip(), kind, dims))
    return Schema(package, name, members)


def read_all():
    """All definitions by full name."""
    schemas = [read(path) for path in sorted(LCMTYPES.glob("*.lcm"))]
    return {schema.full_name: schema for schema in schemas}


def _update(value, byte):
    signed = value - 2**64 if value >> 63 else value
    return (((value << 8) ^ (signed >> 55)) + byte) & MASK


def _update_text(value, text):
    value = _update(value, len(text))
    for byte in text.encode():
        value = _update(value, byte)
    return value


def fingerprint(schema, schemas, parents=()):
    if schema.full_name in parents:
        return 0
    value = 0x12345678
    for member in schema.members:
        value = _update_text(value, member.name)
        if member.type in PRIMITIVES:
            value = _update_text(value, member.type)
        value = _update(value, len(member.dims))
        for dim in member.dims:
            value = _update(value, 0 if isinstance(dim, int) else 1)
            value = _update_text(value, str(dim))
    for member in schema.members:
        if member.type not in PRIMITIVES:
            nested = schemas[f"{schema.package}.{member.type}"]
            value += fingerprint(nested, schemas, (*parents, schema.full_name))
    value &= MASK
    return (value << 1 | value >> 63) & MASK


def _element(kind, rng, make):
    if kind in ("float", "double"):
        number = rng.choice([rng.uniform(-1e3, 1e3), 0.0, -0.0, float("inf")])
        return struct.unpack(">f", struct.pack(">f", number))[0] if kind == "float" else number
    if bits := PRIMITIVES.get(kind):
        return rng.randrange(-2**(bits - 1), 2**(bits - 1))
    return make(kind)


def random_message(cls, schema, rng, fixed, make):
    """An object of lcm-gen's class with random fields; `fixed` gives some of them, among them all
    that are array sizes, and make(name) objects of a nested type."""
    message = cls()
    for member in schema.members:
        if member.name in fixed:
            value = fixed[member.name]
        elif not member.dims:
            value = _element(member.type, rng, make)
        else:
            (dim,) = member.dims
            size = dim if isinstance(dim, int) else getattr(message, dim)
            value = (rng.randbytes(size) if member.type == "byte" else
                     [_element(member.type, rng, make) for _ in range(size)])
        setattr(message, member.name, value)
    return message


def random_generator(seed):
    return random.Random(int(seed))
