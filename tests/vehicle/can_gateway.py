#!/usr/bin/env python3
"""can_gateway.py INTERFACE PORT...: puts the CAN frames of cannelloni datagrams on a CAN interface.

Between the simulator, which sends cannelloni, and drivers that listen to a real interface.
"""
import selectors
import socket
import struct
import sys


def frames(packet):
    """(identifier, data) of every frame of a datagram: version, operation, sequence, count; then the frames."""
    _, _, _, count = struct.unpack_from(">BBBH", packet)
    at = 5
    for _ in range(count):
        identifier, length = struct.unpack_from(">IB", packet, at)
        yield identifier, packet[at + 5 : at + 5 + length]
        at += 5 + length


bus = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
bus.bind((sys.argv[1],))
selector = selectors.DefaultSelector()
for port in sys.argv[2:]:
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    listener.bind(("127.0.0.1", int(port)))
    selector.register(listener, selectors.EVENT_READ)
while True:
    for key, _ in selector.select():
        for identifier, data in frames(key.fileobj.recv(65536)):
            try:
                bus.send(struct.pack("=IB3x8s", identifier, len(data), data))
            except OSError:  # the interface is down: what is on a wire meanwhile is lost
                pass
