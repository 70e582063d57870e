#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// A column of a text file. Value = text * scale: the scale converts unit and sign.
struct TextColumn {
  // Time, UTC: "epoch" (since 1970) [s]; "year" "month" "day" "hour" "minute" "second"; "date"
  // (2024-05-02), "clock" (10:20:30.5), "iso" (both, with T or a blank that is not the delimiter).
  // Position: "latitude" "longitude" [deg], "north" "east" of a grid [m], "depth" (positive down)
  // and "height" (positive up) [m]. Attitude: "heading" "roll" "pitch" [deg]. "heave" (positive
  // down) [m].
  std::string quantity;
  std::size_t column = 0;  // from 0
  double scale = 1.0;
};

struct TextNavigationFormat {
  std::string source = "text";  // of the samples
  char delimiter = ' ';         // ' ': any run of blanks and tabs
  std::size_t header_lines = 0;
  char comment = '#';  // lines that begin so are left out
  std::vector<TextColumn> columns;

  // The columns must include a time and a position.
  std::string Validate() const;

  static TextNavigationFormat Fnv();  // MB-System .fnv
  static TextNavigationFormat Na0();  // MB-System .na0, .na1 (mbnavadjust)
};

// The columns of a line, as text.
std::vector<std::string_view> TextColumns(std::string_view line, char delimiter);

// Reader of navigation in lines of text. A column that is empty or missing in a line is absent in
// its record. Also counts text_time_not_rising (lines, left out).
class TextNavigationReader : public SurveyReader {
 public:
  // Throws std::invalid_argument where the format is unusable.
  explicit TextNavigationReader(TextNavigationFormat format);

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  std::optional<NavigationRecord> ReadLine(std::string_view line) const;

  TextNavigationFormat format_;
  std::size_t lines_ = 0;
  std::optional<Time> last_;
};

}  // namespace seastitch
