#!/usr/bin/env python3
"""Prints where the vehicle is and which faults its processes report, as they come on the bus.

    lcm-gen --python --ppath FOLDER lcmtypes/*.lcm
    PYTHONPATH=FOLDER python3 examples/listen.py [GROUP:PORT]

Debian 12 has no LCM for Python. This file reads LCM's UDP packets itself; the messages are decoded by
the classes that lcm-gen makes, which need nothing but Python.
"""
import socket
import struct
import sys

from seastitch import health_t, nav_corrected_t

SHORT_MESSAGE = 0x4C433032  # "LC02". Messages in fragments ("LC03") are longer than any of these two.


def messages(group, port):
    """Yields (channel, bytes) of each message that arrives."""
    bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bus.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    bus.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    bus.bind((group, port))
    any_interface = socket.inet_aton("0.0.0.0")
    bus.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + any_interface)
    while True:
        packet = bus.recv(65536)
        if len(packet) < 9 or struct.unpack(">I", packet[:4])[0] != SHORT_MESSAGE:
            continue
        channel, _, content = packet[8:].partition(b"\0")  # behind magic and sequence number
        yield channel.decode(errors="replace"), content


def main():
    group, _, port = (sys.argv[1] if len(sys.argv) > 1 else "239.255.76.67:7667").partition(":")
    for channel, content in messages(group, int(port)):
        try:
            if channel == "NAV_CORRECTED":
                nav = nav_corrected_t.decode(content)
                north, east, down = nav.p_map_vehicle_m
                print(f"{nav.utime} us: north {north:.2f} m, east {east:.2f} m, depth {down:.2f} m", flush=True)
            elif channel == "HEALTH":
                health = health_t.decode(content)
                for fault in health.conditions:
                    print(f"{health.process}: {fault.sentence}", flush=True)
        except (ValueError, struct.error) as error:  # of another version, or not ours
            print(f"{channel}: {error}", file=sys.stderr)


if __name__ == "__main__":
    main()
