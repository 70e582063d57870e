#include "tools/map_info.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/core/time.hpp"
#include "common/geo/map_frame.hpp"
#include "products/files/navigation_files.hpp"
#include "survey/errors.hpp"
#include "survey/plan/dive_inputs.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/survey_groups.hpp"
#include "survey/replay/finished_map.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json DiveJson(const FinishedMap& map, std::int32_t number) {
  const FinishedDive& dive = map.dives[static_cast<std::size_t>(number)];
  std::size_t submaps = 0;
  Time first{}, last{};
  for (const FinishedSubmap& submap : map.submaps) {
    if (submap.dive.chain.number != number) continue;
    if (submaps++ == 0) first = submap.submap.start;
    last = submap.submap.end;
  }
  Json json{{"name", dive.name}, {"submaps", submaps}};
  if (submaps == 0) return json;
  json["first_ping"] = IsoTime(first);
  json["last_ping"] = IsoTime(last);
  return json;
}

// Registrations by the last verdict of each pair.
std::pair<std::size_t, std::size_t> Closures(const FinishedMap& map) {
  std::map<std::pair<SubmapId, SubmapId>, LoopVerdict> verdicts;
  for (const FinishedSubmap& submap : map.submaps)
    for (const RegistrationResultSet& job : submap.dive.replayed_jobs)
      for (const GraphEdge& edge : job.edges) verdicts[{edge.from, edge.to}] = edge.verdict;
  const auto accepted = std::count_if(verdicts.begin(), verdicts.end(), [](const auto& pair) {
    return pair.second == LoopVerdict::kAccepted;
  });
  return {static_cast<std::size_t>(accepted), verdicts.size() - static_cast<std::size_t>(accepted)};
}

Json ToJson(const FinishedMap& map) {
  Json json{
      {"version", map.program_version},
      {"datum",
       {{"latitude_deg", map.datum.latitude_deg}, {"longitude_deg", map.datum.longitude_deg}}},
      {"dives", Json::array()}};
  for (std::size_t k = 0; k < map.dives.size(); ++k)
    json["dives"].push_back(DiveJson(map, static_cast<std::int32_t>(k)));
  const auto [accepted, rejected] = Closures(map);
  json["submaps"] = std::count_if(map.submaps.begin(), map.submaps.end(), [](const auto& submap) {
    return HasSoundings(submap.submap.trigger);
  });
  json["loop_closures"] = {{"accepted", accepted}, {"rejected", rejected}};
  json["track_states"] = map.track.size();
  json["dives_not_read"] = Json::array();
  for (const UnreadDive& dive : map.unread)
    json["dives_not_read"].push_back({{"name", dive.name}, {"reason", dive.reason}});
  json["points_unusable"] = Json::array();
  for (const FinishedSubmap& submap : map.submaps) {
    try {
      LoadPoints(submap);
    } catch (const std::runtime_error& e) {
      json["points_unusable"].push_back(e.what());
    }
  }
  return json;
}

void PrintText(const fs::path& folder, const Json& map) {
  std::printf("%s: a map by Seastitch %s, an input for another replay\n",
              folder.c_str(),
              map["version"].get<std::string>().c_str());
  for (const Json& dive : map["dives"]) {
    std::printf(
        "%s: %d submaps", dive["name"].get<std::string>().c_str(), dive["submaps"].get<int>());
    if (dive.contains("first_ping"))
      std::printf(", pings from %s to %s",
                  dive["first_ping"].get<std::string>().c_str(),
                  dive["last_ping"].get<std::string>().c_str());
    std::printf("\n");
  }
  std::printf("%d loop closures accepted, %d registrations rejected\n",
              map["loop_closures"]["accepted"].get<int>(),
              map["loop_closures"]["rejected"].get<int>());
  std::printf("map origin %.7f, %.7f degrees\n",
              map["datum"]["latitude_deg"].get<double>(),
              map["datum"]["longitude_deg"].get<double>());
  for (const Json& dive : map["dives_not_read"])
    std::printf("%s: %s\n",
                dive["name"].get<std::string>().c_str(),
                dive["reason"].get<std::string>().c_str());
  for (const Json& file : map["points_unusable"])
    std::printf("points are left out: %s\n", file.get<std::string>().c_str());
}

}  // namespace

