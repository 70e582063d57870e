#!/usr/bin/env python3
"""forger.py ADDRESS COUNT: as another computer of the sensors' network, sends LCM messages of channel FORGED.

To ADDRESS and to LCM's group. Each from a port of its own: of several sockets on LCM's port the kernel chooses by that.
"""
import socket
import struct
import sys
import time

GROUP, PORT, SHORT_MESSAGE = "239.255.76.67", 7667, 0x4C433032

for number in range(int(sys.argv[2])):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 4)
        message = struct.pack(">II", SHORT_MESSAGE, number) + b"FORGED\0" + bytes(16)
        for address in (sys.argv[1], GROUP):
            out.sendto(message, (address, PORT))
    time.sleep(0.01)
