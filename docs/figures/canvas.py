"""Drawing on Cairo through ctypes: PNG pictures with axes, from Python's standard library alone."""
import ctypes
import math

_cairo = ctypes.CDLL("libcairo.so.2")
for _name in ("cairo_image_surface_create", "cairo_create", "cairo_image_surface_create_from_png"):
    getattr(_cairo, _name).restype = ctypes.c_void_p


class _Extents(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in
                ("x_bearing", "y_bearing", "width", "height", "x_advance", "y_advance")]


INK = (0.13, 0.15, 0.19)
GREY = (0.55, 0.58, 0.62)
PALE = (0.90, 0.91, 0.93)
RED = (0.80, 0.15, 0.25)
BLUE = (0.12, 0.37, 0.70)
GREEN = (0.10, 0.52, 0.32)
ORANGE = (0.88, 0.50, 0.10)


class Canvas:
    """A white picture. Lengths in pixels, y down."""

    def __init__(self, width, height):
        self._surface = _cairo.cairo_image_surface_create(1, width, height)
        self._context = _cairo.cairo_create(ctypes.c_void_p(self._surface))
        self._call("set_source_rgb", 1.0, 1.0, 1.0)
        self._call("paint")

    def _call(self, function, *arguments):
        call = getattr(_cairo, "cairo_" + function)
        call(ctypes.c_void_p(self._context),
             *[ctypes.c_double(a) if isinstance(a, float) else a for a in arguments])

    def _colour(self, colour, opacity=1.0):
        self._call("set_source_rgba", *map(float, colour), float(opacity))

    def _path(self, points, close=False):
        self._call("new_path")
        for x, y in points:
            self._call("line_to", float(x), float(y))
        if close:
            self._call("close_path")

    def line(self, points, colour=INK, width=1.5, opacity=1.0, dash=None):
        self._path(points)
        self._colour(colour, opacity)
        self._call("set_line_width", float(width))
        dashes = (ctypes.c_double * 2)(*(dash or (0.0, 0.0)))
        self._call("set_dash", dashes, 2 if dash else 0, 0.0)
        self._call("stroke")

    def polygon(self, points, colour, opacity=1.0):
        self._path(points, close=True)
        self._colour(colour, opacity)
        self._call("fill")

    def rectangle(self, x, y, width, height, colour, opacity=1.0):
        self.polygon([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], colour,
                     opacity)

    def circle(self, x, y, radius, colour, opacity=1.0):
        self.polygon([(x + radius * math.cos(t / 24.0 * 2 * math.pi),
                       y + radius * math.sin(t / 24.0 * 2 * math.pi)) for t in range(24)], colour,
                     opacity)

    def arrow(self, start, end, colour=INK, width=1.8):
        self.line([start, end], colour, width)
        angle = math.atan2(end[1] - start[1], end[0] - start[0])
        head = [end] + [(end[0] - 10 * math.cos(angle + side), end[1] - 10 * math.sin(angle + side))
                        for side in (0.4, -0.4)]
        self.polygon(head, colour)

    def text(self, x, y, words, size=14, colour=INK, anchor="left", bold=False, turned=False):
        self._call("select_font_face", ctypes.c_char_p(b"DejaVu Sans"), 0, 1 if bold else 0)
        self._call("set_font_size", float(size))
        raw = ctypes.c_char_p(words.encode())
        extents = _Extents()
        self._call("text_extents", raw, ctypes.byref(extents))
        shift = {"left": 0.0, "middle": -0.5, "right": -1.0}[anchor] * extents.x_advance
        self._call("save")
        self._call("translate", float(x), float(y))
        if turned:
            self._call("rotate", -math.pi / 2)
        self._call("move_to", float(shift), 0.0)
        self._colour(colour)
        self._call("show_text", raw)
        self._call("restore")

    def png(self, path, source, x, y, scale):
        """Lays the rectangle `source` (x, y, width, height) of a PNG file at x, y."""
        picture = _cairo.cairo_image_surface_create_from_png(ctypes.c_char_p(str(path).encode()))
        left, top, width, height = source
        self._call("save")
        self._call("translate", float(x), float(y))
        self._call("scale", float(scale), float(scale))
        self._path([(0, 0), (width, 0), (width, height), (0, height)], close=True)
        self._call("clip")
        self._call("set_source_surface", ctypes.c_void_p(picture), float(-left), float(-top))
        self._call("paint")
        self._call("restore")

    def save(self, path):
        _cairo.cairo_surface_write_to_png(ctypes.c_void_p(self._surface),
                                          ctypes.c_char_p(str(path).encode()))


def _steps(one, other, wanted=5):
    low, high = sorted((one, other))
    raw = (high - low) / wanted
    unit = 10.0 ** math.floor(math.log10(raw))
    step = unit * min((m for m in (1, 2, 5, 10) if m * unit >= raw))
    value = math.ceil(low / step - 1e-9) * step
    while value <= high + 1e-9 * step:
        yield value
        value += step


class Axes:
    """A frame with ticks on a canvas; x and y to pixels."""

    def __init__(self, canvas, box, x_range, y_range, x_label="", y_label="", title=""):
        self.canvas, self.box, self.x_range, self.y_range = canvas, box, x_range, y_range
        left, top, width, height = box
        canvas.rectangle(left, top, width, height, (0.98, 0.98, 0.985))
        for value in _steps(*x_range):
            x = self.at(value, 0)[0]
            canvas.line([(x, top), (x, top + height)], PALE, 1)
            canvas.text(x, top + height + 18, f"{value:g}", 12, anchor="middle")
        for value in _steps(*y_range):
            y = self.at(0, value)[1]
            canvas.line([(left, y), (left + width, y)], PALE, 1)
            canvas.text(left - 6, y + 4, f"{value:.6g}", 12, anchor="right")
        canvas.line([(left, top), (left + width, top), (left + width, top + height),
                     (left, top + height), (left, top)], GREY, 1)
        canvas.text(left + width / 2, top + height + 38, x_label, 13, anchor="middle")
        canvas.text(left - 46, top + height / 2, y_label, 13, anchor="middle", turned=True)
        canvas.text(left, top - 12, title, 15, bold=True)

    def at(self, x, y):
        left, top, width, height = self.box
        return (left + width * (x - self.x_range[0]) / (self.x_range[1] - self.x_range[0]),
                top + height * (1 - (y - self.y_range[0]) / (self.y_range[1] - self.y_range[0])))

    def line(self, points, colour=INK, width=1.5, opacity=1.0, dash=None):
        self.canvas.line([self.at(*p) for p in points], colour, width, opacity, dash)

    def polygon(self, points, colour, opacity=1.0):
        self.canvas.polygon([self.at(*p) for p in points], colour, opacity)

    def dot(self, x, y, colour=INK, radius=3):
        self.canvas.circle(*self.at(x, y), radius, colour)


def legend(canvas, x, y, entries):
    """entries: (colour, words), one under the other."""
    for i, (colour, words) in enumerate(entries):
        canvas.line([(x, y + 20 * i), (x + 24, y + 20 * i)], colour, 3)
        canvas.text(x + 32, y + 20 * i + 4, words, 13)
