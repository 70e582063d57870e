#!/usr/bin/env python3
"""Reads what Seastitch exports by the formats' public descriptions alone, as JSON.

    read_exports.py las|sbet|na0 FILE

las: ASPRS LAS specification 1.4 R15. sbet: Applanix SBET, 17 doubles a record. na0: mbnavadjust's
16 columns.
"""
import json
import struct
import sys

LAS_TYPES = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i", 7: "Q", 8: "q", 9: "f", 10: "d"}


def text(raw):
    return raw.split(b"\0")[0].decode("ascii")


def read_las(data):
    assert data[:4] == b"LASF", "signature"
    assert (data[24], data[25]) == (1, 4), "version"
    encoding, = struct.unpack_from("<H", data, 6)
    assert encoding & 1, "GPS times must be adjusted standard time"
    assert encoding & 16, "point formats from 6 on need the WKT bit"
    header_size, offset, num_vlrs = struct.unpack_from("<HII", data, 94)
    point_format, point_size = struct.unpack_from("<BH", data, 104)
    assert header_size == 375 and point_format == 6
    legacy = struct.unpack_from("<6I", data, 107)
    assert legacy == (0,) * 6, "legacy counts"
    scale = struct.unpack_from("<3d", data, 131)
    origin = struct.unpack_from("<3d", data, 155)
    max_x, min_x, max_y, min_y, max_z, min_z = struct.unpack_from("<6d", data, 179)
    count, first_returns = struct.unpack_from("<2Q", data, 247)
    assert first_returns == count
    wkt, extra, at = "", [], header_size
    for _ in range(num_vlrs):
        user, number, size = text(data[at + 2:at + 18]), *struct.unpack_from("<HH", data, at + 18)
        body = data[at + 54:at + 54 + size]
        if (user, number) == ("LASF_Projection", 2112):
            wkt = text(body)
        if (user, number) == ("LASF_Spec", 4):
            extra = [(text(body[k + 4:k + 36]), LAS_TYPES[body[k + 2]])
                     for k in range(0, size, 192)]
        at += 54 + size
    assert at == offset, "records end where the points begin"
    assert point_size == 30 + sum(struct.calcsize("<" + kind) for _, kind in extra)
    assert len(data) == offset + count * point_size, "size of the file"
    points = []
    for k in range(count):
        at = offset + k * point_size
        x, y, z, _, returns, flags, kind, _, _, source, time = struct.unpack_from(
            "<iiiHBBBBhHd", data, at)
        point = {"x": x * scale[0] + origin[0], "y": y * scale[1] + origin[1],
                 "z": z * scale[2] + origin[2], "class": kind, "withheld": bool(flags & 4),
                 "line": source, "head": flags >> 4 & 3, "unix_s": time + 1e9 + 315964800 - 18}
        assert returns == 0x11
        at += 30
        for name, kind in extra:
            point[name], = struct.unpack_from("<" + kind, data, at)
            at += struct.calcsize("<" + kind)
        points.append(point)
    for axis, low, high in (("x", min_x, max_x), ("y", min_y, max_y), ("z", min_z, max_z)):
        values = [p[axis] for p in points]
        assert low - 1e-3 <= min(values) and max(values) <= high + 1e-3, "extent " + axis
        assert abs(low - min(values)) < 2e-3 and abs(high - max(values)) < 2e-3, "extent " + axis
    return {"wkt": wkt, "points": points}


def read_sbet(data):
    assert len(data) % 136 == 0
    names = ("week_s", "latitude_rad", "longitude_rad", "height_m", "v_north", "v_east", "v_down",
             "roll_rad", "pitch_rad", "heading_rad", "wander_rad")
    return [dict(zip(names, struct.unpack_from("<17d", data, at)))
            for at in range(0, len(data), 136)]


def read_na0(data):
    names = ("year", "month", "day", "hour", "minute", "second", "epoch_s", "longitude",
             "latitude", "heading", "speed_kmh", "draft", "roll", "pitch", "heave", "zoffset")
    rows = []
    for line in data.decode("ascii").split("\r\n"):
        if line and not line.startswith("#"):
            values = line.split()
            assert len(values) == 16
            rows.append(dict(zip(names, map(float, values))))
    return rows


def main():
    kind, path = sys.argv[1:]
    with open(path, "rb") as file:
        data = file.read()
    json.dump({"las": read_las, "sbet": read_sbet, "na0": read_na0}[kind](data), sys.stdout)


main()
