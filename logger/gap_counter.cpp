#include "logger/gap_counter.hpp"

#include <algorithm>
#include <optional>

#include "seastitch/covariance_request_t.hpp"
#include "seastitch/covariances_t.hpp"
#include "seastitch/depth_t.hpp"
#include "seastitch/dvl_t.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/graph_update_t.hpp"
#include "seastitch/health_t.hpp"
#include "seastitch/imu_t.hpp"
#include "seastitch/mbes_ping_t.hpp"
#include "seastitch/nav_t.hpp"
#include "seastitch/pose_graph_t.hpp"
#include "seastitch/position_fix_t.hpp"
#include "seastitch/raw_bytes_t.hpp"
#include "seastitch/sound_velocity_profile_t.hpp"
#include "seastitch/submap_points_t.hpp"
#include "seastitch/submap_t.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxWatches = 200;  // keeps HEALTH one datagram
constexpr std::size_t kMaxSenderLength = 64;

// Where a type keeps its number: after how many int64 fields, and whether the sender's name
// follows.
struct SeqPlace {
  std::size_t fields_before;
  bool has_sender = false;
};

std::optional<SeqPlace> PlaceOf(std::int64_t fingerprint) {
  static const std::map<std::int64_t, SeqPlace> places{
      {imu_t::getHash(), {2}},
      {dvl_t::getHash(), {2}},
      {depth_t::getHash(), {2}},
      {mbes_ping_t::getHash(), {2}},
      {sound_velocity_profile_t::getHash(), {2}},
      {position_fix_t::getHash(), {2}},
      {submap_t::getHash(), {3}},
      {submap_points_t::getHash(), {1}},
      {nav_t::getHash(), {1}},
      {graph_update_t::getHash(), {1}},
      {pose_graph_t::getHash(), {1}},
      {raw_bytes_t::getHash(), {1, true}},
      {graph_request_t::getHash(), {1, true}},
      {covariance_request_t::getHash(), {1, true}},
      {covariances_t::getHash(), {1}},
      {health_t::getHash(), {1, true}},
  };
  const auto found = places.find(fingerprint);
  return found == places.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

std::int64_t GapCounter::Add(const std::string& channel, Bytes message) {
  ByteReader in(message);
  const std::optional<SeqPlace> place = PlaceOf(in.Be<std::int64_t>());
  if (!place) return 0;
  in.Skip(8 * place->fields_before);
  const auto seq = in.Be<std::int64_t>();
  std::string key = channel;
  if (place->has_sender) {
    const Bytes sender = in.Take(std::min<std::size_t>(in.Be<std::uint32_t>(), kMaxSenderLength));
    key.append(1, ' ').append(sender.begin(), sender.end());
  }
  if (!in.ok() || seq < 0) return 0;
  if (!watches_.contains(key) && watches_.size() >= kMaxWatches) return 0;
  const std::int64_t lost = watches_[key].Add(seq);
  if (lost > 0) {
    lost_[channel] += lost;
    total_ += lost;
  }
  return lost;
}

}  // namespace seastitch
