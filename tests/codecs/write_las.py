#!/usr/bin/env python3
"""Writes a LAS file from the format's public description alone (ASPRS LAS specifications 1.0 to 1.4).

    write_las.py FILE < JSON

JSON: version (minor), format, adjusted (GPS time, else of the week), wkt or epsg, scale, offset, points:
lists of x, y, z, time, class, source, withheld, overlap. All but points may be missing.
"""
import json
import struct
import sys

SIZES = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)


def record(number, body):
    return struct.pack("<H16sHH32s", 0, b"LASF_Projection", number, len(body), b"") + body


def records_of(spec):
    if "wkt" in spec:
        return [record(2112, spec["wkt"].encode() + b"\0")]
    if "epsg" in spec:
        keys = [(1024, 0, 1, spec.get("model", 1)), (spec.get("key", 3072), 0, 1, spec["epsg"])]
        if "vertical_unit" in spec:
            keys.append((4099, 0, 1, spec["vertical_unit"]))
        body = struct.pack("<4H", 1, 1, 0, len(keys)) + b"".join(struct.pack("<4H", *k) for k in keys)
        return [record(34735, body)]
    return []


def point_of(spec, kind, scale, offset):
    x, y, z, time, category, source, withheld, overlap = spec
    xyz = [round((value - o) / s) for value, s, o in zip((x, y, z), scale, offset)]
    head = struct.pack("<3iH", *xyz, 100)
    if kind < 6:
        flags = category | (0x80 if withheld else 0)
        body = head + struct.pack("<BBbBH", 0x09, flags, -3, 0, source)
        if kind in (1, 3, 4, 5):
            body += struct.pack("<d", time)
    else:
        flags = (4 if withheld else 0) | (8 if overlap else 0)
        body = head + struct.pack("<BBBBhHd", 0x11, flags, category, 0, -500, source, time)
    return body + b"\x5a" * (SIZES[kind] - len(body))


def main():
    spec = json.load(sys.stdin)
    minor, kind = spec.get("version", 2), spec.get("format", 1)
    first = spec["points"][0] if spec["points"] else [0.0] * 3
    scale, offset = spec.get("scale", [0.001] * 3), spec.get("offset", list(map(round, first[:3])))
    head_size = {3: 235, 4: 375}.get(minor, 227)
    records = records_of(spec)
    points = [point_of(p, kind, scale, offset) for p in spec["points"]]
    axes = list(zip(*[p[:3] for p in spec["points"]])) or [(0,)] * 3
    begin = head_size + sum(map(len, records))
    encoding = (1 if spec.get("adjusted") else 0) | (16 if "wkt" in spec else 0)
    head = struct.pack("<4sHH", b"LASF", 0, encoding) + bytes(16) + struct.pack("<BB", 1, minor)
    head += struct.pack("<32s32sHHHII", b"TEST", b"write_las.py", 1, 2026, head_size, begin, len(records))
    legacy = len(points) if kind < 6 else 0
    head += struct.pack("<BHI", kind | spec.get("compression", 0), SIZES[kind], legacy)
    head += struct.pack("<5I", legacy, 0, 0, 0, 0)
    head += struct.pack("<6d", *scale, *offset)
    for axis in axes:
        head += struct.pack("<2d", max(axis), min(axis))
    if minor >= 3:
        head += bytes(8)
    if minor >= 4:
        head += struct.pack("<QIQ15Q", 0, 0, len(points), len(points), *[0] * 14)
    assert len(head) == head_size, len(head)
    with open(sys.argv[1], "wb") as out:
        out.write(head + b"".join(records) + b"".join(points) + bytes(spec.get("tail", 0)))


main()
