#!/usr/bin/env python3
"""nmea_ins.py PORT: an INS at rest, as NMEA 0183 sentences on UDP to this computer, ten times a second."""
import functools
import socket
import sys
import time


def sentence(body):
    """A body with its checksum."""
    return f"${body}*{functools.reduce(lambda sum, byte: sum ^ byte, body.encode()):02X}\r\n"


with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
    while True:
        now = time.time()
        clock = time.strftime("%H%M%S", time.gmtime(now)) + f".{int(now * 1000) % 1000:03d}"
        text = sentence(f"GPGGA,{clock},5900.0000,N,01000.0000,E,4,09,0.9,0.0,M,0.0,M,,")
        text += sentence("GPVTG,0.0,T,,M,0.0,N,0.0,K,A")
        text += sentence(f"PASHR,{clock},45.00,T,0.50,-0.50,0.00,0.010,0.010,0.020,4,1")
        out.sendto(text.encode(), ("127.0.0.1", int(sys.argv[1])))
        time.sleep(0.1)