void PrintMap(const fs::path& folder, bool json) {
  const std::string name = (fs::weakly_canonical(folder) / "").parent_path().filename().string();
  const Json map = ToJson(ReadFinishedMap(folder, name));
  if (json)
    std::printf("%s\n", map.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  else
    PrintText(folder, map);
}

namespace {

// One dive of survey files.
struct SurveyDive {
  std::string name;
  std::vector<FileHead> heads;
  SurveyPlan plan;
  std::string problem;  // why it cannot be mapped; empty: it can

  std::string Sonar() const {
    for (const FileHead& head : heads)
      if (head.installation) return head.installation->model;
    return "";
  }
  std::string Serial() const {
    for (const FileHead& head : heads)
      if (head.installation) return head.installation->serial;
    return "";
  }
  std::optional<Time> Begin() const {
    std::optional<Time> begin;
    for (const FileHead& head : heads)
      if (head.begin && (!begin || *head.begin < *begin)) begin = head.begin;
    return begin;
  }
  std::optional<Time> End() const {
    std::optional<Time> end;
    for (const FileHead& head : heads)
      if (head.end && (!end || *head.end > *end)) end = head.end;
    return end;
  }
};

SurveyDive LookAt(const DiveInput& dive) {
  SurveyDive out{dive.name, {}, {}, {}};
  for (const std::filesystem::path& file : dive.files) out.heads.push_back(HeadOf(file));
  try {
    out.plan = PlanSurvey(dive.files, false, {{}, dive.profiles});
    out.problem = out.plan.Problem().value_or("");
  } catch (const DataError& e) {
    out.problem = e.what();
  }
  return out;
}

Json ToJson(const SurveyDive& dive) {
  Json json{{"name", dive.name}, {"sonar", dive.Sonar()}, {"serial", dive.Serial()}};
  for (const FileHead& head : dive.heads) json["files"].push_back(head.path.string());
  if (const auto begin = dive.Begin()) json["begin"] = UtcText(*begin);
  if (const auto end = dive.End()) json["end"] = UtcText(*end);
  json["problem"] = dive.problem;
  const SurveyPlan& plan = dive.plan;
  if (!dive.problem.empty()) return json;
  const Datum place = DatumOf(plan.vehicle);
  if (!plan.grid_origin_m)
    json["place"] = {{"latitude_deg", place.latitude_deg}, {"longitude_deg", place.longitude_deg}};
  json["depth_below_sonar_m"] = plan.depth_m;
  json["largest_range_m"] = plan.max_range_m;
  json["ping_interval_s"] = plan.ping_interval_s;
  json["position"] = plan.position_source;
  json["attitude"] = plan.attitude_source;
  json["raw_times_and_angles"] = plan.raw_pings;
  json["warnings"] = Json::array();
  for (const MapWarning& warning : plan.warnings)
    json["warnings"].push_back({{"code", NameOf(warning.code)}, {"text", warning.text}});
  return json;
}

void Print(const SurveyDive& dive) {
  const std::string sonar = dive.Sonar(), serial = dive.Serial();
  std::printf("%s: %s%s%s%s%s\n",
              dive.name.c_str(),
              NumberOfFiles(dive.heads.size()).c_str(),
              sonar.empty() ? "" : ", ",
              sonar.c_str(),
              serial.empty() ? "" : ", serial number ",
              serial.c_str());
  if (dive.Begin() && dive.End())
    std::printf("time: %s to %s\n", UtcText(*dive.Begin()).c_str(), UtcText(*dive.End()).c_str());
  if (!dive.problem.empty()) {
    std::printf("cannot be mapped: %s\n", dive.problem.c_str());
    return;
  }
  const Datum place = DatumOf(dive.plan.vehicle);
  if (!dive.plan.grid_origin_m)
    std::printf(
        "begins at: %.6f, %.6f (latitude, longitude)\n", place.latitude_deg, place.longitude_deg);
  std::printf(
      "seabed: %.1f m below the sonar (median), largest range %.1f m, a ping every %.2f s\n",
      dive.plan.depth_m,
      dive.plan.max_range_m,
      dive.plan.ping_interval_s);
  std::fputs(dive.plan.Text().c_str(), stdout);
  for (const MapWarning& warning : dive.plan.warnings)
    std::printf("warning: %s\n", warning.text.c_str());
}

}  // namespace

void PrintSurvey(const std::vector<std::filesystem::path>& inputs, bool json) {
  std::vector<SurveyDive> dives;
  for (const DiveInput& dive : DivesAmong(inputs)) dives.push_back(LookAt(dive));
  Json list = Json::array();
  for (const SurveyDive& dive : dives) {
    if (json)
      list.push_back(ToJson(dive));
    else
      Print(dive);
  }
  if (json)
    std::printf("%s\n",
                Json{{"dives", list}}.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  if (std::all_of(dives.begin(), dives.end(), [](const auto& d) { return !d.problem.empty(); }))
    throw DataError("info: nothing in these files can be mapped");
}

}  // namespace seastitch
