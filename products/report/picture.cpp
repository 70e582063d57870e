#include "products/report/picture.hpp"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "products/geo/raster.hpp"

namespace seastitch {
namespace {

constexpr double kLeft = 92.0, kRight = 150.0, kTop = 78.0, kBottom = 96.0;  // margins [px]
constexpr double kWidest = 1600.0;
constexpr double kMapWidth = 1100.0, kMapHeight = 860.0;  // at most [px]
constexpr double kLargestAspect = 3.0;  // a single line is shown with sea around it
constexpr int kMostCells = 1100;        // a side, after averaging
constexpr Rgb kInk{0.13, 0.15, 0.18};
constexpr Rgb kGround{0.955, 0.96, 0.965};
constexpr Rgb kSeenOnce{0.82, 0.84, 0.86};

struct Cairo {
  explicit Cairo(cairo_surface_t* s) : surface(s), context(cairo_create(s)) {}
  ~Cairo() {
    cairo_destroy(context);
    cairo_surface_destroy(surface);
  }
  Cairo(const Cairo&) = delete;
  Cairo& operator=(const Cairo&) = delete;
  cairo_surface_t* surface;
  cairo_t* context;
};

void SetColour(cairo_t* cr, const Rgb& c, double opacity = 1.0) {
  cairo_set_source_rgba(cr, c.r, c.g, c.b, opacity);
}

Rgb ColourAt(const ColourScale& scale, double t) {
  const double at = std::clamp(t, 0.0, 1.0) * static_cast<double>(scale.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), scale.size() - 2);
  const double f = at - static_cast<double>(i);
  const Rgb &a = scale[i], &b = scale[i + 1];
  return {a.r + f * (b.r - a.r), a.g + f * (b.g - a.g), a.b + f * (b.b - a.b)};
}

// Values at the picture's own resolution; NaN where there are none.
struct PictureCells {
  int rows = 0, cols = 0;
  double cell_m = 1.0;
  std::vector<double> values;
  double At(int row, int col) const {
    if (row < 0 || row >= rows || col < 0 || col >= cols) return std::nan("");
    return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) +
                  static_cast<std::size_t>(col)];
  }
};

PictureCells Averaged(const GridGeometry& g, const std::vector<float>& values) {
  const int factor = (std::max(g.rows, g.cols) + kMostCells - 1) / kMostCells;
  PictureCells out;
  out.rows = (g.rows + factor - 1) / factor;
  out.cols = (g.cols + factor - 1) / factor;
  out.cell_m = g.cell_m * factor;
  const auto size = static_cast<std::size_t>(out.rows) * static_cast<std::size_t>(out.cols);
  out.values.assign(size, 0.0);
  std::vector<double> count(size, 0.0);
  for (int row = 0; row < g.rows; ++row) {
    for (int col = 0; col < g.cols; ++col) {
      const float v = values[g.Index(row, col)];
      if (v == kNoData) continue;
      const std::size_t i =
          static_cast<std::size_t>(row / factor) * static_cast<std::size_t>(out.cols) +
          static_cast<std::size_t>(col / factor);
      out.values[i] += static_cast<double>(v);
      count[i] += 1.0;
    }
  }
  for (std::size_t i = 0; i < size; ++i) {
    out.values[i] = count[i] > 0.0 ? out.values[i] / count[i] : std::nan("");
  }
  return out;
}

// Slope of depth towards north and east; a missing neighbour counts as level ground.
Eigen::Vector2d SlopeAt(const PictureCells& raster, int row, int col) {
  const double here = raster.At(row, col);
  const auto difference = [&](double low, double high) {
    const bool has_low = std::isfinite(low), has_high = std::isfinite(high);
    if (has_low && has_high) return (high - low) / (2.0 * raster.cell_m);
    if (has_high) return (high - here) / raster.cell_m;
    if (has_low) return (here - low) / raster.cell_m;
    return 0.0;
  };
  return {difference(raster.At(row - 1, col), raster.At(row + 1, col)),
          difference(raster.At(row, col - 1), raster.At(row, col + 1))};
}

