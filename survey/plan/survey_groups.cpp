#include "survey/plan/survey_groups.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <typeinfo>
#include <utility>
#include <variant>

#include "common/core/pose.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestPauseS = 12.0 * 3600.0;
constexpr double kFastestMps = 20.0;
// Two positions may differ by this much at one place: lever arms, a GPS without corrections.
constexpr double kSamePlaceM = 500.0;
// Bytes of a head that are read in search of a ping and a position; of the installation, which
// stands at the beginning where a format has one; and of an end.
constexpr std::uint64_t kHeadBytes = 16 * 1024 * 1024;
constexpr std::uint64_t kInstallationBytes = 1024 * 1024;
constexpr std::uint64_t kEndBytes = 1024 * 1024;
// A record of an end that is later than this after the begin is damaged.
constexpr double kLongestFileS = 7.0 * 86'400.0;

double DistanceM(const GivenPosition& a, const GivenPosition& b) {
  constexpr double kEarthM = 6'371'000.0;
  const double north = a.latitude_rad - b.latitude_rad;
  const double east = std::cos(a.latitude_rad) * WrapAngle(a.longitude_rad - b.longitude_rad);
  return kEarthM * std::hypot(north, east);
}

// Reads `bytes` of a file from `from` on, piece by piece, until `take` returns false: a function of
// a record and of the bytes read so far.
template <class Take>
void ReadPart(const fs::path& file, std::uint64_t from, std::uint64_t bytes, Take&& take) {
  const std::unique_ptr<SurveyReader> reader = ReaderFor(file);
  if (!reader) return;
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(from));
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < bytes; read += piece.size()) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    for (const SurveyRecord& record : reader->Add(Bytes(piece.data(), got)))
      if (!take(record, read + got)) return;
  }
  for (const SurveyRecord& record : reader->Finish())
    if (!take(record, bytes)) return;
}

bool IsPing(const SurveyRecord& record) {
  return std::holds_alternative<MbesPing>(record) || std::holds_alternative<PlacedPing>(record);
}

void TakeHead(const SurveyRecord& record, FileHead* head) {
  if (const auto* const i = std::get_if<SonarInstallation>(&record)) {
    if (!head->installation || head->installation->transmitters.size() < i->transmitters.size())
      head->installation = *i;
    return;
  }
  const auto* const navigation = std::get_if<NavigationRecord>(&record);
  if (navigation == nullptr && !IsPing(record)) return;
  head->has_pings = head->has_pings || navigation == nullptr;
  const Time t = TimeOf(record);
  if (!head->begin || t < *head->begin) head->begin = t;
  if (!head->end || t > *head->end) head->end = t;
  if (navigation == nullptr || !navigation->position || head->place) return;
  head->place = *navigation->position;
  head->place_time = t;
}

bool IsStated(const std::string& serial) { return !serial.empty() && serial != "0"; }

bool IsOneSonar(const FileHead& a, const FileHead& b) {
  if (!a.installation || !b.installation) return a.format == b.format;
  if (a.installation->model != b.installation->model) return false;
  const std::string& serial = a.installation->serial;
  const std::string& other = b.installation->serial;
  return serial == other || !IsStated(serial) || !IsStated(other);
}

// Arrays and sensors stand where they stood, to 2 mm and 0.002 degrees.
bool IsInstalledAlike(const SonarInstallation& a, const SonarInstallation& b) {
  const auto same = [](const Eigen::Isometry3d& x, const Eigen::Isometry3d& y) {
    const Eigen::AngleAxisd turned(x.linear().transpose() * y.linear());
    return (x.translation() - y.translation()).norm() < 0.002 &&
           std::abs(turned.angle()) < Deg2Rad(0.002);
  };
  const auto same_arrays = [&](const auto& x, const auto& y) {
    return std::equal(
        x.begin(), x.end(), y.begin(), y.end(), [&](const auto& one, const auto& other) {
          return same(one.T_vehicle_array, other.T_vehicle_array);
        });
  };
  const auto same_sensor = [&](const InstalledSensor& sensor) {
    const InstalledSensor* const other = b.SensorOf(sensor.name);
    return !sensor.active || other == nullptr ||
           same(sensor.T_vehicle_sensor, other->T_vehicle_sensor);
  };
  return same_arrays(a.transmitters, b.transmitters) && same_arrays(a.receivers, b.receivers) &&
         std::all_of(a.sensors.begin(), a.sensors.end(), same_sensor);
}

// Files of one sonar.
struct Sonar {
  std::vector<const FileHead*> heads;
};

// The reason for which `next` does not continue `before`, for people; empty: it does. placed: the
// last file before it with a position; installed: with an installation.
std::string BreakBetween(const FileHead& next,
                         Time end,
                         const FileHead* placed,
                         const FileHead* installed) {
  char text[160];
  if (const double pause_s = ToSeconds(*next.begin - end); pause_s > kLongestPauseS) {
    std::snprintf(text, sizeof text, "%.1f h after the file before it", pause_s / 3600.0);
    return text;
  }
  if (placed != nullptr && next.place) {
    const double distance_m = DistanceM(*placed->place, *next.place);
    const double passed_s = std::abs(ToSeconds(next.place_time - placed->place_time));
    if (distance_m > kSamePlaceM + kFastestMps * passed_s) {
      std::snprintf(text, sizeof text, "%.0f km from the file before it", distance_m / 1000.0);
      return text;
    }
  }
  if (installed != nullptr && next.installation &&
      !IsInstalledAlike(*installed->installation, *next.installation))
    return "the sonar or a sensor was moved";
  return "";
}

