"""Figures of docs/frames.md: the frames, and how others count angles. They need no survey."""
import math

from canvas import BLUE, GREEN, GREY, INK, ORANGE, PALE, RED, Canvas


def frames(out):
    canvas = Canvas(1100, 440)
    canvas.text(30, 32, "From above", 16, bold=True)
    origin = (90, 380)
    canvas.arrow(origin, (90, 260))
    canvas.arrow(origin, (210, 380))
    canvas.text(80, 250, "x north", 14)
    canvas.text(216, 385, "y east", 14)
    canvas.text(60, 408, "map (z down, into the page); origin: the datum", 13, GREY)
    yaw, (vx, vy) = math.radians(35), (330, 200)
    forward = (math.sin(yaw), -math.cos(yaw))
    right = (math.cos(yaw), math.sin(yaw))
    along = lambda f, r: (vx + f * forward[0] + r * right[0], vy + f * forward[1] + r * right[1])
    canvas.polygon([along(75, 0), along(50, 18), along(-70, 18), along(-70, -18), along(50, -18)], BLUE, 0.25)
    canvas.arrow((vx, vy), along(115, 0), BLUE)
    canvas.arrow((vx, vy), along(0, 90), BLUE)
    canvas.text(*along(122, -30), "x forward", 14, BLUE)
    canvas.text(along(0, 96)[0], along(0, 96)[1] + 4, "y right", 14, BLUE)
    canvas.line([(vx, vy), (vx, vy - 130)], GREY, 1, dash=(5.0, 4.0))
    canvas.text(vx - 2, vy - 138, "north", 12, GREY, "middle")
    canvas.text(vx + 14, vy - 92, "yaw", 13)
    canvas.line([(vx + 70 * math.sin(t * yaw / 12), vy - 70 * math.cos(t * yaw / 12)) for t in range(13)], INK, 1.2)
    sonar = along(-40, 0)
    canvas.circle(*sonar, 5, RED)
    canvas.text(sonar[0] - 42, sonar[1] - 12, "sonar: T_vehicle_mbes", 13, RED, "right")

    canvas.text(600, 32, "From the port side, descending", 16, bold=True)
    canvas.line([(600, 80), (1070, 80)], BLUE, 1.5)
    canvas.text(1070, 72, "water line: z = 0 of the map", 13, BLUE, "right")
    pitch, (sx, sy) = math.radians(14), (840, 200)
    cosp, sinp = math.cos(pitch), math.sin(pitch)
    body = lambda f, d: (sx - f * cosp - d * sinp, sy + f * sinp * 1.0 + d * cosp)
    canvas.polygon([body(90, 0), body(60, 16), body(-90, 16), body(-90, -16), body(60, -16)], BLUE, 0.25)
    canvas.arrow((sx, sy), body(130, 0), BLUE)
    canvas.arrow((sx, sy), body(0, 110), BLUE)
    canvas.text(body(138, 0)[0], body(138, 0)[1] + 22, "submap: x forward", 14, BLUE, "right")
    canvas.text(body(0, 122)[0] - 6, body(0, 122)[1] + 4, "z down of the vehicle", 14, BLUE, "right")
    canvas.arrow((sx, sy), (sx - 130, sy), GREEN)
    canvas.arrow((sx, sy), (sx, sy + 110), GREEN)
    canvas.text(sx - 136, sy - 6, "level: x", 14, GREEN, "right")
    canvas.text(sx + 8, sy + 112, "z along gravity", 14, GREEN)
    canvas.line([(600 + i * 10, 380 + 7 * math.sin(i / 5) + 4 * math.sin(i / 2)) for i in range(48)], ORANGE, 3)
    canvas.text(1070, 412, "seabed", 13, ORANGE, "right")
    canvas.save(out / "frames.png")


def turned(points, centre, angle):
    """Points (right, up) turned counter-clockwise about the centre, in pixels."""
    c, s = math.cos(angle), math.sin(angle)
    return [(centre[0] + c * x - s * y, centre[1] - s * x - c * y) for x, y in points]


def positive(canvas, centre, radius, start, end):
    """An arc with the arrow of a positive angle, from start to end counter-clockwise of right [deg]."""
    at = lambda t: (centre[0] + radius * math.cos(math.radians(t)), centre[1] - radius * math.sin(math.radians(t)))
    steps = [start + (end - start) * i / 24 for i in range(25)]
    canvas.line([at(t) for t in steps[:-2]], RED, 2)
    canvas.arrow(at(steps[-3]), at(steps[-1]), RED, 2)
    middle = math.radians((start + end) / 2)
    canvas.text(centre[0] + (radius + 14) * math.cos(middle), centre[1] - (radius + 14) * math.sin(middle) + 6, "+", 20,
                RED, "middle", bold=True)


