#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/convert/convert.hpp"
#include "common/parameters/parameters.hpp"
#include "common/runtime/bus.hpp"
#include "common/runtime/health.hpp"
#include "page/kept_submaps.hpp"
#include "page/live_map.hpp"
#include "page/page_feed.hpp"
#include "page/page_server.hpp"
#include "page/status_listener.hpp"

namespace seastitch {

struct PageConfig {
  std::string listen = "127.0.0.1:8642";
  std::filesystem::path dives_dir = "../dives";  // empty: none
};

// Throws ConfigError.
PageConfig LoadPageConfig(const std::string& path);
std::string PrintConfig(const PageConfig& config);
ParameterTable TableOf(PageConfig* config);

// Shows a vehicle to browsers: the map as it grows, where the vehicle is, and what its processes
// say. It listens to results and HEALTH, and sends nothing but its own HEALTH.
class PageNode {
 public:
  // Throws std::runtime_error where it cannot listen.
  PageNode(const PageConfig& config, Bus* bus);
  PageNode(const PageNode&) = delete;
  PageNode& operator=(const PageNode&) = delete;

  // Reads one submap that the mapper keeps on the disk, if there is one. Call it often.
  void CatchUp();
  // Hands the present state to the browsers, and the map where it has changed. Call it once a
  // second.
  void Show();
  Health& health() { return health_; }
  int port() const { return server_.port(); }

 private:
  void OnMessage(const nav_t& msg);
  void Add(const std::optional<Submap>& closed);
  std::string State() const;

  StatusListener status_;
  LiveMap map_;
  KeptSubmaps kept_;
  SubmapAssembler submaps_;
  PoseGraphAssembler solutions_;
  std::optional<NavState> nav_;
  double nav_s_ = 0.0;              // monotonic, of nav_
  std::optional<Time> track_time_;  // of the track's last point
  double shown_s_ = 0.0, looked_s_ = 0.0;
  std::uint64_t shown_version_ = 0;
  Health health_{kPage};
  PageFeed feed_;
  PageServer server_;
};

}  // namespace seastitch
