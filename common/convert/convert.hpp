#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/graph.hpp"
#include "common/core/message_stamp.hpp"
#include "common/core/sensors.hpp"
#include "common/core/submap.hpp"
#include "seastitch/config_t.hpp"
#include "seastitch/covariance_request_t.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/graph_update_t.hpp"
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

// The one place that knows both worlds. ToLcm cannot fail: what one message cannot hold it splits
// where it gives a list, and thins or cuts as said below. FromLcm gives nothing for a message that
// is not finite, not within its type's limits or not consistent in itself: the caller counts it.
// Every message is smaller than kMaxMessageBytes.
namespace seastitch {

// One datagram: Debian's LCM 1.3.1 loses larger ones on default socket buffers.
constexpr int kMaxMessageBytes = 60'000;
// A larger fan is thinned evenly; the sonar codecs refuse and count such a datagram.
constexpr int kMaxBeams = 1024;
constexpr int kMaxSoundings = 2048;
// A larger profile is thinned evenly; its first and last sample stay.
constexpr int kMaxProfileSamples = 2000;
constexpr int kMaxPointsPerChunk = 3000;
constexpr int kMaxSubmapPoints = 20'000'000;
// A larger footprint is thinned to every k-th corner.
constexpr int kMaxFootprintCorners = 3000;
// Longer names are cut.
constexpr std::size_t kMaxProcessName = 64;
constexpr std::size_t kMaxSourceLength = 256;
constexpr int kMaxRawBytesPerPart = 50'000;
constexpr int kMaxConfigBytesPerPart = 50'000;
constexpr std::uint8_t kMaxHead = 127;

imu_t ToLcm(const ImuSample& sample, const MessageStamp& stamp);
dvl_t ToLcm(const DvlSample& sample, const MessageStamp& stamp);
depth_t ToLcm(const DepthSample& sample, const MessageStamp& stamp);
mbes_ping_t ToLcm(const MbesPing& ping, const MessageStamp& stamp);
// In as many messages of at most kMaxSoundings as it takes, seq counting up from the stamp's; all
// have the ping's time, number and head.
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
std::optional<NavState> FromLcm(const nav_t& msg);
std::optional<CorrectedNavState> FromLcm(const nav_corrected_t& msg);
std::optional<GraphUpdate> FromLcm(const graph_update_t& msg);
std::optional<CovarianceRequest> FromLcm(const covariance_request_t& msg);
std::optional<PairCovariances> FromLcm(const covariances_t& msg);

// A submap as its announcement and its chunks, in the order in which they are to be sent.
struct SubmapMessages {
  submap_t announcement;
  std::vector<submap_points_t> chunks;
};
SubmapMessages ToLcm(const Submap& submap,
                     std::int64_t announcement_seq,
                     std::int64_t first_chunk_seq);

// Puts submaps together again. Keeps one open at a time: an announcement ends the one before it.
class SubmapAssembler {
 public:
  // Begins a submap; gives it at once where it has no points.
  std::optional<Submap> Add(const submap_t& msg);
  // Adds a chunk; gives the submap that this chunk completed.
  std::optional<Submap> Add(const submap_points_t& msg);
  // Malformed messages, chunks of no announced submap, and submaps that were never completed or
  // whose hash was wrong.
  std::int64_t malformed() const { return malformed_; }
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

// A solution in as many parts as it takes.
std::vector<pose_graph_t> ToLcm(const PoseGraph& graph,
                                std::int64_t solution_number,
                                Time newest_submap,
                                std::int64_t first_seq);

// Puts solutions together again; a newer solution_number ends an unfinished one.
class PoseGraphAssembler {
 public:
  std::optional<PoseGraph> Add(const pose_graph_t& msg);
  std::int64_t malformed() const { return malformed_; }

 private:
  std::optional<PoseGraph> open_;
  std::int64_t solution_number_ = -1;
  int num_parts_ = 0;
  int next_part_ = 0;
  std::int64_t malformed_ = 0;
};

// A file of the effective configuration of a process.
struct ConfigText {
  std::string process;  // "mapper"
  std::string version;  // of the program
  std::string name;     // "mapper.yaml"
  std::string text;

  bool operator==(const ConfigText&) const = default;
};

// A file in parts of at most kMaxConfigBytesPerPart, seq counting up from first_seq.
std::vector<config_t> ToLcm(const ConfigText& file, Time sent, std::int64_t first_seq);

// The files of a process, by name and text, in parts. Version and times are left to the sender.
using NamedText = std::pair<std::string, std::string>;
std::vector<config_t> ConfigParts(const std::string& process, const std::vector<NamedText>& files);

// Puts files together again. The parts of one file come one after another, those of several
// processes in any order.
class ConfigAssembler {
 public:
  std::optional<ConfigText> Add(const config_t& msg);
  // Damaged messages, and files of which a part was lost.
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

// Device bytes in parts of at most kMaxRawBytesPerPart, seq counting up from first_seq.
std::vector<raw_bytes_t> ToRawParts(const std::vector<std::uint8_t>& bytes,
                                    const std::string& source,
                                    Time recv,
                                    std::int64_t first_seq);

}  // namespace seastitch
