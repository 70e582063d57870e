#!/usr/bin/env python3
"""Reads every #MRZ of a KMALL file and prints what a ping message must hold, as JSON: an
independent reader for the tests, written from the format's tables with the standard library only.

    kmall_reference.py FILE.kmall
"""
import json
import math
import struct
import sys


def f32(x):
    """x as a float of 32 bits has it."""
    return struct.unpack("<f", struct.pack("<f", x))[0]


def read_mrz(d):
    version, = struct.unpack_from("<B", d, 8)
    sec, nanosec = struct.unpack_from("<II", d, 12)
    common = 24
    common_size, ping_count = struct.unpack_from("<HH", d, common)
    info = common + common_size
    info_size, = struct.unpack_from("<H", d, info)
    num_sectors, sector_size = struct.unpack_from("<HH", d, info + 92)
    sound_speed, = struct.unpack_from("<f", d, info + 100)
    sectors = info + info_size
    rx = sectors + num_sectors * sector_size
    rx_size, num_main, _, sounding_size = struct.unpack_from("<4H", d, rx)
    _, num_classes, class_size = struct.unpack_from("<3H", d, rx + 26)
    first = rx + rx_size + num_classes * class_size

    beams = []
    for i in range(num_main):
        s = first + i * sounding_size
        _, sector, kind, method = struct.unpack_from("<HBBB", d, s)
        if kind == 1:
            continue
        quality, = struct.unpack_from("<f", d, s + 16)
        reflectivity, = struct.unpack_from("<f", d, s + 48)
        angle_port_deg, _, twtt = struct.unpack_from("<3f", d, s + 72)
        delay, tilt_deg = struct.unpack_from("<ff", d, sectors + sector * sector_size + 4)
        found = method in (1, 2)
        beams.append({
            "twtt_s": twtt,
            "rx_angle_rad": f32(-math.radians(angle_port_deg)),
            "tx_tilt_rad": f32(math.radians(tilt_deg)),
            "tx_delay_s": delay,
            "depth_sigma_ratio": f32(quality / 100.0),
            "backscatter_db": reflectivity,
            "flags": (1 if kind == 0 and found else 0) | ({1: 2, 2: 4}[method] if found else 0),
        })
    return {"version": version, "utime": sec * 1000000 + (nanosec + 500) // 1000,
            "ping_number": ping_count, "sound_speed_mps": sound_speed, "beams": beams}


def main():
    with open(sys.argv[1], "rb") as file:
        data = file.read()
    pings, at = [], 0
    while at + 8 <= len(data):
        size, = struct.unpack_from("<I", data, at)
        if data[at + 4:at + 8] == b"#MRZ":
            pings.append(read_mrz(data[at:at + size]))
        at += size
    json.dump(pings, sys.stdout)


if __name__ == "__main__":
    main()
