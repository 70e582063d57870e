#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/lines/text_table.hpp"

namespace seastitch {

struct TextNavigationFormat {
  // Beside time: "latitude" "longitude" [deg], "north" "east" of a grid [m], "depth" (positive
  // down) and "height" (positive up) [m], "heading" "roll" "pitch" [deg], "heave" (positive down)
  // [m].
  std::vector<TextColumn> columns;
  std::string source = "text";  // of the samples
  char delimiter = ' ';         // ' ': any run of blanks and tabs
  std::size_t header_lines = 0;
  char comment = '#';  // lines that begin so are left out

  // Position of a point of the grid. Empty: the grid is unknown.
  std::function<std::optional<GeoPosition>(const Eigen::Vector2d& north_east_m)> from_grid;

  // The columns must include a time and a position.
  std::string Validate() const;

  static TextNavigationFormat Fnv();  // MB-System .fnv
  static TextNavigationFormat Na0();  // MB-System .na0, .na1 (mbnavadjust)
};

// Reader of navigation in lines of text. A column that is empty or missing in a line is absent in
// its record. Also counts text_time_not_rising (lines, left out).
class TextNavigationReader : public TextLineReader {
 public:
  // Throws std::invalid_argument where the format is unusable.
  explicit TextNavigationReader(TextNavigationFormat format);

 protected:
  void ReadLine(std::string_view line, std::vector<SurveyRecord>* out) override;

 private:
  std::optional<NavigationRecord> SampleOf(std::string_view line, std::string* problem) const;

  TextNavigationFormat format_;
  std::size_t lines_ = 0;
  std::optional<Time> last_;
};

}  // namespace seastitch