// Slopes are raised until the typical one is about 20 degrees, so that a smooth seabed shows its
// shape and a rough one does not turn black.
double Exaggeration(const PictureCells& raster) {
  double squares = 0.0, n = 0.0;
  for (int row = 0; row < raster.rows; ++row) {
    for (int col = 0; col < raster.cols; ++col) {
      if (!std::isfinite(raster.At(row, col))) continue;
      squares += SlopeAt(raster, row, col).squaredNorm();
      n += 1.0;
    }
  }
  const double rms = n > 0.0 ? std::sqrt(squares / n) : 0.0;
  return rms > 0.0 ? std::clamp(0.36 / rms, 0.3, 12.0) : 1.0;
}

// Lambert shading, light from the north-west 45 degrees up; 1 on level ground.
double Shade(const Eigen::Vector2d& slope, double exaggeration) {
  const double north = exaggeration * slope.x(), east = exaggeration * slope.y();
  // Normal of the surface, up positive: depth grows downward, so it leans towards deeper ground.
  const double length = std::sqrt(1.0 + north * north + east * east);
  const double lit = (0.5 * north - 0.5 * east + std::sqrt(0.5)) / length;
  return std::clamp(0.45 + 0.55 * lit / std::sqrt(0.5), 0.25, 1.25);
}

std::uint32_t Pack(const Rgb& c) {
  const auto byte = [](double v) {
    return static_cast<std::uint32_t>(std::lround(255.0 * std::clamp(v, 0.0, 1.0)));
  };
  return 0xFF000000u | (byte(c.r) << 16) | (byte(c.g) << 8) | byte(c.b);
}

// One pixel a cell, north up.
template <class ColourOf>
cairo_surface_t* CellImage(const PictureCells& raster, ColourOf colour_of) {
  cairo_surface_t* image =
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, raster.cols, raster.rows);
  cairo_surface_flush(image);
  unsigned char* data = cairo_image_surface_get_data(image);
  if (data == nullptr) throw std::runtime_error("picture: Cairo has no memory for the map");
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(image));
  for (int row = 0; row < raster.rows; ++row) {
    auto* line = reinterpret_cast<std::uint32_t*>(
        data + stride * static_cast<std::size_t>(raster.rows - 1 - row));
    for (int col = 0; col < raster.cols; ++col) {
      line[col] = std::isfinite(raster.At(row, col)) ? Pack(colour_of(row, col)) : 0u;
    }
  }
  cairo_surface_mark_dirty(image);
  return image;
}

// Where the map lies on the picture.
struct View {
  double north0 = 0.0, east0 = 0.0;  // lower left corner [m]
  double north_m = 1.0, east_m = 1.0;
  double px_per_m = 1.0;
  double width() const { return east_m * px_per_m; }
  double height() const { return north_m * px_per_m; }
  double X(double east) const { return kLeft + (east - east0) * px_per_m; }
  double Y(double north) const { return kTop + (north0 + north_m - north) * px_per_m; }
};

View ViewOf(const GridGeometry& g) {
  View v;
  const double north = g.rows * g.cell_m, east = g.cols * g.cell_m;
  const double margin = 0.02 * std::max(north, east);
  v.north_m = std::max(north, east / kLargestAspect) + 2.0 * margin;
  v.east_m = std::max(east, north / kLargestAspect) + 2.0 * margin;
  v.north0 = g.origin.x() - 0.5 * (v.north_m - north);
  v.east0 = g.origin.y() - 0.5 * (v.east_m - east);
  v.px_per_m = std::min(kMapWidth / v.east_m, kMapHeight / v.north_m);
  return v;
}

// A round step that divides the range into at most `most` parts.
double RoundStep(double range, double most) {
  const double raw = range / most;
  const double decade = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (raw <= step * decade) return step * decade;
  }
  return 10.0 * decade;
}

