#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/survey_reader.hpp"

namespace seastitch {

// What a column of a text file holds. Value = text * scale, which has unit and sign in it.
struct TextColumn {
  // time: "epoch" [s]; "year" "month" "day" "hour" "minute" "second"; "date" (2024-05-02), "clock"
  // (10:20:30.5), "iso" (both, with T or a blank that is not the delimiter).
  // place: "latitude" "longitude" [deg], "north" "east" [m, of a grid], "depth" (down) and "height"
  // (up) [m]. "heading" "roll" "pitch" [deg], "heave" [m, down].
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

  // A time and a place must be among the columns.
  std::string Validate() const;

  static TextNavigationFormat Fnv();  // MB-System .fnv
  static TextNavigationFormat Na0();  // MB-System .na0, .na1 (mbnavadjust)
};

// Navigation in lines of text. Columns that a line does not have, or that are empty, are not given.
// Counts besides: text_time_not_rising (lines, left out).
class TextNavigationReader : public SurveyReader {
 public:
  // Throws std::invalid_argument where the format does not hold.
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
