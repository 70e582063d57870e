#include "page/page_node.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/convert/channels.hpp"
#include "common/runtime/config/parameter_file.hpp"

namespace seastitch {
namespace {

constexpr double kTrackEveryS = 1.0;
constexpr double kMapEveryS = 3.0;    // at most: drawing a large map takes a tenth of a second
constexpr double kLookEveryS = 10.0;  // for submaps on the disk

}  // namespace

ParameterTable TableOf(PageConfig* config) {
  ParameterTable table;
  table
      .Add("listen",
           &config->listen,
           "Address and port of the page. 127.0.0.1 is this computer alone: from another, use ssh "
           "-L (docs/operations.md). Whoever reaches another address sees the survey: it also "
           "needs IPAddressAllow in a drop-in of the unit. Port 0: any free one.")
      .DataSheet();
  table
      .Add("dives_dir",
           &config->dives_dir,
           "Folder of the dives, as in mapper.yaml: a page that starts late reads the submaps of "
           "the newest dive there. Empty: none.")
      .DataSheet();
  return table;
}

PageConfig LoadPageConfig(const std::string& path) {
  PageConfig config;
  LoadParameters(path, TableOf(&config));
  try {
    ParseListenAddress(config.listen);
  } catch (const std::runtime_error& e) {
    throw ConfigError(path + ": listen: " + e.what());
  }
  if (!config.dives_dir.empty() && config.dives_dir.is_relative())
    config.dives_dir = std::filesystem::path(path).parent_path() / config.dives_dir;
  return config;
}

std::string PrintConfig(const PageConfig& config) { return PrintWithDefaults(config, {}); }

PageNode::PageNode(const PageConfig& config, Bus* bus)
    : status_(bus), kept_(config.dives_dir), server_(ParseListenAddress(config.listen), &feed_) {
  bus->Subscribe<submap_t>(channels::kSubmap,
                           QueueOf(channels::kSubmap),
                           [this](const submap_t& m) { Add(submaps_.Add(m)); });
  bus->Subscribe<submap_points_t>(channels::kSubmapPoints,
                                  QueueOf(channels::kSubmapPoints),
                                  [this](const submap_points_t& msg) { Add(submaps_.Add(msg)); });
  bus->Subscribe<pose_graph_t>(
      channels::kPoseGraph, QueueOf(channels::kPoseGraph), [this](const pose_graph_t& msg) {
        if (const auto solution = solutions_.Add(msg)) map_.Add(*solution);
      });
  bus->Subscribe<nav_t>(
      channels::kNav, QueueOf(channels::kNav), [this](const nav_t& msg) { OnMessage(msg); });
  health_.SetRunning();
}

void PageNode::OnMessage(const nav_t& msg) {
  const auto nav = FromLcm(msg);
  if (!nav) {
    health_.Count("nav_rejected");
    return;
  }
  nav_ = nav;
  nav_s_ = MonotonicSeconds();
  // Time of the vehicle: a player may be faster than the clock, and may go back.
  if (track_time_ && std::abs(ToSeconds(nav->time - *track_time_)) < kTrackEveryS) return;
  track_time_ = nav->time;
  map_.AddTrack(nav->time, nav->T_map_vehicle.translation().head<2>());
}

void PageNode::Add(const std::optional<Submap>& closed) {
  if (closed && map_.Add(*closed)) kept_.BeginAnew();
}

void PageNode::CatchUp() {
  const double now_s = MonotonicSeconds();
  if (looked_s_ == 0.0 || now_s - looked_s_ > kLookEveryS) {
    looked_s_ = now_s;
    kept_.LookForNewest();
  }
  // What the bus gave is newer.
  if (const auto submap = kept_.Next(); submap && !map_.Holds(submap->id)) map_.Add(*submap);
}

std::string PageNode::State() const {
  const StatusView view = status_.View();
  nlohmann::ordered_json navigated;
  if (nav_ && view.now_s - nav_s_ < kSilentS) {
    const Eigen::Vector3d p = nav_->T_map_vehicle.translation();
    const double variance = nav_->covariance(0, 0) + nav_->covariance(1, 1);
    navigated = {{"north_m", p.x()}, {"east_m", p.y()}, {"sigma_m", std::sqrt(variance)}};
  }
  const nlohmann::ordered_json map{{"version", shown_version_},
                                   {"submaps", map_.submaps()},
                                   {"closures_used", map_.closures(true)},
                                   {"closures_refused", map_.closures(false)}};
  return "{\"map\": " + map.dump() + ",\n\"navigated\": " + navigated.dump() +
         ",\n\"status\": " + StatusJson(view) + "}";
}

void PageNode::Show() {
  const double now_s = MonotonicSeconds();
  if (map_.version() != shown_version_ && now_s - shown_s_ > kMapEveryS) {
    shown_s_ = now_s;
    shown_version_ = map_.version();
    if (auto json = map_.Json()) feed_.SetMap(std::move(*json));
  }
  feed_.SetState(State());
  health_.Set("submaps_damaged", kept_.damaged() + submaps_.malformed() + submaps_.incomplete());
  health_.Set("requests_refused", server_.refused());
  health_.SetText(std::to_string(server_.clients()) + " browsers at port " +
                  std::to_string(port()) + "; " + std::to_string(map_.submaps()) + " submaps");
}

}  // namespace seastitch
