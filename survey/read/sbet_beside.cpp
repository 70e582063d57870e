#include "survey/read/sbet_beside.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "codecs/calendar.hpp"
#include "common/core/bytes.hpp"
#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "products/files/navigation_files.hpp"
#include "survey/line/text_columns.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRecordBytes = 136;
constexpr double kUnderWayMps = 1.0;

// The values of one record that are needed here.
struct Row : GeoPoint {
  double week_s, heading_rad, wander_rad;
};

// Records of a file, by number.
class SbetRows {
 public:
  explicit SbetRows(const fs::path& path)
      : in_(path, std::ios::binary), size_(fs::file_size(path) / kRecordBytes) {}

  std::size_t size() const { return size_; }
  // Nothing: numbers that cannot be, or the file ends before.
  std::optional<Row> At(std::size_t i) {
    std::array<std::uint8_t, kRecordBytes> record{};
    in_.clear();
    if (i != next_) in_.seekg(static_cast<std::streamoff>(i * kRecordBytes));
    next_ = i + 1;
    if (!in_.read(reinterpret_cast<char*>(record.data()), std::streamsize{kRecordBytes}))
      return std::nullopt;
    ByteReader reader(Bytes(record.data(), record.size()));
    std::array<double, 11> v{};
    for (double& number : v) number = reader.Le<double>();
    // Limits of seconds of a week, radians, metres and metres per second.
    const bool plausible =
        std::all_of(v.begin(), v.end(), [](double n) { return std::abs(n) < 1e7; });
    if (!plausible || v[0] < 0.0 || v[0] > 2.0 * kGpsWeekS) return std::nullopt;
    return Row{{v[1], v[2]}, v[0], v[9], v[10]};
  }
  // The first record from that time on, in a file whose times rise.
  std::optional<Row> From(double week_s) {
    std::size_t begin = 0, end = size_;
    while (begin < end) {
      const std::size_t middle = begin + (end - begin) / 2;
      const std::optional<Row> row = At(middle);
      if (row && row->week_s < week_s)
        begin = middle + 1;
      else
        end = middle;
    }
    return At(begin);
  }

 private:
  std::ifstream in_;
  std::size_t size_;
  std::size_t next_ = 0;  // the record after the last that was read
};

// One record per second of the first half hour.
std::vector<Row> RowsOf(const fs::path& path) {
  SbetRows file(path);
  std::vector<Row> rows;
  for (std::size_t i = 0; i < file.size() && rows.size() < 1800; ++i) {
    const std::optional<Row> row = file.At(i);
    if (row && (rows.empty() || row->week_s - rows.back().week_s >= 1.0)) rows.push_back(*row);
  }
  if (rows.empty()) throw std::runtime_error(path.string() + ": no SBET record in it");
  return rows;
}

// Median distance [m] of the survey's own positions from those of the SBET at the same times.
std::optional<double> MedianDistance(SbetRows* rows,
                                     const SbetParams& params,
                                     const std::vector<TimedPosition>& own) {
  constexpr std::size_t kLeast = 5;
  std::vector<double> distances_m;
  for (const TimedPosition& p : own) {
    const double week_s = ToSeconds(p.time - params.week_start) + params.leap_seconds;
    const std::optional<Row> row = rows->From(week_s);
    if (!row || std::abs(row->week_s - week_s) > 1.0) continue;
    distances_m.push_back(DistanceM(p, *row));
  }
  if (distances_m.size() < kLeast) return std::nullopt;
  return Median(distances_m);
}

// True if the SBET's positions agree clearly better with the survey's own as UTC than as GPS time,
// of which the difference is 18 s. At rest both agree.
bool IsUtc(const fs::path& path, const SbetParams& gps, const std::vector<TimedPosition>& own) {
  constexpr double kLeastM = 5.0;
  SbetRows rows(path);
  SbetParams utc = gps;
  utc.leap_seconds = 0.0;
  const std::optional<double> gps_m = MedianDistance(&rows, gps, own);
  const std::optional<double> utc_m = MedianDistance(&rows, utc, own);
  return gps_m && utc_m && *gps_m > kLeastM && *utc_m < 0.5 * *gps_m;
}

constexpr std::array kBeside{"sbet", "text", "fnv", "na0"};

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

int WanderSign(const std::vector<Row>& rows) {
  std::array<double, 3> off{};  // sums for -1, 0 and +1
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double dt_s = rows[i].week_s - rows[i - 1].week_s;
    const Eigen::Vector2d way_m = NorthEastBetween(rows[i - 1], rows[i]);
    if (Hypotenuse(way_m.x(), way_m.y()) < kUnderWayMps * dt_s || dt_s > 5.0) continue;
    const double course_rad = std::atan2(way_m.y(), way_m.x());
    for (int sign = -1; sign <= 1; ++sign)
      off[static_cast<std::size_t>(sign + 1)] +=
          std::abs(WrapAngle(rows[i].heading_rad + sign * rows[i].wander_rad - course_rad));
  }
  if (off[1] <= off[0] && off[1] <= off[2]) return 0;
  return off[0] < off[2] ? -1 : 1;
}

}  // namespace

bool IsSbet(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  if (extension != ".sbet" && extension != ".out") return false;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  // Other programs' files end in .out, too. A .sbet may be cut off within a record.
  return !error && size >= kRecordBytes && (extension == ".sbet" || size % kRecordBytes == 0);
}

bool IsExternalNavigation(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  return IsSbet(path) || extension == ".fnv" || extension == ".na0" || extension == ".na1" ||
         HasTextColumns(path);
}

bool IsExternal(const std::string& source) {
  return std::find(kBeside.begin(), kBeside.end(), source) != kBeside.end();
}

std::string BesideAmong(const std::map<std::string, std::int64_t>& counts) {
  for (const char* const source : kBeside)
    if (const auto found = counts.find(source); found != counts.end() && found->second > 0)
      return source;
  return "";
}

SbetParams SbetParamsFor(const fs::path& path,
                         Time of_survey,
                         const std::vector<TimedPosition>& own) {
  const std::vector<Row> rows = RowsOf(path);
  const double gps_s = GpsSeconds(of_survey);
  // Week in which a record is nearest to the survey: the file may begin in the week before.
  const double week = std::round((gps_s - rows.front().week_s) / kGpsWeekS);
  SbetParams params;
  params.leap_seconds = std::round(gps_s - ToSeconds(of_survey - kGpsEpoch));
  params.week_start = kGpsEpoch + FromSeconds(week * kGpsWeekS);
  params.wander_sign = WanderSign(rows);
  if (IsUtc(path, params, own)) params.leap_seconds = 0.0;
  return params;
}

}  // namespace seastitch
