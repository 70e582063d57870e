#!/usr/bin/env python3
"""Draws the figures of the documentation from a replay of the demo survey.

  draw.py REPLAY TRUTH.csv OUT BENT CALIBRATED    (./run figures calls it)

BENT, CALIBRATED: replays of a survey whose sonar has errors, without and with self-calibration.
"""
import csv
import datetime
import math
import pathlib
import sqlite3
import struct
import subprocess
import sys

import conventions
from canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED, Axes, Canvas, legend

REPLAY, TRUTH, OUT, BENT, CALIBRATED = (pathlib.Path(a) for a in sys.argv[1:6])
PAIR = (1, 58)  # submaps of the registration figure: the first line, and the crossline at the end
PLOT = (92, 78, 760, 860)  # of the pictures of a replay: the map itself


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def rows(path):
    with open(path, newline="") as file:
        return [{k: float(v) if v else math.nan for k, v in row.items()} for row in csv.DictReader(file)]


def quaternion_matrix(x, y, z, w):
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))


def geometry(blob):
    """Points (east, north) of a line or of the ring of a polygon of a GeoPackage."""
    at = 8 + {0: 0, 1: 32, 2: 48, 3: 48, 4: 64}[blob[3] >> 1 & 7] + 1
    kind, = struct.unpack_from("<I", blob, at)
    at += 8 if kind % 1000 == 3 else 4
    count, = struct.unpack_from("<I", blob, at)
    dimensions = 3 if kind >= 1000 else 2
    values = struct.unpack_from(f"<{dimensions * count}d", blob, at + 4)
    return list(zip(values[0::dimensions], values[1::dimensions]))


def utime(text):
    return 1e6 * datetime.datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp()


def similarity(points, onto):
    """The rotation, scale and shift that moves points (x, y) best onto others, as a function."""
    a, b = ([complex(*p) for p in group] for group in (points, onto))
    mean_a, mean_b = sum(a) / len(a), sum(b) / len(b)
    factor = (sum((q - mean_b) * (p - mean_a).conjugate() for p, q in zip(a, b)) /
              sum(abs(p - mean_a) ** 2 for p in a))

    def move(point):
        moved = mean_b + factor * (complex(*point) - mean_a)
        return moved.real, moved.imag
    return move


class Survey:
    def __init__(self):
        self.track = rows(REPLAY / "track.csv")
        self.truth = {int(r["utime_us"]): r for r in rows(TRUTH)}
        data = sqlite3.connect(REPLAY / "survey.gpkg")
        (line,), = data.execute("select geom from track")
        to_map = similarity(geometry(line), [(r["y_m"], r["x_m"]) for r in self.track])  # from UTM
        self.footprints = {int(i): ([to_map(p) for p in geometry(g)], why, utime(start), utime(end))
                           for i, g, why, start, end in data.execute(
                               "select submap, geom, closed_by, start, end from footprints")}
        self.closures = [(int(a), int(b)) for a, b in data.execute(
            "select from_submap, to_submap from edges where verdict = 'accepted'")]
        self.poses = {}
        for line in (REPLAY / "poses.txt").read_text().splitlines():
            number, *pose = line.split()
            self.poses[int(number)] = tuple(map(float, pose))

    def yaw(self, submap):
        R = quaternion_matrix(*self.poses[submap][3:])
        return math.atan2(R[1][0], R[0][0])

    def dead_reckoned(self, submap):
        """x, y, yaw of a submap's frame by dead reckoning, and the row of the track that has it."""
        _, _, start, end = self.footprints[submap]
        x, y = self.poses[submap][:2]
        row = min((r for r in self.track if start <= r["utime_us"] <= end),
                  key=lambda r: (r["x_m"] - x) ** 2 + (r["y_m"] - y) ** 2)
        turn = wrap(math.radians(row["dr_yaw_deg"] - row["yaw_deg"]))
        return row["dr_x_m"], row["dr_y_m"], self.yaw(submap) + turn, row

    def points(self, submap, solved):
        """Points of a submap in the map: north, east, down."""
        raw = (REPLAY / "submaps" / f"submap_{submap}.pcd").read_bytes()
        head, body = raw.split(b"DATA binary\n", 1)
        count = int(head.split(b"POINTS ")[1].split()[0])
        x, y, z, *q = self.poses[submap]
        R = quaternion_matrix(*q)
        dr_x, dr_y, dr_yaw, _ = self.dead_reckoned(submap)
        turn = 0.0 if solved else wrap(dr_yaw - self.yaw(submap))
        c, s = math.cos(turn), math.sin(turn)
        x0, y0 = (x, y) if solved else (dr_x, dr_y)
        for i in range(count):
            p = struct.unpack_from("<3f", body, 16 * i)
            a, b, d = (sum(R[row][k] * p[k] for k in range(3)) for row in range(3))
            yield x0 + c * a - s * b, y0 + s * a + c * b, z + d


