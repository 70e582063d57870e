#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/time.hpp"
#include "tests/support/temporary_dir.hpp"

// A small survey in every format that is read, right or with a fault.
namespace seastitch {

// Formats of the inputs. Navigation alone (kSbet, kText) lies beside a .kmall, and soundings alone
// (kLas, kXyz) beside a track.
enum class SurveyFormat { kKmall, kAll, kS7k, kXtf, kGsf, kCereal, kSbet, kText, kLas, kXyz };
inline constexpr int kSurveyFormats = 10;

// What is wrong with a survey. A format in which a fault cannot be ignores it.
struct SurveyFaults {
  bool no_profile = false;
  bool no_attitude = false;      // a heading alone
  bool two_heads = false;        // pings take turns
  double water_line_m = 0.0;     // z of the water line, from the middle of the survey on
  double sensors_ahead_s = 0.0;  // of the sonar's clock, for positions and motion
  bool weeks_overflow = false;   // stamps of positions are 1024 weeks early
  bool week_ends = false;        // the GPS week, in the middle of the survey
  bool in_utc = false;           // times that should be GPS time
  double jump_s = 0.0;           // of the stamps of eight pings
  double pause_s = 0.0;          // in the middle; no fault
  bool in_feet = false;          // the grid, and depths
};

// 240 pings at 2 Hz of 61 beams from a vehicle at 1.5 m/s, 10 m below the water line and 20 m above
// a flat bed.
class SmallSurvey {
 public:
  static constexpr int kPings = 240;
  static Time Start(const SurveyFaults& faults);

  SmallSurvey(SurveyFormat format, const SurveyFaults& faults);

  // The file that the format is about: its head, and what follows by time.
  const std::string& head() const { return head_; }
  const std::vector<std::string>& records() const { return records_; }
  std::string bytes() const;
  // Writes `bytes` as that file, and those beside it. Returns what a command is given; the file
  // itself comes first.
  std::vector<std::filesystem::path> Write(const std::string& bytes, const TemporaryDir& dir) const;

 private:
  void WriteKmall();
  void WriteAll();
  void WriteS7k();
  void WriteXtf();
  void WriteGsf();
  void WriteCereal();
  void WriteSbet();
  void WriteText();
  void WriteLas();
  void WriteXyz();

  void Add(const std::vector<std::uint8_t>& record);
  double At(double t_s) const;  // with the pause
  Time StampOf(int ping) const;

  SurveyFormat format_;
  SurveyFaults faults_;
  std::string head_;
  std::vector<std::string> records_;
};

}  // namespace seastitch
