#include "drivers/nav/ins_frames.hpp"

#include <utility>

#include "codecs/kmall_sensors.hpp"
#include "codecs/phins.hpp"

namespace seastitch {
namespace {

constexpr char kNoFrames[] = "bytes that are no frames (another protocol?)";

Counters WithSkipped(Counters counters, const FrameStream& frames) {
  if (frames.skipped_bytes() > 0) counters["skipped_bytes"] = frames.skipped_bytes();
  return counters;
}

}  // namespace

PhinsIns::PhinsIns(const PhinsInsParams& params)
    : params_(params), frames_(SizeOfPhins), clock_(params.clock) {}

std::string PhinsIns::hears_instead() const { return frames_.skipped_bytes() > 0 ? kNoFrames : ""; }

Counters PhinsIns::counters() const { return WithSkipped(counters_, frames_); }

std::vector<NavOutput> PhinsIns::Add(Bytes bytes, Time recv) {
  std::vector<NavOutput> out;
  for (const FrameStream::Frame& frame : frames_.Add(bytes, recv)) Take(frame, &out);
  return out;
}

void PhinsIns::Take(const FrameStream::Frame& bytes, std::vector<NavOutput>* out) {
  const std::optional<PhinsFrame> frame = DecodePhins(bytes.bytes);
  if (!frame) {
    ++counters_["phins_malformed"];
    return;
  }
  ++heard_;
  if (frame->version == 0) return;  // an answer
  if (counter_ && frame->counter > *counter_ + 1)
    counters_["phins_gaps"] += frame->counter - *counter_ - 1;
  counter_ = frame->counter;
  if (frame->midnight) clock_.SetDate(*frame->midnight + frame->valid_at, bytes.recv);
  const std::optional<Time> time = clock_.Stamp(frame->valid_at, bytes.recv);
  if (!time) {
    ++counters_["unstamped"];
    return;
  }
  NavigationSample sample;
  sample.time = *time;
  sample.source = "phins";
  sample.status = frame->status;
  sample.position = frame->position;
  sample.attitude = frame->attitude;
  sample.velocity = frame->velocity;
  if (frame->altitude_m && params_.altitude_is_depth)
    sample.depth = InsVertical{-*frame->altitude_m, frame->sigma_altitude_m};
  else if (frame->altitude_m && frame->altitude_is_above_ellipsoid)
    sample.height = InsVertical{*frame->altitude_m, frame->sigma_altitude_m};
  out->emplace_back(std::move(sample));
  if (!frame->sensor_depth || depth_at_ == frame->sensor_depth_at) return;
  depth_at_ = frame->sensor_depth_at;
  // It is as much older than the frame as the INS says.
  DepthSample depth;
  depth.time = *time + (frame->sensor_depth_at - frame->valid_at);
  depth.depth_m = frame->sensor_depth->value_m;
  depth.sigma_m =
      frame->sensor_depth->sigma_m > 0.0 ? frame->sensor_depth->sigma_m : params_.depth_sigma_m;
  if (depth.time <= *time && ToSeconds(*time - depth.time) < 5.0) out->emplace_back(depth);
}

KmBinaryIns::KmBinaryIns(const ClockParams& clock) : frames_(SizeOfKmBinary), stamper_(clock) {}

std::string KmBinaryIns::hears_instead() const {
  return frames_.skipped_bytes() > 0 ? kNoFrames : "";
}

Counters KmBinaryIns::counters() const { return WithSkipped(counters_, frames_); }

std::vector<NavOutput> KmBinaryIns::Add(Bytes bytes, Time recv) {
  std::vector<NavOutput> out;
  for (const FrameStream::Frame& frame : frames_.Add(bytes, recv)) {
    const std::optional<NavigationRecord> record = DecodeKmBinary(frame.bytes);
    if (!record) continue;
    ++heard_;
    const std::optional<Time> time = stamper_.Stamp(record->time, frame.recv);
    if (!time) {
      ++counters_["unstamped"];
      continue;
    }
    NavigationSample sample;
    sample.time = *time;
    sample.source = "kmb";
    if (record->position)
      sample.position = InsPosition{record->position->latitude_rad,
                                    record->position->longitude_rad,
                                    record->position->sigma_north_east_m};
    sample.attitude = record->attitude;
    if (record->velocity)
      sample.velocity = InsVelocity{record->velocity->v_ned_mps, record->velocity->sigma_mps};
    if (record->height_m) sample.height = InsVertical{*record->height_m};
    if (!sample.position && !sample.attitude) {
      ++counters_["nothing_valid"];
      sample.status = InsStatus::kInvalid;
    }
    out.emplace_back(std::move(sample));
  }
  return out;
}

}  // namespace seastitch