std::string Number(double value, double step) {
  char text[40];
  const int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  const double shown = std::abs(value) < 1e-9 * step ? 0.0 : value;
  std::snprintf(text, sizeof text, "%.*f", digits, shown);
  return text;
}

void SetFont(cairo_t* cr, double size, bool bold = false) {
  cairo_select_font_face(cr,
                         "DejaVu Sans",
                         CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cr, size);
}

enum class Align { kStart, kCentre, kEnd };

double TextWidth(cairo_t* cr, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(cr, text.c_str(), &extents);
  return extents.x_advance;
}

void Text(cairo_t* cr, double x, double y, const std::string& text, Align align = Align::kStart) {
  const double width = TextWidth(cr, text);
  const double shift = align == Align::kStart ? 0.0 : align == Align::kCentre ? 0.5 : 1.0;
  cairo_move_to(cr, std::round(x - shift * width), std::round(y));
  cairo_show_text(cr, text.c_str());
}

void DrawImage(cairo_t* cr, const View& view, const Picture& p, cairo_surface_t* image) {
  const double height_m = p.geometry.rows * p.geometry.cell_m;
  const double width_m = p.geometry.cols * p.geometry.cell_m;
  cairo_save(cr);
  cairo_translate(cr, view.X(p.geometry.origin.y()), view.Y(p.geometry.origin.x() + height_m));
  // The last averaged row and column may stand out over the grid's edge.
  const int factor = (std::max(p.geometry.rows, p.geometry.cols) + kMostCells - 1) / kMostCells;
  const int lines = cairo_image_surface_get_height(image);
  const double over = lines * factor * p.geometry.cell_m - height_m;
  cairo_rectangle(cr, 0, 0, width_m * view.px_per_m, height_m * view.px_per_m);
  cairo_clip(cr);
  cairo_translate(cr, 0.0, -over * view.px_per_m);
  const double px_per_cell = factor * p.geometry.cell_m * view.px_per_m;
  cairo_scale(cr, px_per_cell, px_per_cell);
  cairo_set_source_surface(cr, image, 0, 0);
  cairo_pattern_set_filter(cairo_get_source(cr),
                           px_per_cell >= 1.0 ? CAIRO_FILTER_NEAREST : CAIRO_FILTER_GOOD);
  cairo_paint(cr);
  cairo_restore(cr);
  cairo_surface_destroy(image);
}

void DrawMap(cairo_t* cr, const View& view, const Picture& p) {
  SetColour(cr, kGround);
  cairo_rectangle(cr, kLeft, kTop, view.width(), view.height());
  cairo_fill(cr);
  if (!p.underlay.empty()) {
    const PictureCells under = Averaged(p.geometry, p.underlay);
    DrawImage(cr, view, p, CellImage(under, [](int, int) { return kSeenOnce; }));
  }
  const PictureCells raster = Averaged(p.geometry, p.values);
  const double exaggeration = p.hill_shade ? Exaggeration(raster) : 1.0;
  DrawImage(cr, view, p, CellImage(raster, [&](int row, int col) {
              const double t = (raster.At(row, col) - p.lowest) / (p.highest - p.lowest);
              Rgb c = ColourAt(*p.colours, t);
              if (p.hill_shade) {
                const double s = Shade(SlopeAt(raster, row, col), exaggeration);
                c = {c.r * s, c.g * s, c.b * s};
              }
              return c;
            }));
}

