#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "codecs/lines/line_points.hpp"
#include "codecs/lines/text_table.hpp"

namespace seastitch {

struct XyzFormat {
  char delimiter = ' ';  // ' ': any run of blanks and tabs
  std::size_t header_lines = 0;
  char comment = '#';  // lines that begin so are left out
  // Beside time, which may be absent: "east" "north", or "longitude" "latitude"; "depth" (positive
  // down), "height" (positive up) or "z" (one of them) [m]; "line", a number; "used", 0 or 1.
  std::vector<TextColumn> columns;

  std::string Validate() const;

  // x, y, z by the delimiter that this line has.
  static XyzFormat For(std::string_view line);
  // That of `soundings.xyz` of a replay.
  static XyzFormat Export();
  static constexpr std::string_view kExportHeading =
      "# longitude latitude depth_m time file line ping head beam used";
};

// Reader of soundings as lines of text. Lines of words before the first sounding are its heading.
// Also counts xyz_malformed (lines) and xyz_points_not_used (used is 0).
class XyzFileReader : public TextLineReader {
 public:
  // Throws std::invalid_argument where the format is unusable.
  XyzFileReader(XyzFormat format, std::unique_ptr<LinePoints> points);

  Counters counters() const override;

 protected:
  void ReadLine(std::string_view line, std::vector<SurveyRecord>* out) override;
  void End(std::vector<SurveyRecord>* out) override { points_->Finish(out); }

 private:
  XyzFormat format_;
  std::unique_ptr<LinePoints> points_;
  bool has_time_ = false;
  std::size_t lines_ = 0;
  bool in_heading_ = true;
};

}  // namespace seastitch
