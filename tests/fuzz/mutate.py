"""Damage done to files, by a seeded random generator: to their bytes, to their numbers, to their structure."""

from __future__ import annotations

import copy
import json
import re
import struct
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

import yaml

NUMBERS = ("0", "-1", "1e308", "-1e308", "1e-308", "NaN", "Infinity", "1e6", "123456789012345678901234567890", "0.0001")
"""Numbers that readers stumble over."""

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 3, 1e6, -1e6, 1e308, 1e-308, float("nan"), float("inf"), 10**30, 0.001, "", "x", "1", "NaN",
    "../..", "a" * 1000, "\x00", [], {}, [[]], [1], [1, 2, 3], {"x": 1}, [None], ["a", "b"], [[1, 2], [3, 4]],
)  # fmt: skip
"""What stands in the place of a value."""

_BYTES = (
    b"\x00",
    b"\xff",
    b"\x7f",
    b"\x80",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x00",
    b"\x00\x00\x80\x7f",
    b"{",
    b"\n",
)
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def mutate_bytes(data: bytes, rng: Random) -> bytes:
    """One to four changes: bits, bytes, and stretches that are cut out, doubled or moved."""
    for _ in range(rng.randint(1, 4)):
        if not data:
            return bytes(rng.randrange(256) for _ in range(rng.randint(0, 20)))
        at, length = rng.randrange(len(data)), rng.choice((1, 2, 4, 16, 64, 256))
        piece = data[at : at + length]
        match rng.randrange(7):
            case 0:
                data = data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
            case 1:
                chosen = rng.choice(_BYTES)
                data = data[:at] + chosen + data[at + len(chosen) :]
            case 2:
                data = data[:at] + data[at + length :]
            case 3:
                data = data[:at] + piece * rng.randint(2, 20) + data[at + length :]
            case 4:
                data = data[:at]
            case 5:
                to = rng.randrange(len(data))
                data = data[:to] + piece + data[to + len(piece) :]
            case _:
                data = data[:at] + bytes(rng.randrange(256) for _ in range(rng.randint(1, 8))) + data[at:]
    return data


def mutate_numbers(data: bytes, rng: Random) -> bytes:
    """One to three numbers of a text become others."""
    for _ in range(rng.randint(1, 3)):
        found = list(_NUMBER.finditer(data[:20_000]))
        if not found:
            return mutate_bytes(data, rng)
        chosen = rng.choice(found)
        old = chosen.group()
        new = rng.choice((rng.choice(NUMBERS).encode(), b"-" + old, old + b"0", b"0." + old.lstrip(b"-"), b""))
        data = data[: chosen.start()] + new + data[chosen.end() :]
    return data