void DrawGridLines(cairo_t* cr, const View& view) {
  const double step = RoundStep(std::max(view.east_m, view.north_m), 9.0);
  SetFont(cr, 13);
  cairo_set_line_width(cr, 1.0);
  const auto first = [step](double from) { return std::ceil(from / step - 1e-9) * step; };
  for (double e = first(view.east0); e <= view.east0 + view.east_m * (1 + 1e-9); e += step) {
    const double x = std::round(view.X(e)) + 0.5;
    SetColour(cr, kInk, 0.13);
    cairo_move_to(cr, x, kTop);
    cairo_line_to(cr, x, kTop + view.height());
    cairo_stroke(cr);
    SetColour(cr, kInk);
    Text(cr, x, kTop + view.height() + 20, Number(e, step), Align::kCentre);
  }
  for (double n = first(view.north0); n <= view.north0 + view.north_m * (1 + 1e-9); n += step) {
    const double y = std::round(view.Y(n)) + 0.5;
    SetColour(cr, kInk, 0.13);
    cairo_move_to(cr, kLeft, y);
    cairo_line_to(cr, kLeft + view.width(), y);
    cairo_stroke(cr);
    SetColour(cr, kInk);
    Text(cr, kLeft - 8, y + 4.5, Number(n, step), Align::kEnd);
  }
  SetFont(cr, 14);
  Text(cr, kLeft + 0.5 * view.width(), kTop + view.height() + 46, "East (m)", Align::kCentre);
  cairo_save(cr);
  cairo_translate(cr, 24, kTop + 0.5 * view.height());
  cairo_rotate(cr, -0.5 * 3.14159265358979323846);
  Text(cr, 0, 0, "North (m)", Align::kCentre);
  cairo_restore(cr);
  cairo_rectangle(cr, kLeft + 0.5, kTop + 0.5, view.width() - 1, view.height() - 1);
  SetColour(cr, kInk, 0.6);
  cairo_stroke(cr);
}

void DrawLines(cairo_t* cr, const View& view, const Picture& p) {
  cairo_save(cr);
  cairo_rectangle(cr, kLeft, kTop, view.width(), view.height());
  cairo_clip(cr);
  cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_ROUND);
  for (const PictureLine& line : p.lines) {
    cairo_new_path(cr);
    for (const Eigen::Vector2d& at : line.north_east) {
      cairo_line_to(cr, view.X(at.y()), view.Y(at.x()));
    }
    SetColour(cr, line.colour, line.opacity);
    cairo_set_line_width(cr, line.width_px);
    cairo_stroke(cr);
  }
  cairo_restore(cr);
}

// Under the map, so that neither hides any of it: legend to the left, scale bar to the right.
double FooterLine(const View& view) { return kTop + view.height() + 76; }

void DrawScaleBar(cairo_t* cr, const View& view) {
  const double length_m = RoundStep(view.east_m, 6.0);
  const double length = length_m * view.px_per_m;
  const double x = kLeft + view.width() - length, y = FooterLine(view);
  SetColour(cr, kInk);
  cairo_rectangle(cr, x, y - 7, length, 6);
  cairo_fill(cr);
  cairo_set_source_rgb(cr, 1, 1, 1);
  cairo_rectangle(cr, x + 0.5 * length, y - 6, 0.5 * length - 1, 4);
  cairo_fill(cr);
  SetFont(cr, 13);
  SetColour(cr, kInk);
  Text(cr, x - 10, y, Number(length_m, length_m) + " m", Align::kEnd);
}

void DrawLegend(cairo_t* cr, const View& view, const Picture& p) {
  std::vector<const PictureLine*> named;
  for (const PictureLine& line : p.lines) {
    const bool known = std::any_of(
        named.begin(), named.end(), [&](const auto* n) { return n->legend == line.legend; });
    if (!line.legend.empty() && !known) named.push_back(&line);
  }
  SetFont(cr, 13);
  double x = kLeft;
  const double y = FooterLine(view);
  for (const PictureLine* line : named) {
    SetColour(cr, line->colour);
    cairo_set_line_width(cr, std::max(2.0, line->width_px));
    cairo_move_to(cr, x, y - 4.5);
    cairo_line_to(cr, x + 24, y - 4.5);
    cairo_stroke(cr);
    SetColour(cr, kInk);
    Text(cr, x + 31, y, line->legend);
    x += 31 + TextWidth(cr, line->legend) + 22;
  }
}

