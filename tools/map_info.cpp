#include "tools/map_info.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "products/files/navigation_files.hpp"
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
    for (const RegistrationResultSet& job : submap.dive.made)
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
  json["submaps"] = map.submaps.size();
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

}  // namespace seastitch