def mutate_tree(tree: Any, rng: Random) -> Any:
    """One to three changes to nested mappings and lists: values, keys, how often, how deep."""
    tree = copy.deepcopy(tree)
    for _ in range(rng.randint(1, 3)):
        places = list(_places(tree))
        if not places:
            return rng.choice(VALUES)
        holder, key = rng.choice(places)
        match rng.randrange(8):
            case 0 | 1 | 2:
                holder[key] = copy.deepcopy(rng.choice(VALUES))
            case 3:
                del holder[key]
            case 4:
                holder[key] = [holder[key]] if rng.random() < 0.5 else {"x": holder[key]}
            case 5 if isinstance(holder[key], (int, float)) and not isinstance(holder[key], bool):
                holder[key] = holder[key] * rng.choice((-1, 0, 1e-3, 10, 1000, 1e12))
            case 6 if isinstance(holder, list):
                holder.extend(copy.deepcopy(holder[key]) for _ in range(rng.randint(1, 50)))
            case 7 if isinstance(holder, dict):
                holder[str(rng.choice(VALUES))] = holder.pop(key)
            case _:
                other, which = rng.choice(places)
                holder[key] = copy.deepcopy(other[which]) if which in _keys(other) else None
    return tree


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Every mapping or list with each of its keys."""
    found, todo = [], [tree]
    while todo:
        holder = todo.pop()
        for key in _keys(holder):
            found.append((holder, key))
            if isinstance(holder[key], (dict, list)):
                todo.append(holder[key])
    return found


def _keys(holder: Any) -> list[Any]:
    return list(holder) if isinstance(holder, dict) else list(range(len(holder)))


def mutate_json(data: bytes, rng: Random) -> bytes:
    """Mostly the structure, sometimes the text."""
    if rng.random() < 0.75:
        return json.dumps(mutate_tree(json.loads(data), rng)).encode()
    return _text(data, rng)


def mutate_lines(data: bytes, rng: Random) -> bytes:
    """JSON lines: one of them changes, or the text does."""
    lines = data.splitlines()
    k = rng.randrange(len(lines))
    lines[k] = mutate_json(lines[k], rng)
    return b"\n".join(lines) + b"\n"


def mutate_yaml(data: bytes, rng: Random) -> bytes:
    """Mostly the structure, sometimes the text."""
    if rng.random() < 0.6:
        return yaml.safe_dump(mutate_tree(yaml.safe_load(data), rng)).encode()
    return _text(data, rng)


def _text(data: bytes, rng: Random) -> bytes:
    return mutate_numbers(data, rng) if rng.random() < 0.5 else mutate_bytes(data, rng)


def mutate_pgm(data: bytes, rng: Random) -> bytes:
    """The header's numbers or the bytes."""
    head, body = data[:15], data[15:]
    return mutate_numbers(head, rng) + body if rng.random() < 0.4 else mutate_bytes(data, rng)


def mutate_mesh(data: bytes, rng: Random) -> bytes:
    """Text by numbers, a GLB also by its JSON, either by bytes."""
    if data.startswith(b"glTF") and rng.random() < 0.5:
        length = struct.unpack("<I", data[12:16])[0]
        tree = json.dumps(mutate_tree(json.loads(data[20 : 20 + length]), rng)).encode()
        tree += b" " * (-len(tree) % 4)
        rest = data[20 + length :]
        return b"glTF" + struct.pack("<IIII", 2, 20 + len(tree) + len(rest), len(tree), 0x4E4F534A) + tree + rest
    is_text = b"\x00" not in data
    return mutate_numbers(data, rng) if is_text and rng.random() < 0.6 else mutate_bytes(data, rng)


def mutate_png(data: bytes, rng: Random) -> bytes:
    """Bytes of a chunk with its checksum made right again, whole chunks, or any bytes."""
    if rng.random() < 0.3:
        return mutate_bytes(data, rng)
    chunks, at = [], 8
    while at < len(data):
        length = struct.unpack(">I", data[at : at + 4])[0]
        chunks.append([data[at + 4 : at + 8], data[at + 8 : at + 8 + length]])
        at += 12 + length
    k = rng.randrange(len(chunks))
    change: Callable[[], None] = rng.choice(
        (
            lambda: chunks[k].__setitem__(1, mutate_bytes(chunks[k][1], rng)),
            lambda: chunks[0].__setitem__(1, _other_header(chunks[0][1], rng)),
            lambda: chunks.insert(rng.randrange(len(chunks)), list(chunks[k])),
            lambda: chunks.pop(k) and None,
        )
    )
    change()
    return data[:8] + b"".join(_chunk(kind, body) for kind, body in chunks)


def _other_header(header: bytes, rng: Random) -> bytes:
    """Another width, height, depth or kind of colour."""
    width, height, depth, colour, *rest = struct.unpack(">IIBBBBB", header.ljust(13, b"\0")[:13])
    sizes = (0, 1, 7, 100, 20_000, 2**31 - 1)
    match rng.randrange(4):
        case 0:
            width = rng.choice(sizes)
        case 1:
            height = rng.choice(sizes)
        case 2:
            depth = rng.choice((0, 1, 2, 4, 8, 16, 32))
        case _:
            colour = rng.choice((0, 2, 3, 4, 6, 7))
    return struct.pack(">IIBBBBB", width, height, depth, colour, *rest)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
