#include "codecs/navigation/text_navigation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "codecs/text.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

const std::vector<std::string> kQuantities{"north",
                                           "east",
                                           "depth",
                                           "height",
                                           "latitude",
                                           "longitude",
                                           "heading",
                                           "roll",
                                           "pitch",
                                           "heave"};

bool FillPlace(const TextNumbers& n, NavigationRecord* sample) {
  const auto latitude_deg = Find(n, "latitude");
  const auto longitude_deg = Find(n, "longitude");
  const auto north_m = Find(n, "north");
  const auto east_m = Find(n, "east");
  if (latitude_deg && longitude_deg) {
    if (std::abs(*latitude_deg) > 90.0 || std::abs(*longitude_deg) > 360.0) return false;
    sample->position = GeoPosition{Deg2Rad(*latitude_deg), WrapAngle(Deg2Rad(*longitude_deg))};
  }
  if (north_m && east_m) sample->grid_north_east_m = Eigen::Vector2d(*north_m, *east_m);
  return sample->position || sample->grid_north_east_m;
}

void FillAttitude(const TextNumbers& n, NavigationRecord* sample) {
  const auto heading_deg = Find(n, "heading");
  const auto roll_deg = Find(n, "roll");
  const auto pitch_deg = Find(n, "pitch");
  if (heading_deg && roll_deg && pitch_deg)
    sample->attitude = AttitudeFromDegrees(*roll_deg, *pitch_deg, *heading_deg);
  else if (heading_deg)
    sample->heading_rad = Deg2Rad(*heading_deg);
  else if (roll_deg && pitch_deg)
    sample->roll_pitch_rad = Eigen::Vector2d(Deg2Rad(*roll_deg), Deg2Rad(*pitch_deg));
}

// Both formats of MB-System have the same columns up to roll and pitch.
TextNavigationFormat MbSystem(const std::string& source) {
  TextNavigationFormat format;
  format.source = source;
  std::size_t column = 0;
  for (const char* quantity : {"year", "month", "day", "hour", "minute", "second"})
    format.columns.push_back({quantity, column++});
  for (const auto& [quantity, at] : {std::pair{"longitude", 7u},
                                     std::pair{"latitude", 8u},
                                     std::pair{"heading", 9u},
                                     std::pair{"depth", 11u},
                                     std::pair{"roll", 12u},
                                     std::pair{"pitch", 13u}})
    format.columns.push_back({quantity, at});
  return format;
}

}  // namespace

TextNavigationFormat TextNavigationFormat::Fnv() { return MbSystem("fnv"); }
TextNavigationFormat TextNavigationFormat::Na0() { return MbSystem("na0"); }

std::string TextNavigationFormat::Validate() const {
  if (const std::string problem = ProblemWith(columns, kQuantities); !problem.empty())
    return problem;
  if (TimeColumnsAmong(columns) != TimeColumns::kWhole) return "no column gives the time";
  if (!HasColumns(columns, {"latitude", "longitude"}) && !HasColumns(columns, {"north", "east"}))
    return "no columns give the position";
  return "";
}

TextNavigationReader::TextNavigationReader(TextNavigationFormat format)
    : format_(std::move(format)) {
  if (const std::string problem = format_.Validate(); !problem.empty())
    throw std::invalid_argument(problem);
}

void TextNavigationReader::ReadLine(std::string_view line, std::vector<SurveyRecord>* out) {
  if (lines_++ < format_.header_lines || line.empty() || line.front() == format_.comment) return;
  std::string problem = "no time and position";
  auto sample = SampleOf(line, &problem);
  if (!sample) {
    Note(lines_, problem);
    return Count("text_malformed");
  }
  if (last_ && sample->time <= *last_) {
    if (sample->time < *last_) ++late_;  // lines of one time are no disorder
    return Count("text_time_not_rising");
  }
  last_ = sample->time;
  out->emplace_back(std::move(*sample));
}

std::optional<NavigationRecord> TextNavigationReader::SampleOf(std::string_view line,
                                                               std::string* problem) const {
  const auto numbers = ReadTextRow(line, format_.delimiter, format_.columns, problem);
  const auto time = numbers ? TimeOf(*numbers) : std::nullopt;
  NavigationRecord sample;
  if (!time || !FillPlace(*numbers, &sample)) return std::nullopt;
  sample.time = *time;
  sample.source = format_.source;
  sample.depth_m = Find(*numbers, "depth");
  sample.height_m = Find(*numbers, "height");
  sample.heave_m = Find(*numbers, "heave");
  FillAttitude(*numbers, &sample);
  if (!format_.from_grid || sample.position) return sample;
  sample.position = format_.from_grid(*sample.grid_north_east_m);
  sample.grid_north_east_m.reset();
  return sample.position ? std::optional(sample) : std::nullopt;
}

}  // namespace seastitch
