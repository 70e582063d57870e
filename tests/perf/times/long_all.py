#!/usr/bin/env python3
"""A long Kongsberg .all from a short one: its datagrams over and over, each time later and further
north, as a ship sails. Little-endian, within a day.

    tests/perf/times/long_all.py SHORT.all LONG.all BYTES
"""

import struct
import sys

SPEED_MPS = 2.0
DEG_PER_M = 1.0 / 111_000.0


def datagrams(data):
    at = 0
    while at + 24 < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        yield bytearray(data[at : at + 4 + length])
        at += 4 + length


def seal(datagram):
    struct.pack_into("<H", datagram, len(datagram) - 2, sum(datagram[5:-3]) % 65536)


def main():
    short, long, size = sys.argv[1], sys.argv[2], int(sys.argv[3])
    all_of_it = list(datagrams(open(short, "rb").read()))
    times = [struct.unpack_from("<I", d, 12)[0] for d in all_of_it]
    period_ms = max(times) - min(times) + 40
    written = 0
    again = 0
    with open(long, "wb") as out:
        while written < size:
            for d, time_ms in zip(all_of_it, times):
                struct.pack_into("<I", d, 12, time_ms + again * period_ms)
                if d[5:6] == b"P":
                    (latitude,) = struct.unpack_from("<i", d, 20)
                    step = round(SPEED_MPS * period_ms / 1000.0 * DEG_PER_M * 2e7)
                    struct.pack_into("<i", d, 20, latitude + (step if again else 0))
                    raw = d.find(b"GGA,")
                    if raw > 0:  # its own time counts otherwise
                        s = (time_ms + again * period_ms) / 1000.0
                        text = b"%02d%02d%05.2f" % (s // 3600, s % 3600 // 60, s % 60)
                        d[raw + 4 : raw + 13] = text
                seal(d)
                out.write(d)
                written += len(d)
            again += 1
    print(f"{written} bytes, {again} times {short}, {again * period_ms / 1000.0:.0f} s")


main()
