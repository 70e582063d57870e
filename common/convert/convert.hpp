#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/bytes.hpp"
#include "common/core/checked.hpp"
#include "common/core/graph.hpp"
#include "common/core/sample.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "seastitch/config_t.hpp"
#include "seastitch/covariance_request_t.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/mbes_soundings_t.hpp"
#include "seastitch/nav_corrected_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/navigation_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "seastitch/sound_velocity_profile_t.hpp"
#include "seastitch/submap_points_t.hpp"
#include "seastitch/submap_t.hpp"

// Conversion between core types and LCM messages; the only code that depends on both.
//
// ToLcm never fails. Data too large for one message are split into several where the function
// returns a list, else reduced as stated below. Every message is smaller than kMaxMessageBytes.
// FromLcm returns std::nullopt for a message with a value that is not finite or not within the
// limits of core/checked.hpp, or with array lengths that disagree. The caller has to count it.
namespace seastitch {

// A message has to fit one UDP datagram: Debian's LCM 1.3.1 loses fragmented messages with the
// default socket buffers.
constexpr int kMaxMessageBytes = 60'000;
constexpr int kMaxPointsPerChunk = 3000;
constexpr int kMaxRawBytesPerPart = 50'000;
constexpr int kMaxConfigBytesPerPart = 50'000;

// seq: number of the message on its channel. newest_submap: Submap::frame_time of the newest submap
// in the graph, which becomes the message's utime.
imu_t ToLcm(const ImuSample& sample, const MessageStamp& stamp);
dvl_t ToLcm(const DvlSample& sample, const MessageStamp& stamp);
depth_t ToLcm(const DepthSample& sample, const MessageStamp& stamp);
mbes_ping_t ToLcm(const MbesPing& ping, const MessageStamp& stamp);
// A ping as messages of at most kMaxSoundings each. Their seq counts up from first.seq; all have
// the ping's time, number and head.
std::vector<mbes_soundings_t> ToLcm(const SoundingPing& ping, const MessageStamp& first);
sound_velocity_profile_t ToLcm(const SoundVelocityProfile& profile, const MessageStamp& stamp);
position_fix_t ToLcm(const PositionFix& fix, const MessageStamp& stamp);
navigation_t ToLcm(const NavigationSample& sample, const MessageStamp& stamp);
nav_t ToLcm(const NavState& nav, std::int64_t seq);
nav_corrected_t ToLcm(const CorrectedNavState& corrected, std::int64_t seq);
graph_update_t ToLcm(const GraphUpdate& update, Time newest_submap, std::int64_t seq);
covariance_request_t ToLcm(const CovarianceRequest& request, Time newest_submap);
covariances_t ToLcm(const PairCovariances& answer, Time newest_submap, std::int64_t seq);

std::optional<ImuSample> FromLcm(const imu_t& msg);
std::optional<DvlSample> FromLcm(const dvl_t& msg);
std::optional<DepthSample> FromLcm(const depth_t& msg);
std::optional<MbesPing> FromLcm(const mbes_ping_t& msg);
std::optional<SoundingPing> FromLcm(const mbes_soundings_t& msg);
std::optional<SoundVelocityProfile> FromLcm(const sound_velocity_profile_t& msg);
std::optional<PositionFix> FromLcm(const position_fix_t& msg);
std::optional<NavigationSample> FromLcm(const navigation_t& msg);
std::optional<Heartbeat> FromLcm(const health_t& msg);
std::optional<NavState> FromLcm(const nav_t& msg);
std::optional<CorrectedNavState> FromLcm(const nav_corrected_t& msg);
std::optional<GraphUpdate> FromLcm(const graph_update_t& msg);
// Without the limits of core/checked.hpp, for a receiver that can use a part.
std::optional<GraphUpdate> UncheckedFromLcm(const graph_update_t& msg);
std::optional<CovarianceRequest> FromLcm(const covariance_request_t& msg);
std::optional<PairCovariances> FromLcm(const covariances_t& msg);

// A submap as messages: its announcement (frame, times, footprint), then its points in chunks. To
// be sent in this order.
struct SubmapMessages {
  submap_t announcement;
  std::vector<submap_points_t> chunks;
};
SubmapMessages ToLcm(const Submap& submap,
                     std::int64_t announcement_seq,
                     std::int64_t first_chunk_seq);

// Reassembles submaps from their messages, one at a time: an announcement discards an incomplete
// submap before it.
class SubmapAssembler {
 public:
  // Begins a submap. Returns it at once if it has no points.
  std::optional<Submap> Add(const submap_t& msg);
  // Adds a chunk. Returns the submap if this chunk completes it.
  std::optional<Submap> Add(const submap_points_t& msg);
  // Number of malformed messages, and of chunks that no announced submap expects.
  std::int64_t malformed() const { return malformed_; }
  // Number of submaps that were not completed, or whose hash was wrong.
  std::int64_t incomplete() const { return incomplete_; }

 private:
  std::optional<Submap> Complete();

  std::optional<Submap> open_;
  std::int64_t open_hash_ = 0;
  int open_points_ = 0;
  int open_chunks_ = 0;
  int next_chunk_ = 0;
  std::int64_t malformed_ = 0;
  std::int64_t incomplete_ = 0;
};

// A solution as messages. solution_number: the same in all of them, and another for every
// publication.
std::vector<pose_graph_t> ToLcm(const PoseGraph& graph,
                                std::int64_t solution_number,
                                Time newest_submap,
                                std::int64_t first_seq);

// Reassembles solutions. A message of another solution_number discards an incomplete solution.
class PoseGraphAssembler {
 public:
  // Returns the solution if this message completes it.
  std::optional<PoseGraph> Add(const pose_graph_t& msg);
  std::int64_t malformed() const { return malformed_; }

 private:
  std::optional<PoseGraph> open_;
  std::int64_t solution_number_ = -1;
  int num_parts_ = 0;
  int next_part_ = 0;
  std::int64_t malformed_ = 0;
};

// A configuration file with all values that a process uses, defaults included.
struct ConfigText {
  std::string process;  // "mapper"
  std::string version;  // of the program
  std::string name;     // "mapper.yaml"
  std::string text;

  bool operator==(const ConfigText&) const = default;
};

// A file as messages with at most kMaxConfigBytesPerPart bytes each; seq counts up from first_seq.
std::vector<config_t> ToLcm(const ConfigText& file, Time sent, std::int64_t first_seq);

// The files of a process, by name and text, as messages. The caller sets version, times and seq.
using NamedText = std::pair<std::string, std::string>;
std::vector<config_t> ConfigParts(const std::string& process, const std::vector<NamedText>& files);

// Reassembles configuration files. The parts of one file have to come in order; parts of several
// processes may be mixed.
class ConfigAssembler {
 public:
  // Returns the file if this message completes it.
  std::optional<ConfigText> Add(const config_t& msg);
  // Number of malformed messages, and of files with a lost part.
  std::int64_t malformed() const { return malformed_; }

 private:
  struct Open {
    ConfigText file;
    std::int64_t utime = 0;
    int num_parts = 0;
    int next_part = 0;
  };
  std::map<std::string, Open> open_;  // by process
  std::int64_t malformed_ = 0;
};

// Bytes from a device as messages with at most kMaxRawBytesPerPart bytes each; seq counts up from
// first_seq. source: the driver's `source`. recv: receive time of the bytes.
std::vector<raw_bytes_t> ToRawParts(Bytes bytes,
                                    const std::string& source,
                                    Time recv,
                                    std::int64_t first_seq);

}  // namespace seastitch