def heights(points, cell):
    sums = {}
    for n, e, d in points:
        total = sums.setdefault((math.floor(n / cell), math.floor(e / cell)), [0.0, 0])
        total[0] += d
        total[1] += 1
    return {k: total / count for k, (total, count) in sums.items()}


def map_before_after():
    canvas = Canvas(860, 1020)
    for column, (name, words) in enumerate((("_as_navigated", "As navigated"), ("", "After: loop closures"))):
        x = 20 + 420 * column
        canvas.text(x, 28, words, 17, bold=True)
        canvas.png(REPLAY / f"depth{name}.png", PLOT, x, 40, 0.52)
        canvas.png(REPLAY / f"mismatch{name}.png", PLOT, x, 530, 0.52)
    canvas.text(20, 510, "Depth, with the track (black) and the loop closures (red). The map is 210 m wide.", 13)
    canvas.text(20, 1000, "Misfit of overlapping swaths: pale agrees, dark purple differs by 0.2 m; grey was seen once.", 13)
    canvas.save(OUT / "map_before_after.png")


def navigation(survey):
    start = survey.track[0]["utime_us"]
    series = []
    for r in survey.track[::20]:
        truth = survey.truth.get(int(r["utime_us"]))
        if truth:
            series.append(((r["utime_us"] - start) / 60e6, r["dr_x_m"] - truth["x_m"], r["dr_y_m"] - truth["y_m"],
                           r["x_m"] - truth["x_m"], r["y_m"] - truth["y_m"], r["sigma_x_m"], r["sigma_y_m"]))
    canvas = Canvas(1100, 420)
    end = series[-1][0]
    for column, (name, dr, solved, sigma) in enumerate((("north", 1, 3, 5), ("east", 2, 4, 6))):
        axes = Axes(canvas, (75 + 530 * column, 50, 460, 280), (0, end), (-8, 8), "minutes since the start",
                    "error [m]", f"Error of the position, {name}")
        axes.polygon([(p[0], 2 * p[sigma]) for p in series] + [(p[0], -2 * p[sigma]) for p in reversed(series)],
                     GREEN, 0.3)
        axes.line([(p[0], p[dr]) for p in series], RED, 2)
        axes.line([(p[0], p[solved]) for p in series], GREEN, 2)
    legend(canvas, 75, 392, [(RED, "as navigated")])
    legend(canvas, 300, 392, [(GREEN, "track of the solved graph; band: its stated 2 sigma")])
    canvas.save(OUT / "navigation.png")


