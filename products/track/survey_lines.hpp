#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "products/map/map_points.hpp"
#include "products/survey.hpp"

// Survey lines: runs of submaps between two turns, gaps or dives.
namespace seastitch {

// Of the submaps of the survey, by rising number.
struct SurveyLine {
  std::size_t first = 0;
  std::size_t last = 0;
};
std::vector<SurveyLine> LinesOf(const Survey& survey);

// As one field of a CSV: in quotes where it needs them.
std::string CsvText(const std::string& text);

// Text of lines.csv, one row per survey line: input, times, and the graph's correction: the mean
// over its submaps, north and east, along and to starboard [m], and clockwise [degrees]. The sigma
// of its position is that of one submap, because its submaps have common errors. length_m is the
// length along the track as navigated, without turns; runs of submaps that are turns for more than
// half of their length have no row, but keep their number. An empty field is not known.
std::string LinesCsv(const Survey& survey,
                     const SurveyPoses& dead_reckoned,
                     const SurveyPoses& delivered,
                     const std::vector<std::optional<Eigen::Vector3d>>& sigmas,
                     MapAxes axes);

}  // namespace seastitch
