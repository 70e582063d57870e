#include "common/convert/channels.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "seastitch/config_request_t.hpp"
#include "seastitch/config_t.hpp"
#include "seastitch/covariance_request_t.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/graph_request_t.hpp"
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

namespace seastitch {
namespace {

constexpr int kUnlimited = 0;
constexpr std::size_t kMaxSenderLength = 64;
static_assert(kBytesOfPlace > 32 * sizeof(std::int64_t) + kMaxSenderLength,
              "words, and the sender");

constexpr MessageLayout kMeasured{.utime = 0, .recv_utime = 1, .seq = 2};
constexpr MessageLayout kMade{.utime = 0, .seq = 1};
constexpr MessageLayout kSent{.utime = 0, .seq = 1, .has_sender = true};
constexpr MessageLayout kReceived{.utime = -1, .recv_utime = 0, .seq = 1, .has_sender = true};
constexpr MessageLayout kSubmapLayout{.utime = 0, .seq = 3};

template <class Msg>
bool Decodes(Bytes message) {
  Msg msg{};
  const int size = static_cast<int>(message.size());
  return msg.decode(message.data(), 0, size) == size;
}

// Sender, receiver, rate and content of a channel: the columns of docs/channels.md beside its type.
struct Use {
  const char* sender;
  const char* receiver;
  const char* rate;
  const char* content;
};

template <class Msg>
Channel MakeChannel(
    const char* name, const MessageLayout& layout, ChannelRole role, int queue, const Use& use) {
  return {name,
          Msg::getTypeName(),
          Msg::getHash(),
          layout,
          role,
          queue,
          use.sender,
          use.receiver,
          use.rate,
          use.content,
          Decodes<Msg>};
}

std::vector<Channel> MakeChannels() {
  using namespace channels;
  using Role = ChannelRole;
  return {
      MakeChannel<imu_t>(kImu,
                         kMeasured,
                         Role::kSensor,
                         2000,
                         {"imu driver",
                          "mapper",
                          "50-400 Hz",
                          "Angular rate, specific force; attitude where the unit has one."}),
      MakeChannel<dvl_t>(
          kDvl,
          kMeasured,
          Role::kSensor,
          200,
          {"dvl driver",
           "mapper",
           "2-15 Hz",
           "Velocity over ground with its sigma; range, velocity and quality of each "
           "beam; altitude."}),
      MakeChannel<depth_t>(kDepth,
                           kMeasured,
                           Role::kSensor,
                           200,
                           {"dvl driver, nav driver",
                            "mapper",
                            "1-20 Hz",
                            "Depth below the water line, its sigma, pressure."}),
      MakeChannel<mbes_ping_t>(
          kMbesPing,
          kMeasured,
          Role::kSensor,
          300,  // 27 kB each
          {"mbes driver",
           "mapper",
           "1-60 Hz",
           "One fan: travel time, angles, sector, flags of each beam; sound speed at the sonar."}),
      MakeChannel<mbes_soundings_t>(
          kMbesSoundings,
          kMeasured,
          Role::kSensor,
          300,
          {"import", "mapper", "1-60 Hz", "One fan as points, where its source has no angles."}),
      MakeChannel<navigation_t>(
          kIns,
          kMeasured,
          Role::kSensor,
          2000,
          {"nav driver, import",
           "mapper",
           "1-200 Hz",
           "Position, depth, attitude and velocity as an INS computed them, with their sigmas."}),
      MakeChannel<sound_velocity_profile_t>(
          kSvp,
          kMeasured,
          Role::kSensor,
          10,
          {"mbes driver (KMALL #SVP), CTD", "mapper", "rare", "Sound speed against depth."}),
      MakeChannel<position_fix_t>(kPositionFix,
                                  kMeasured,
                                  Role::kSensor,
                                  100,
                                  {"nav driver (GPS, USBL)",
                                   "mapper",
                                   "rare",
                                   "Latitude and longitude with their covariance."}),
      MakeChannel<raw_bytes_t>(kRawCan,
                               kReceived,
                               Role::kRaw,
                               kUnlimited,
                               {"imu and dvl driver",
                                "logger",
                                "as received",
                                "Frames of the CAN bus before decoding."}),
      MakeChannel<raw_bytes_t>(kRawDvl,
                               kReceived,
                               Role::kRaw,
                               kUnlimited,
                               {"dvl driver with PD0 over UDP",
                                "logger",
                                "as received",
                                "Datagrams of the Doppler log before decoding."}),
      MakeChannel<raw_bytes_t>(
          kRawMbes,
          kReceived,
          Role::kRaw,
          kUnlimited,
          {"mbes driver", "logger", "as received", "Datagrams of the sonar before decoding."}),
      MakeChannel<raw_bytes_t>(kRawNav,
                               kReceived,
                               Role::kRaw,
                               kUnlimited,
                               {"nav driver",
                                "logger",
                                "as received",
                                "Bytes of INS, GPS, USBL and pressure sensor before decoding."}),
      MakeChannel<nav_t>(kNav,
                         kMade,
                         Role::kResult,
                         kUnlimited,
                         {"mapper",
                          "anyone",
                          "10-50 Hz",
                          "Dead-reckoned pose and velocity with their covariance."}),
      MakeChannel<nav_corrected_t>(
          kNavCorrected,
          kMade,
          Role::kResult,
          kUnlimited,
          {"mapper", "anyone", "10-50 Hz", "Pose in the solved map; jumps with a new solution."}),
      MakeChannel<submap_t>(
          kSubmap,
          kSubmapLayout,
          Role::kResult,
          kUnlimited,
          {"mapper", "anyone", "per submap", "Time span, frame and footprint of a closed submap."}),
      MakeChannel<submap_points_t>(
          kSubmapPoints,
          kMade,
          Role::kResult,
          kUnlimited,
          {"mapper", "anyone", "per submap", "Points of a submap, in numbered chunks."}),
      MakeChannel<graph_update_t>(
          kGraphUpdate,
          kMade,
          Role::kResult,
          kUnlimited,
          {"mapper", "optimizer", "per submap", "Additions of a graph version."}),
      MakeChannel<graph_request_t>(
          kGraphRequest,
          kSent,
          Role::kRequest,
          16,
          {"optimizer, mapper",
           "mapper, optimizer",
           "on a gap",
           "Request for missing graph versions, or for the last solution."}),
      MakeChannel<pose_graph_t>(kPoseGraph,
                                kMade,
                                Role::kResult,
                                200,
                                {"optimizer",
                                 "mapper",
                                 "after graph updates",
                                 "A solution: poses, covariances, weight of every closure, errors "
                                 "of mounting. Live, one may answer several updates."}),
      MakeChannel<covariance_request_t>(kCovarianceRequest,
                                        kSent,
                                        Role::kRequest,
                                        16,
                                        {"mapper, anyone",
                                         "optimizer",
                                         "per solution",
                                         "Pairs of submaps whose relative covariance is wanted."}),
      MakeChannel<covariances_t>(
          kCovariances,
          kMade,
          Role::kRequest,
          4,
          {"optimizer", "mapper, anyone", "on request", "Relative covariances of pairs."}),
      MakeChannel<health_t>(
          kHealth,
          kSent,
          Role::kHealth,
          100,
          {"every process", "anyone", "1 Hz", "State, active faults, counters, rates."}),
      MakeChannel<config_t>(kConfig,
                            kSent,
                            Role::kHealth,
                            kUnlimited,
                            {"every process",
                             "logger",
                             "at start, on request; drivers every 8 s",
                             "Effective configuration, in parts."}),
      MakeChannel<config_request_t>(kConfigRequest,
                                    kSent,
                                    Role::kRequest,
                                    16,
                                    {"logger, anyone",
                                     "every process but the drivers",
                                     "rare",
                                     "Request for the configuration of one process or all."}),
  };
}

}  // namespace

const char* ToString(ChannelRole role) {
  switch (role) {
    case ChannelRole::kSensor: return "sensor";
    case ChannelRole::kResult: return "result";
    case ChannelRole::kRaw: return "raw";
    case ChannelRole::kHealth: return "health";
    case ChannelRole::kRequest: return "request";
  }
  return "";
}

const std::vector<Channel>& Channels() {
  static const std::vector<Channel> all = MakeChannels();
  return all;
}

const Channel* FindChannel(std::string_view name) {
  const auto found = std::find_if(Channels().begin(),
                                  Channels().end(),
                                  [name](const Channel& channel) { return channel.name == name; });
  return found == Channels().end() ? nullptr : &*found;
}

int QueueOf(std::string_view name) {
  const Channel* channel = FindChannel(name);
  if (channel == nullptr) throw std::out_of_range("no channel " + std::string(name));
  return channel->queue;
}

const Channel* ChannelOfType(std::int64_t fingerprint) {
  const auto found =
      std::find_if(Channels().begin(), Channels().end(), [fingerprint](const Channel& channel) {
        return channel.fingerprint == fingerprint;
      });
  return found == Channels().end() ? nullptr : &*found;
}

std::optional<std::int64_t> FingerprintOf(Bytes message) {
  ByteReader in(message);
  const auto fingerprint = in.Be<std::int64_t>();
  return in.ok() ? std::optional(fingerprint) : std::nullopt;
}

std::optional<MessagePlace> PlaceOf(Bytes message) {
  ByteReader in(message);
  const Channel* channel = ChannelOfType(in.Be<std::int64_t>());
  if (channel == nullptr) return std::nullopt;
  const MessageLayout& layout = channel->layout;
  MessagePlace place;
  for (int word = 0; word <= layout.seq; ++word) {
    const auto value = in.Be<std::int64_t>();
    if (word == layout.utime) place.utime = value;
    if (word == layout.recv_utime) place.recv_utime = value;
    if (word == layout.seq) place.seq = value;
  }
  if (layout.has_sender) {
    // LCM's length of the sender's name includes the terminating zero.
    const Bytes sender = in.Take(std::min<std::size_t>(in.Be<std::uint32_t>(), kMaxSenderLength));
    place.sender.assign(sender.begin(), std::find(sender.begin(), sender.end(), 0));
  }
  return in.ok() && place.seq >= 0 ? std::optional(place) : std::nullopt;
}

}  // namespace seastitch
