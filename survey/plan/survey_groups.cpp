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

#include "common/core/median.hpp"
#include "common/core/pose.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/read/checked_reader.hpp"
#include "survey/read/sbet_beside.hpp"
#include "survey/read/survey_stream.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestPauseS = 12.0 * 3600.0;
constexpr double kFastestMps = 20.0;
// Two positions may differ by this much at one place: lever arms, a GPS without corrections.
constexpr double kSamePlaceM = 500.0;
// Bytes of a head that are read in search of a ping; of positions and the installation, which stand
// near the beginning where a file has them; and of an end.
constexpr std::uint64_t kHeadBytes = 16 * 1024 * 1024;
constexpr std::uint64_t kStatedBytes = 4 * 1024 * 1024;
constexpr std::uint64_t kEndBytes = 1024 * 1024;
// A record of an end that is later than this after the begin is damaged.
constexpr double kLongestFileS = 7.0 * 86'400.0;

// Reads `bytes` of a file from `from` on, piece by piece, until `take` returns false: a function of
// a record and of the bytes read so far.
template <class Take>
void ReadPart(const fs::path& file, std::uint64_t from, std::uint64_t bytes, Take&& take) {
  CheckedReader reader(ReaderFor(file));
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(from));
  std::vector<std::uint8_t> piece(65'536);
  for (std::uint64_t read = 0; read < bytes; read += piece.size()) {
    in.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in.gcount());
    if (got == 0) break;
    for (const SurveyRecord& record : reader.Add(Bytes(piece.data(), got)))
      if (!take(record, read + got)) return;
  }
  for (const SurveyRecord& record : reader.Finish())
    if (!take(record, bytes)) return;
}

// Positions of a head, of which one may be wrong.
struct Places {
  static constexpr std::size_t kEnough = 5;
  std::vector<TimedPosition> positions;

  // Their median, and the time of the middle one.
  void Give(FileHead* head) const {
    if (positions.empty()) return;
    const TimedPosition& first = positions.front();
    std::vector<double> north, east;
    for (const TimedPosition& p : positions) {
      north.push_back(p.latitude_rad);
      east.push_back(WrapAngle(p.longitude_rad - first.longitude_rad));
    }
    head->place = GeoPosition{Median(north), WrapAngle(first.longitude_rad + Median(east))};
    head->place_time = positions[positions.size() / 2].time;
  }
};

void TakeHead(const SurveyRecord& record, FileHead* head, Places* places) {
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
  if (navigation != nullptr && navigation->position && places->positions.size() < Places::kEnough)
    places->positions.push_back({*navigation->position, t});
}

bool IsStated(const std::string& serial) { return !serial.empty() && serial != "0"; }

// What both files state is of one sonar.
bool MayBeOneSonar(const FileHead& a, const FileHead& b) {
  if (!a.installation || !b.installation) return true;
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

  // None of its files contradicts this one; one that states no sonar has the format of one of them.
  bool Takes(const FileHead& head) const {
    return std::all_of(heads.begin(),
                       heads.end(),
                       [&](const FileHead* own) { return MayBeOneSonar(*own, head); }) &&
           (head.installation || std::any_of(heads.begin(), heads.end(), [&](const FileHead* own) {
              return own->format == head.format;
            }));
  }
};

// The reason for which `next` does not continue the files before it, for people; empty: it does.
// end: of these. placed: the last of them with a position; installed: with an installation.
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

void Add(const FileHead& head, SurveyGroup* group) {
  group->files.push_back(head.path);
  group->has_pings = group->has_pings || head.has_pings;
  if (head.installation && group->sonar.empty()) group->sonar = head.installation->model;
}

std::vector<SurveyGroup> Split(const Sonar& sonar, bool one_dive) {
  std::vector<SurveyGroup> groups;
  const FileHead* placed = nullptr;
  const FileHead* installed = nullptr;
  std::optional<Time> end;  // of the files of the last group
  std::vector<const FileHead*> without_time;
  for (const FileHead* const head : sonar.heads) {
    if (!head->begin) {
      without_time.push_back(head);
      continue;
    }
    std::string reason;
    if (end && !one_dive) reason = BreakBetween(*head, *end, placed, installed);
    if (groups.empty() || !reason.empty()) {
      groups.push_back({{}, head->begin, {}, reason});
      placed = installed = nullptr;
      end.reset();
    }
    Add(*head, &groups.back());
    end = std::max(end, head->end);  // no time is before any
    if (head->place) placed = head;
    if (head->installation) installed = head;
  }
  if (without_time.empty()) return groups;
  // A file without a record joins the first dive that has soundings; it makes none of another's
  // files.
  auto with_pings = std::find_if(
      groups.begin(), groups.end(), [](const SurveyGroup& group) { return group.has_pings; });
  if (with_pings == groups.end()) with_pings = groups.insert(groups.end(), SurveyGroup{});
  for (const FileHead* const head : without_time) Add(*head, &*with_pings);
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
  if (!reader || IsExternalNavigation(file)) return head;
  const SurveyReader& of_format = *reader;
  head.format = typeid(of_format).name();
  Places places;
  ReadPart(file, 0, kHeadBytes, [&](const SurveyRecord& record, std::uint64_t read) {
    TakeHead(record, &head, &places);
    const bool has_places = places.positions.size() >= Places::kEnough;
    return !head.has_pings || ((!has_places || !head.installation) && read < kStatedBytes);
  });
  places.Give(&head);
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
    const auto same = std::find_if(
        sonars.begin(), sonars.end(), [&](const Sonar& sonar) { return sonar.Takes(*head); });
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