def submaps(survey):
    canvas = Canvas(1000, 820)
    axes = Axes(canvas, (80, 50, 640, 700), (-45, 185), (-50, 205), "east [m]", "north [m]", "Submaps of the demo survey")
    colours = {"length": BLUE, "information": GREEN, "turn": ORANGE, "gap": RED, "end": GREY}
    for ring, why, _, _ in survey.footprints.values():
        axes.polygon(ring, colours.get(why, GREY), 0.10)
        axes.line(ring + ring[:1], colours.get(why, GREY), 1, 0.8)
    axes.line([(r["y_m"], r["x_m"]) for r in survey.track if -50 < r["x_m"] < 205 and -45 < r["y_m"] < 185], INK, 1)
    for submap, (x, y, *_) in survey.poses.items():
        if -50 < x < 205 and -45 < y < 185:
            axes.dot(y, x, INK, 3.5)
    chosen = sorted(survey.footprints)[10]
    ring = survey.footprints[chosen][0]
    axes.line(ring + ring[:1], RED, 3)
    names = sorted({why for _, why, _, _ in survey.footprints.values()})
    legend(canvas, 745, 80, [(colours.get(why, GREY), f"closed by {why}") for why in names] +
           [(INK, "track; dots: frames"), (RED, f"submap {chosen}")])
    canvas.save(OUT / "submaps.png")


def registration(survey):
    cell = 0.5
    mapped = sorted(survey.footprints)
    target, source = mapped[PAIR[0]], mapped[PAIR[1]]
    fixed = heights(survey.points(target, True), cell)
    canvas = Canvas(1180, 760)
    # The whole misfit of the pair is drawn at the source: the target keeps its place.
    T, S = survey.dead_reckoned(target), survey.dead_reckoned(source)
    turn = wrap(survey.yaw(target) - T[2])
    c, s = math.cos(turn), math.sin(turn)
    x0, y0 = survey.poses[target][:2]
    before = heights(((x0 + c * (n - T[0]) - s * (e - T[1]), y0 + s * (n - T[0]) + c * (e - T[1]), d)
                      for n, e, d in survey.points(source, False)), cell)
    after = heights(survey.points(source, True), cell)
    both = [k for k in after if k in fixed]
    low = [min(k[i] for k in both) for i in (0, 1)]
    high = [max(k[i] for k in both) + 1 for i in (0, 1)]
    mean = sum(fixed[k] for k in both) / len(both)
    row = low[0] + int(0.5 * (high[0] - low[0]))
    for column, (moved, words) in enumerate(((before, "by dead reckoning"), (after, "registered"))):
        axes = Axes(canvas, (80 + 560 * column, 50, 460, 330), (low[1] * cell, high[1] * cell),
                    (low[0] * cell, high[0] * cell), "east [m]", "north [m]", f"Source less target, {words}")
        for (n, e), depth in moved.items():
            if (n, e) in fixed and low[0] <= n < high[0] and low[1] <= e < high[1]:
                difference = max(-1.0, min(1.0, (depth - fixed[n, e]) / 0.4))
                strength = abs(difference)
                tint = RED if difference > 0 else BLUE
                x, y = axes.at(e * cell, (n + 1) * cell)
                x1, y1 = axes.at((e + 1) * cell, n * cell)
                canvas.rectangle(x, y, x1 - x + 0.5, y1 - y + 0.5, tuple(1 - strength * (1 - v) for v in tint))
        y = (row + 0.5) * cell
        axes.line([(low[1] * cell, y), (high[1] * cell, y)], INK, 1, dash=(5.0, 4.0))
        axes = Axes(canvas, (80 + 560 * column, 460, 460, 200), (low[1] * cell, high[1] * cell), (mean + 1.3, mean - 1.3),
                    "east [m], along the dashed line", "depth [m]")
        for surface, colour in ((fixed, INK), (moved, RED)):
            axes.line([((e + 0.5) * cell, surface[row, e]) for e in range(low[1], high[1]) if (row, e) in surface],
                      colour, 2)
    rms = lambda surface: math.sqrt(sum((surface[k] - fixed[k]) ** 2 for k in both if k in surface) /
                                    sum(k in surface for k in both))
    legend(canvas, 80, 735, [(INK, f"target: submap {target}")])
    legend(canvas, 330, 735, [(RED, f"source: submap {source}")])
    canvas.text(580, 739, f"RMS difference {rms(before):.2f} m before, {rms(after):.2f} m after; full red or blue: 0.4 m", 13)
    canvas.save(OUT / "registration.png")


