#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/survey_reader.hpp"

// Tables of numbers as text, one row a line.
namespace seastitch {

// A column of a text file. Value = text * scale: the scale converts unit and sign.
struct TextColumn {
  // Time, UTC: "epoch" (since 1970) [s]; "year" "month" "day" "hour" "minute" "second"; "date"
  // (2024-05-02, 20240502), "clock" (10:20:30.5, 102030.5), "iso" (both, with T or a blank that is
  // not the delimiter, and Z, an offset such as +02:00, or nothing at the end). "latitude" and
  // "longitude" [deg] may have minutes, seconds and the letter of the hemisphere. Other quantities
  // are numbers, whose names are those of the format. Where the delimiter is no comma, a comma may
  // stand for the point.
  std::string quantity;
  std::size_t column = 0;  // from 0
  double scale = 1.0;
};

// The columns of a line, as text. A delimiter between quotation marks is no delimiter; the marks
// are taken off.
std::vector<std::string_view> TextColumns(std::string_view line, char delimiter);

// Values by quantity; "date", "clock" and "iso" as "year" to "second" and "utc_offset" [s].
using TextNumbers = std::map<std::string, double, std::less<>>;
std::optional<double> Find(const TextNumbers& numbers, std::string_view quantity);

// A column that is empty or missing in the line is absent. Nothing: a column holds something else;
// problem, unless it is null, is then which one, and what it should hold.
std::optional<TextNumbers> ReadTextRow(std::string_view line,
                                       char delimiter,
                                       const std::vector<TextColumn>& columns,
                                       std::string* problem = nullptr);
// Nothing: there is no time, or it cannot be.
std::optional<Time> TimeOf(const TextNumbers& numbers);

// What is wrong with the columns; empty: nothing. quantities: those beside the ones of time.
std::string ProblemWith(const std::vector<TextColumn>& columns,
                        const std::vector<std::string>& quantities);
bool HasColumns(const std::vector<TextColumn>& columns, const std::vector<std::string>& quantities);
// kPart: of a date and a clock one is missing.
enum class TimeColumns : std::uint8_t { kNone, kPart, kWhole };
TimeColumns TimeColumnsAmong(const std::vector<TextColumn>& columns);

// Reader of a file of lines, of at most 4096 bytes each.
class TextLineReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) final;
  // A line without blanks at its ends.
  virtual void ReadLine(std::string_view line, std::vector<SurveyRecord>* out) = 0;
  // Notes why a line cannot be read. The first note stays.
  void Note(std::size_t line, const std::string& problem);
};

}  // namespace seastitch
