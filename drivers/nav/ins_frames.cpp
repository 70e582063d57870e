#include "drivers/nav/ins_frames.hpp"

#include <utility>

#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/navigation/phins.hpp"

namespace seastitch {

std::string FrameCodec::unused_messages() const {
  return frames_.skipped_bytes() > 0 ? "bytes that are no frames (another protocol?)" : "";
}

Counters FrameCodec::counters() const {
  Counters all = NavCodec::counters();
  if (frames_.skipped_bytes() > 0) all["skipped_bytes"] = frames_.skipped_bytes();
  return all;
}

void FrameCodec::Read(Bytes bytes, Time recv) {
  for (const FrameStream::Frame& frame : frames_.Add(bytes, recv)) Take(frame);
}

PhinsIns::PhinsIns(const PhinsInsParams& params)
    : FrameCodec(SizeOfPhins), params_(params), clock_(params.clock) {}

void PhinsIns::Take(const FrameStream::Frame& bytes) {
  const std::optional<PhinsFrame> frame = DecodePhins(bytes.bytes);
  if (!frame) return Count("phins_malformed");
  CountMessage();
  if (frame->version == 0) return;  // a reply to a command
  if (counter_ && frame->counter > *counter_ + 1)
    Count("phins_gaps", frame->counter - *counter_ - 1);
  counter_ = frame->counter;
  if (frame->midnight) clock_.SetDate(*frame->midnight + frame->valid_at, bytes.recv);
  const std::optional<Time> time = clock_.Stamp(frame->valid_at, bytes.recv);
  if (!time) return Count("unstamped");
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
  Emit(std::move(sample));
  if (!frame->sensor_depth || depth_at_ == frame->sensor_depth_at) return;
  depth_at_ = frame->sensor_depth_at;
  // The INS states by how much the sensor's depth is older than the frame.
  DepthSample depth;
  depth.time = *time + (frame->sensor_depth_at - frame->valid_at);
  depth.depth_m = frame->sensor_depth->value_m;
  depth.sigma_m =
      frame->sensor_depth->sigma_m > 0.0 ? frame->sensor_depth->sigma_m : params_.depth_sigma_m;
  if (depth.time <= *time && ToSeconds(*time - depth.time) < 5.0) Emit(depth);
}

KmBinaryIns::KmBinaryIns(const ClockParams& clock) : FrameCodec(SizeOfKmMotion), stamper_(clock) {}

void KmBinaryIns::Take(const FrameStream::Frame& frame) {
  const auto records = DecodeKmMotion(frame.bytes);
  if (!records) return Count("km_malformed");
  CountMessage();
  for (const NavigationRecord& record : *records) Take(record, frame.recv);
}

void KmBinaryIns::Take(const NavigationRecord& record, Time recv) {
  const std::optional<Time> time = stamper_.Stamp(record.time, recv);
  if (!time) return Count("unstamped");
  NavigationSample sample;
  sample.time = *time;
  sample.source = "kmb";
  sample.position = record.position;
  sample.attitude = record.attitude;
  sample.velocity = record.velocity;
  if (record.height_m) sample.height = InsVertical{*record.height_m};
  if (!sample.position && !sample.attitude) {
    Count("nothing_valid");
    sample.status = InsStatus::kInvalid;
  }
  Emit(std::move(sample));
}

}  // namespace seastitch