def graph(survey):
    canvas = Canvas(1080, 820)
    axes = Axes(canvas, (80, 50, 640, 700), (-45, 185), (-50, 205), "east [m]", "north [m]", "Pose graph of the demo survey")
    inside = {i for i, (x, y, *_) in survey.poses.items() if -50 < x < 205 and -45 < y < 185}
    for a, b in survey.closures:
        if a in inside and b in inside:
            axes.line([survey.poses[a][1::-1], survey.poses[b][1::-1]], ORANGE, 1.2)
    order = sorted(inside)
    for a, b in zip(order, order[1:]):
        if b == a + 1:
            axes.line([survey.poses[a][1::-1], survey.poses[b][1::-1]], BLUE, 2)
    for submap in order:
        x, y = survey.poses[submap][:2]
        dr_x, dr_y, _, row = survey.dead_reckoned(submap)
        axes.line([(dr_y, dr_x), (y, x)], RED, 1.5)
        axes.dot(dr_y, dr_x, RED, 3)
        ellipse = [(y + 10 * row["sigma_y_m"] * math.sin(t / 16 * math.pi),
                    x + 10 * row["sigma_x_m"] * math.cos(t / 16 * math.pi)) for t in range(33)]
        axes.polygon(ellipse, GREEN, 0.35)
        axes.dot(y, x, INK, 3)
    legend(canvas, 745, 80, [(INK, "vertex: solved submap frame"), (BLUE, "dead-reckoning edge"), (ORANGE, "loop closure"),
                             (RED, "where dead reckoning put it"), (GREEN, "1 sigma, ten times enlarged")])
    canvas.save(OUT / "graph.png")


def surface_errors(name):
    out = subprocess.run(["gdal_translate", "-q", "-of", "XYZ", REPLAY / name, "/vsistdout/"],
                         capture_output=True, check=True, text=True).stdout
    return sorted(v for v in (float(line.split()[2]) for line in out.splitlines()) if v >= 0.0)


def consistency():
    canvas = Canvas(1180, 500)
    for column, (name, words) in enumerate((("_as_navigated", "As navigated"), ("", "Corrected"))):
        canvas.text(20 + 375 * column, 38, words, 15, bold=True)
        canvas.png(REPLAY / f"mismatch{name}.png", PLOT, 20 + 375 * column, 50, 0.47)
    axes = Axes(canvas, (830, 50, 320, 360), (0, 0.3), (0, 100), "swath mismatch [m]", "cells below it [%]", "Distribution")
    for name, colour in (("mismatch_as_navigated.tif", RED), ("mismatch.tif", GREEN)):
        errors = surface_errors(name)
        step = max(1, len(errors) // 400)
        axes.line([(e, 100 * i / len(errors)) for i, e in list(enumerate(errors))[::step] if e <= 0.3], colour, 2.5)
    legend(canvas, 830, 478, [(RED, "as navigated")])
    legend(canvas, 1000, 478, [(GREEN, "corrected")])
    canvas.save(OUT / "consistency.png")


def calibration():
    canvas = Canvas(900, 620)
    for column, (replay, words) in enumerate(((BENT, "As configured"), (CALIBRATED, "Calibrated by its own overlaps"))):
        shaded = replay / "shaded.png"
        subprocess.run(["gdaldem", "hillshade", "-q", "-z", "15", "-of", "PNG",
                        replay / "elevation.tif", shaded], check=True)
        x = 20 + 430 * column
        canvas.text(x, 28, words, 17, bold=True)
        canvas.png(shaded, (0, 0, 152, 203), x, 42, 2.6)
    canvas.text(20, 598, "Flat mud, heights 15 times enlarged. Roll 0.3 degrees and sound speed 3 m/s wrong, stamps 60 ms early.", 13)
    canvas.save(OUT / "calibration.png")


OUT.mkdir(parents=True, exist_ok=True)
SURVEY = Survey()
map_before_after()
conventions.frames(OUT)
conventions.signs(OUT)
navigation(SURVEY)
submaps(SURVEY)
registration(SURVEY)
graph(SURVEY)
consistency()
calibration()
