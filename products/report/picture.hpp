#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/core/grid.hpp"
#include "viewer/colours.hpp"

// A raster as a picture for people: axes in metres, colour bar with unit, scale bar, lines on top.
namespace seastitch {

struct PictureLine {
  std::vector<Eigen::Vector2d> north_east;
  Rgb colour;
  double width_px = 1.5;
  double opacity = 1.0;
  std::string legend;  // lines of one legend are named once; empty: not named
};

struct Picture {
  std::string title;
  std::string subtitle;
  std::string value_label;  // beside the colour bar, with unit
  GridGeometry geometry;
  std::vector<float> values;    // grid order; kNoData of raster.hpp is left blank
  std::vector<float> underlay;  // empty, or values: cells with one have a pale grey background
  double lowest = 0.0;          // ends of the colour bar
  double highest = 1.0;
  bool deeper_is_down = false;  // colour bar: highest value at the bottom
  bool hill_shade = false;      // values are depths, lit from the north-west
  const ColourScale* colours = nullptr;
  std::vector<PictureLine> lines;
};

// PNG bytes, at most 1600 pixels a side; cells are averaged where there are more of them than
// pixels. The same picture gives the same bytes. Throws std::runtime_error where Cairo fails.
std::string RenderPng(const Picture& picture);

}  // namespace seastitch
