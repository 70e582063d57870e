#include <algorithm>
#include <bit>
#include <utility>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"

namespace seastitch {
namespace {

using namespace convert;  // the checks

constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325;  // FNV-1a, 64 bit
constexpr std::uint64_t kFnvPrime = 0x100000001b3;

std::uint64_t AddToHash(std::uint64_t hash, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = 24; shift >= 0; shift -= 8)
    hash = (hash ^ ((bits >> shift) & 0xffU)) * kFnvPrime;
  return hash;
}

std::int64_t HashOf(const PointCloud& cloud) {
  std::uint64_t hash = kFnvOffset;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (const float value : cloud.points[i]) hash = AddToHash(hash, value);
    hash = AddToHash(hash, cloud.soundings[i]);
  }
  return std::bit_cast<std::int64_t>(hash);
}

int ChunksFor(std::size_t points) {
  return static_cast<int>((points + kMaxPointsPerChunk - 1) / kMaxPointsPerChunk);
}

void SetFootprint(const Footprint& footprint, submap_t* msg) {
  for (const Eigen::Vector2d& corner : Thinned(footprint)) {
    msg->footprint_x_m.push_back(corner.x());
    msg->footprint_y_m.push_back(corner.y());
  }
  msg->num_corners = static_cast<std::int32_t>(msg->footprint_x_m.size());
}

submap_points_t Chunk(const Submap& submap, int chunk, int num_chunks, std::int64_t seq) {
  const std::size_t begin = static_cast<std::size_t>(chunk) * kMaxPointsPerChunk;
  const std::size_t end = std::min(submap.cloud.size(), begin + kMaxPointsPerChunk);
  submap_points_t msg{};
  msg.utime = ToUtime(submap.start);
  msg.seq = seq;
  msg.submap_id = submap.id.value;
  msg.chunk = chunk;
  msg.num_chunks = num_chunks;
  msg.num_points = static_cast<std::int32_t>(end - begin);
  for (std::size_t i = begin; i < end; ++i) {
    msg.x_m.push_back(submap.cloud.points[i].x());
    msg.y_m.push_back(submap.cloud.points[i].y());
    msg.z_m.push_back(submap.cloud.points[i].z());
    msg.soundings.push_back(submap.cloud.soundings[i]);
  }
  return msg;
}

bool HasPlausibleCounts(const submap_t& msg) {
  return msg.soundings_read >= 0 && msg.soundings_used >= 0 && msg.num_points >= 0 &&
         msg.num_points <= kMaxSubmapPoints &&
         msg.num_chunks == ChunksFor(static_cast<std::size_t>(msg.num_points)) &&
         msg.num_corners >= 0 && msg.num_corners <= kMaxFootprintCorners;
}

// The submap without its points, which come in messages of their own.
std::optional<Submap> FromLcm(const submap_t& msg) {
  const auto pose = PoseFrom(msg.p_map_submap_m, msg.q_map_submap);
  if (!HasPlausibleCounts(msg) || !pose || !IsFiniteArray(msg.footprint_x_m, msg.num_corners) ||
      !IsFiniteArray(msg.footprint_y_m, msg.num_corners))
    return std::nullopt;
  Submap submap;
  submap.id = SubmapId{msg.id};
  submap.start = FromUtime(msg.utime);
  submap.end = FromUtime(msg.end_utime);
  submap.frame_time = FromUtime(msg.frame_utime);
  submap.T_map_submap = *pose;
  submap.covariance_from_previous = MatrixFrom<3>(msg.covariance_from_previous);
  submap.heading_sigma_rad = msg.heading_sigma_rad;
  submap.dvl_yaw_rad = msg.dvl_yaw_rad;
  submap.trigger = static_cast<SubmapTrigger>(msg.trigger);
  submap.predicted_information = MatrixFrom<3>(msg.predicted_information);
  submap.soundings_read = static_cast<std::uint64_t>(msg.soundings_read);
  submap.soundings_used = static_cast<std::uint64_t>(msg.soundings_used);
  for (std::size_t i = 0; i < msg.footprint_x_m.size(); ++i)
    submap.footprint.emplace_back(msg.footprint_x_m[i], msg.footprint_y_m[i]);
  std::optional<Submap> checked = Checked(std::move(submap));
  if (!checked) return std::nullopt;
  if (!msg.has_covariance_from_previous) checked->covariance_from_previous.reset();
  if (!msg.has_heading_sigma) checked->heading_sigma_rad.reset();
  // A zero matrix stands for "not computed": the information of a closed submap is never zero.
  if (checked->predicted_information->isZero(0.0)) checked->predicted_information.reset();
  return checked;
}