void DrawColourBar(cairo_t* cr, const View& view, const Picture& p) {
  const double height = std::min(view.height(), 420.0), width = 22.0;
  const double x = kLeft + view.width() + 26, top = kTop + 0.5 * (view.height() - height);
  const auto y_of = [&](double t) { return top + height * (p.deeper_is_down ? t : 1.0 - t); };
  const int steps = static_cast<int>(height);
  for (int i = 0; i < steps; ++i) {
    const double t = (i + 0.5) / steps;
    SetColour(cr, ColourAt(*p.colours, p.deeper_is_down ? t : 1.0 - t));
    cairo_rectangle(cr, x, top + i, width, 1.5);
    cairo_fill(cr);
  }
  SetColour(cr, kInk, 0.6);
  cairo_set_line_width(cr, 1.0);
  cairo_rectangle(cr, x + 0.5, top + 0.5, width - 1, height);
  cairo_stroke(cr);
  SetFont(cr, 13);
  const double range = p.highest - p.lowest;
  const double step = RoundStep(range, 7.0);
  double widest = 0.0;
  for (double v = std::ceil(p.lowest / step - 1e-9) * step; v <= p.highest + 1e-9 * step;
       v += step) {
    const double y = std::round(y_of((v - p.lowest) / range)) + 0.5;
    SetColour(cr, kInk);
    cairo_move_to(cr, x + width, y);
    cairo_line_to(cr, x + width + 5, y);
    cairo_stroke(cr);
    const std::string tick = Number(v, step);
    Text(cr, x + width + 9, y + 4.5, tick);
    widest = std::max(widest, TextWidth(cr, tick));
  }
  SetFont(cr, 14);
  cairo_save(cr);
  cairo_translate(cr, x + width + widest + 32, top + 0.5 * height);
  cairo_rotate(cr, -0.5 * 3.14159265358979323846);
  SetColour(cr, kInk);
  Text(cr, 0, 0, p.value_label, Align::kCentre);
  cairo_restore(cr);
}

// Room for title and subtitle, found before there is a surface to draw them on.
double TitleWidth(const Picture& p) {
  const Cairo probe(cairo_image_surface_create(CAIRO_FORMAT_RGB24, 1, 1));
  SetFont(probe.context, 21, true);
  const double title = TextWidth(probe.context, p.title);
  SetFont(probe.context, 14);
  return std::max(title, TextWidth(probe.context, p.subtitle));
}

void DrawTitle(cairo_t* cr, const Picture& p) {
  SetColour(cr, kInk);
  SetFont(cr, 21, true);
  Text(cr, kLeft, 36, p.title);
  SetFont(cr, 14);
  SetColour(cr, kInk, 0.75);
  Text(cr, kLeft, 60, p.subtitle);
}

std::string PngBytes(cairo_surface_t* surface) {
  std::string bytes;
  const auto append = [](void* to, const unsigned char* data, unsigned int n) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), n);
    return CAIRO_STATUS_SUCCESS;
  };
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface, append, &bytes);
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(std::string("picture: ") + cairo_status_to_string(status));
  }
  return bytes;
}

}  // namespace

std::string RenderPng(const Picture& picture) {
  const View view = ViewOf(picture.geometry);
  const double width = std::min(
      kWidest, std::max(view.width() + kLeft + kRight, kLeft + TitleWidth(picture) + 24.0));
  const Cairo cairo(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                               static_cast<int>(std::ceil(width)),
                                               static_cast<int>(view.height() + kTop + kBottom)));
  cairo_t* cr = cairo.context;
  cairo_set_source_rgb(cr, 1, 1, 1);
  cairo_paint(cr);
  DrawTitle(cr, picture);
  DrawMap(cr, view, picture);
  DrawGridLines(cr, view);
  DrawLines(cr, view, picture);
  DrawLegend(cr, view, picture);
  DrawScaleBar(cr, view);
  DrawColourBar(cr, view, picture);
  return PngBytes(cairo.surface);
}

}  // namespace seastitch
