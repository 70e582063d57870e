#include "codecs/lines/xyz_file.hpp"

#include <stdexcept>

namespace seastitch {
namespace {

const std::vector<std::string> kQuantities{
    "east", "north", "longitude", "latitude", "depth", "height", "z", "line", "used"};

std::optional<double> FindFirst(const TextNumbers& numbers,
                                std::initializer_list<const char*> quantities) {
  for (const char* const quantity : quantities)
    if (const auto found = Find(numbers, quantity)) return found;
  return std::nullopt;
}

// Nothing: a number is missing or cannot be.
std::optional<LinePoint> PointOf(const TextNumbers& numbers, bool has_time) {
  const auto x = FindFirst(numbers, {"longitude", "east"});
  const auto y = FindFirst(numbers, {"latitude", "north"});
  const auto z = FindFirst(numbers, {"depth", "height", "z"});
  const double line = Find(numbers, "line").value_or(0.0);
  if (!x || !y || !z || !(line >= 0.0 && line <= 65'535.0)) return std::nullopt;
  LinePoint point;
  point.p = {*x, *y, *z};
  point.line = static_cast<std::uint16_t>(line);
  if (!has_time) return point;
  const auto time = TimeOf(numbers);
  if (!time) return std::nullopt;
  point.time_s = ToSeconds(time->time_since_epoch());
  return point;
}

}  // namespace

std::string XyzFormat::Validate() const {
  if (const std::string problem = ProblemWith(columns, kQuantities); !problem.empty())
    return problem;
  const bool grid = HasColumns(columns, {"east", "north"});
  const bool geographic = HasColumns(columns, {"longitude", "latitude"});
  if (grid == geographic) return "columns give either east and north or longitude and latitude";
  const int z = int{HasColumns(columns, {"depth"})} + int{HasColumns(columns, {"height"})} +
                int{HasColumns(columns, {"z"})};
  if (z != 1) return "one column gives the depth, the height or z";
  if (TimeColumnsAmong(columns) == TimeColumns::kPart) return "the time is not complete";
  return "";
}

XyzFormat XyzFormat::For(std::string_view line) {
  XyzFormat format;
  for (const char delimiter : {',', ';'})
    if (line.find(delimiter) != std::string_view::npos) format.delimiter = delimiter;
  format.columns = {{"east", 0}, {"north", 1}, {"z", 2}};
  return format;
}

XyzFormat XyzFormat::Export() {
  XyzFormat format;
  format.columns = {{"longitude", 0}, {"latitude", 1}, {"depth", 2}, {"iso", 3}, {"used", 9}};
  return format;
}

XyzFileReader::XyzFileReader(XyzFormat format, std::unique_ptr<LinePoints> points)
    : format_(std::move(format)), points_(std::move(points)) {
  if (const std::string problem = format_.Validate(); !problem.empty())
    throw std::invalid_argument(problem);
  has_time_ = TimeColumnsAmong(format_.columns) == TimeColumns::kWhole;
}

Counters XyzFileReader::counters() const {
  Counters all = SurveyReader::counters();
  for (const auto& [name, value] : points_->counters()) all[name] += value;
  return all;
}

void XyzFileReader::ReadLine(std::string_view line, std::vector<SurveyRecord>* out) {
  if (lines_++ < format_.header_lines || line.empty() || line.front() == format_.comment) return;
  std::string problem = "x, y and z, or the time, are not there";
  const auto numbers = ReadTextRow(line, format_.delimiter, format_.columns, &problem);
  // A line of words is a heading.
  constexpr std::string_view kNumber = "+-.0123456789\"";
  const bool is_number = kNumber.find(line.front()) != std::string_view::npos;
  if (!numbers && is_number) Note(lines_, problem);
  if (!numbers && in_heading_) return;
  in_heading_ = false;
  const auto point = numbers ? PointOf(*numbers, has_time_) : std::nullopt;
  if (!point) {
    Note(lines_, problem);
    return Count("xyz_malformed");
  }
  if (Find(*numbers, "used") == 0.0) return Count("xyz_points_not_used");
  points_->Add(*point, out);
}

}  // namespace seastitch
