#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "codecs/survey_reader.hpp"
#include "survey/line/line_placer.hpp"

namespace seastitch {

// How the soundings of a line are placed.
struct LinePlan {
  LineParams params;
  std::optional<Time> begin;  // the first sounding is not before it
  std::string text;           // for people: times, coordinate reference system, z
  std::string warning{};      // what was assumed of its depths; empty: nothing
};

// Reader of a file of soundings by line (IsLineFile).
std::unique_ptr<SurveyReader> LineReader(const std::filesystem::path& path,
                                         std::unique_ptr<LinePoints> points);

// Reads the whole file once, and compares it with the track. Throws DataError with the reason, one
// line, if its soundings cannot be placed.
LinePlan PlanLine(const std::filesystem::path& path, std::shared_ptr<const LineTrack> track);

// Time of the first sounding, where the file states times without a track. At most 1 MB is read.
std::optional<Time> FirstTimeOf(const std::filesystem::path& line);

}  // namespace seastitch