bool IsChunk(const submap_points_t& msg) {
  return msg.num_points >= 1 && msg.num_points <= kMaxPointsPerChunk &&
         IsFiniteArray(msg.x_m, msg.num_points) && IsFiniteArray(msg.y_m, msg.num_points) &&
         IsFiniteArray(msg.z_m, msg.num_points) && IsFiniteArray(msg.soundings, msg.num_points) &&
         std::all_of(msg.soundings.begin(), msg.soundings.end(), [](float n) { return n >= 0.0f; });
}

}  // namespace

SubmapMessages ToLcm(const Submap& submap,
                     std::int64_t announcement_seq,
                     std::int64_t first_chunk_seq) {
  SubmapMessages messages;
  submap_t& msg = messages.announcement;
  msg = submap_t{};
  msg.utime = ToUtime(submap.start);
  msg.end_utime = ToUtime(submap.end);
  msg.frame_utime = ToUtime(submap.frame_time);
  msg.seq = announcement_seq;
  msg.id = submap.id.value;
  PoseTo(submap.T_map_submap, msg.p_map_submap_m, msg.q_map_submap);
  msg.has_covariance_from_previous = submap.covariance_from_previous.has_value();
  MatrixTo<3>(submap.covariance_from_previous.value_or(Eigen::Matrix3d::Zero()),
              msg.covariance_from_previous);
  msg.has_heading_sigma = submap.heading_sigma_rad.has_value();
  msg.heading_sigma_rad = submap.heading_sigma_rad.value_or(0.0);
  msg.dvl_yaw_rad = submap.dvl_yaw_rad;
  MatrixTo<3>(submap.predicted_information.value_or(Eigen::Matrix3d::Zero()),
              msg.predicted_information);
  msg.trigger = static_cast<std::int8_t>(submap.trigger);
  msg.soundings_read = static_cast<std::int64_t>(submap.soundings_read);
  msg.soundings_used = static_cast<std::int64_t>(submap.soundings_used);
  msg.num_points = static_cast<std::int32_t>(submap.cloud.size());
  msg.num_chunks = ChunksFor(submap.cloud.size());
  msg.points_hash = HashOf(submap.cloud);
  SetFootprint(submap.footprint, &msg);
  for (int chunk = 0; chunk < msg.num_chunks; ++chunk)
    messages.chunks.push_back(Chunk(submap, chunk, msg.num_chunks, first_chunk_seq + chunk));
  return messages;
}

std::optional<Submap> SubmapAssembler::Add(const submap_t& msg) {
  if (open_) ++incomplete_;
  open_ = FromLcm(msg);
  if (!open_) {
    ++malformed_;
    return std::nullopt;
  }
  open_hash_ = msg.points_hash;
  open_points_ = msg.num_points;
  open_chunks_ = msg.num_chunks;
  next_chunk_ = 0;
  return open_chunks_ == 0 ? Complete() : std::nullopt;
}

std::optional<Submap> SubmapAssembler::Add(const submap_points_t& msg) {
  const bool belongs = open_ && msg.submap_id == open_->id.value &&
                       msg.utime == ToUtime(open_->start) && msg.num_chunks == open_chunks_;
  if (!belongs || !IsChunk(msg)) {
    ++malformed_;
    return std::nullopt;
  }
  PointCloud& cloud = open_->cloud;
  const std::size_t points = cloud.size() + msg.x_m.size();
  if (msg.chunk != next_chunk_ || points > static_cast<std::size_t>(open_points_)) {
    ++incomplete_;  // a chunk was lost
    open_.reset();
    return std::nullopt;
  }
  // Memory grows with the points received, not with the number announced.
  for (std::size_t i = 0; i < msg.x_m.size(); ++i)
    cloud.Add({msg.x_m[i], msg.y_m[i], msg.z_m[i]}, msg.soundings[i]);
  ++next_chunk_;
  return next_chunk_ == open_chunks_ ? Complete() : std::nullopt;
}

std::optional<Submap> SubmapAssembler::Complete() {
  std::optional<Submap> complete = std::exchange(open_, std::nullopt);
  const bool whole = complete->cloud.size() == static_cast<std::size_t>(open_points_) &&
                     HashOf(complete->cloud) == open_hash_;
  if (whole) return complete;
  ++incomplete_;
  return std::nullopt;
}

}  // namespace seastitch