def axis(canvas, centre, direction, words):
    """An axis of the vehicle: direction is (right, up) in pixels."""
    tip = (centre[0] + direction[0], centre[1] - direction[1])
    canvas.arrow(centre, tip, BLUE)
    side = "left" if direction[0] >= 0 else "right"
    canvas.text(tip[0] + (6 if direction[0] >= 0 else -6), tip[1] + (4 if direction[1] < 0 else 0), words, 12, BLUE, side)


def signs(out):
    """Rows: whose convention. Columns: what is drawn."""
    canvas = Canvas(1180, 760)
    stern = [(-45, 14), (45, 14), (30, -20), (-30, -20)]
    side = [(-70, 14), (52, 14), (74, 0), (52, -14), (-70, -14)]
    above = [(52, 0), (38, 14), (-52, 14), (-52, -14), (38, -14)]
    for column, words in enumerate(("Roll, from behind", "Pitch, from starboard", "Heading, from above", "Beam angle, from behind")):
        canvas.text(150 + 290 * column, 30, words, 15, bold=True, anchor="middle")
    for row, (name, z_up) in enumerate((("Seastitch; aerospace: forward, right, down", False),
                                        ("Kongsberg: forward, starboard, down", False),
                                        ("ENU, ROS (REP 103): forward, left, up", True))):
        top = 50 + 236 * row
        canvas.line([(20, top), (1160, top)], PALE, 1)
        canvas.text(20, top + 22, name, 14, bold=True)
        y = top + 132
        up = 56 if z_up else -56
        centre = (150, y)
        canvas.polygon(turned(stern, centre, math.radians(-12)), BLUE, 0.25)
        axis(canvas, centre, (-66 if z_up else 66, 0), "y")
        axis(canvas, centre, (0, up), "z")
        positive(canvas, centre, 98, 18, -18)
        canvas.text(centre[0], top + 222, "starboard down", 12, GREY, "middle")

        centre = (440, y)
        canvas.polygon(turned(side, centre, math.radians(-12 if z_up else 12)), BLUE, 0.25)
        axis(canvas, centre, (80, 0), "")
        canvas.text(centre[0] + 84, centre[1] + (-8 if z_up else 18), "x", 12, BLUE)
        axis(canvas, centre, (0, up), "z")
        positive(canvas, centre, 108, *((16, -16) if z_up else (-16, 16)))
        canvas.text(centre[0], top + 222, "bow down" if z_up else "bow up", 12, GREY, "middle")

        centre, heading = (730, y), 50.0  # of the bow, counter-clockwise of east
        canvas.polygon(turned(above, centre, math.radians(heading)), BLUE, 0.25)
        reference = (90, 0) if z_up else (0, 78)
        canvas.line([centre, (centre[0] + reference[0], centre[1] - reference[1])], GREY, 1, dash=(5.0, 4.0))
        canvas.text(centre[0] + (96 if z_up else 0), centre[1] - (-4 if z_up else 84), "east" if z_up else "north", 12, GREY,
                    "left" if z_up else "middle")
        positive(canvas, centre, 66, *((2, heading - 4) if z_up else (88, heading + 4)))
        canvas.text(centre[0], top + 222, "counter-clockwise from east" if z_up else "clockwise from north", 12, GREY,
                    "middle")

        if z_up:
            continue
        centre = (1020, top + 70)
        canvas.polygon(turned(stern, centre, 0.0), BLUE, 0.25)
        canvas.line([(centre[0], centre[1] + 20), (centre[0], centre[1] + 120)], GREY, 1, dash=(5.0, 4.0))
        toward = 1 if row == 0 else -1
        canvas.line([(centre[0], centre[1] + 20), (centre[0] + toward * 62, centre[1] + 112)], ORANGE, 2.5)
        positive(canvas, (centre[0], centre[1] + 20), 70, -88, -60 if row == 0 else -120)
        canvas.line([(centre[0] - 110 + 10 * i, centre[1] + 120 + 3 * math.sin(i / 2)) for i in range(23)], ORANGE, 2)
        canvas.text(centre[0], top + 222, "to starboard" if row == 0 else "to port", 12, GREY, "middle")
    canvas.save(out / "signs.png")