std::vector<SurveyGroup> Split(const Sonar& sonar, bool one_dive) {
  std::vector<SurveyGroup> groups;
  const FileHead* placed = nullptr;
  const FileHead* installed = nullptr;
  Time end{};
  for (const FileHead* const head : sonar.heads) {
    std::string reason;
    if (!groups.empty() && head->begin && !one_dive)
      reason = BreakBetween(*head, end, placed, installed);
    if (groups.empty() || !reason.empty()) {
      groups.push_back({{}, head->begin, {}, reason});
      placed = installed = nullptr;
      if (head->end) end = *head->end;
    }
    SurveyGroup& group = groups.back();
    group.files.push_back(head->path);
    if (!group.begin) group.begin = head->begin;
    if (head->end) end = std::max(end, *head->end);
    if (head->place) placed = head;
    if (head->installation) installed = head;
    if (head->installation && group.sonar.empty()) group.sonar = head->installation->model;
  }
  return groups;
}

// The group whose begin is nearest to the file's; the first where the file states no time.
SurveyGroup* NearestTo(std::optional<Time> begin, std::vector<SurveyGroup>* groups) {
  const auto apart = [&](const SurveyGroup& group) {
    return begin && group.begin ? std::abs(ToSeconds(*group.begin - *begin)) : 0.0;
  };
  return &*std::min_element(groups->begin(), groups->end(), [&](const auto& a, const auto& b) {
    return apart(a) < apart(b);
  });
}

}  // namespace

FileHead HeadOf(const fs::path& file) {
  FileHead head{file, {}};
  if (IsLineFile(file)) {
    head.begin = head.end = FirstTimeOf(file);
    return head;
  }
  const std::unique_ptr<SurveyReader> reader = ReaderFor(file);
  if (!reader || IsNavigationBeside(file)) return head;
  const SurveyReader& of_format = *reader;
  head.format = typeid(of_format).name();
  ReadPart(file, 0, kHeadBytes, [&](const SurveyRecord& record, std::uint64_t read) {
    TakeHead(record, &head);
    return !head.has_pings || !head.place || (!head.installation && read < kInstallationBytes);
  });
  const std::uint64_t size = fs::file_size(file);
  if (!head.begin || size <= kEndBytes) return head;
  ReadPart(file, size - kEndBytes, kEndBytes, [&](const SurveyRecord& record, std::uint64_t) {
    if (!IsPing(record) && !std::holds_alternative<NavigationRecord>(record)) return true;
    const Time t = TimeOf(record);
    if (t > *head.end && ToSeconds(t - *head.begin) < kLongestFileS) head.end = t;
    return true;
  });
  return head;
}

std::vector<SurveyGroup> GroupSurveyFiles(const std::vector<fs::path>& files, bool one_dive) {
  std::vector<FileHead> heads;
  for (const fs::path& file : files) heads.push_back(HeadOf(file));
  std::vector<const FileHead*> by_time;
  for (const FileHead& head : heads)
    if (!head.format.empty()) by_time.push_back(&head);
  std::stable_sort(by_time.begin(), by_time.end(), [](const FileHead* a, const FileHead* b) {
    return a->begin < b->begin;
  });
  // A file that states its sonar comes before one that does not: it decides what others are like.
  std::vector<const FileHead*> stated_first = by_time;
  std::stable_partition(stated_first.begin(), stated_first.end(), [](const FileHead* head) {
    return head->installation.has_value();
  });
  std::vector<Sonar> sonars;
  for (const FileHead* const head : stated_first) {
    const auto same = std::find_if(sonars.begin(), sonars.end(), [&](const Sonar& sonar) {
      return IsOneSonar(*sonar.heads.front(), *head);
    });
    if (same == sonars.end())
      sonars.push_back({{head}});
    else
      same->heads.push_back(head);
  }
  std::vector<SurveyGroup> groups;
  for (Sonar& sonar : sonars) {
    std::stable_sort(sonar.heads.begin(), sonar.heads.end(), [](const auto* a, const auto* b) {
      return a->begin < b->begin;
    });
    for (SurveyGroup& group : Split(sonar, one_dive)) groups.push_back(std::move(group));
  }
  std::stable_sort(groups.begin(), groups.end(), [](const SurveyGroup& a, const SurveyGroup& b) {
    return a.begin < b.begin;
  });
  if (groups.empty() && !heads.empty()) groups.push_back({{}, heads.front().begin});
  for (const FileHead& head : heads) {
    if (!head.format.empty()) continue;
    if (IsLineFile(head.path)) {
      NearestTo(head.begin, &groups)->files.push_back(head.path);
      continue;
    }
    for (SurveyGroup& group : groups) group.files.push_back(head.path);
  }
  const auto place_of = [&files](const fs::path& file) {
    return std::find(files.begin(), files.end(), file) - files.begin();
  };
  for (SurveyGroup& group : groups)
    std::sort(group.files.begin(), group.files.end(), [&](const auto& a, const auto& b) {
      return place_of(a) < place_of(b);
    });
  return groups;
}

}  // namespace seastitch
