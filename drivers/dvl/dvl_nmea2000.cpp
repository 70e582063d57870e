#include "drivers/dvl/dvl_nmea2000.hpp"

#include <chrono>

namespace seastitch {
namespace {

constexpr double kSpeedStep_mps = 0.001;
constexpr double kDepthStep_m = 0.01;

}  // namespace

DvlOutput DvlN2kDecoder::Add(const CanFrame& frame, Time recv) {
  if (!frame.extended || frame.error || frame.remote) return {};
  const N2kMessage id = ReadN2kId(frame.id);
  if (params_.source >= 0 && id.source != params_.source) return {};
  if (id.pgn == kPgnWaterDepth) ReadDepth(frame.data(), recv);
  if (id.pgn != kPgnVesselSpeed) return {};
  const std::optional<N2kMessage> speed = packets_.Add(frame, recv);
  return speed ? DvlOutput{ReadSpeed(speed->data, recv), std::nullopt} : DvlOutput{};
}

void DvlN2kDecoder::ReadDepth(Bytes data, Time recv) {
  ByteReader in(data);
  in.Skip(1);  // sequence
  const std::optional<double> depth_m = ReadN2kField<std::uint32_t>(&in, kDepthStep_m);
  if (!in.ok()) {
    ++counters_["dvl_frame_malformed"];
    return;
  }
  depth_m_ = depth_m;
  depth_recv_ = recv;
}

std::optional<DvlSample> DvlN2kDecoder::ReadSpeed(Bytes data, Time recv) {
  ByteReader in(data);
  in.Skip(4);  // velocity through the water
  const std::optional<double> ahead_mps = ReadN2kField<std::int16_t>(&in, kSpeedStep_mps);
  const std::optional<double> starboard_mps = ReadN2kField<std::int16_t>(&in, kSpeedStep_mps);
  if (!in.ok()) {
    ++counters_["dvl_frame_malformed"];
    return std::nullopt;
  }
  DvlSample sample;
  sample.time = *stamper_.Stamp(Time(), recv);  // the receive clock always gives a time
  sample.bottom_lock = ahead_mps && starboard_mps;
  if (sample.bottom_lock) {
    sample.v_dvl_mps = {*ahead_mps, *starboard_mps, 0.0};
    sample.sigma_v_mps = {params_.sigma_mps, params_.sigma_mps, params_.sigma_z_mps};
  }
  const bool fresh = std::chrono::abs(recv - depth_recv_) <= FromSeconds(params_.max_depth_age_s);
  if (fresh) sample.altitude_m = depth_m_;
  return sample;
}

Counters DvlN2kDecoder::counters() const {
  Counters all = packets_.counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

std::vector<CanFrame> EncodeDvlN2k(const DvlSample& sample, std::uint8_t source, int sequence) {
  std::vector<CanFrame> frames;
  if (sample.altitude_m) {
    ByteWriter depth;
    depth.Le(static_cast<std::uint8_t>(sequence));
    WriteN2kField<std::uint32_t>(sample.altitude_m, kDepthStep_m, &depth);
    depth.Le(std::int16_t{0});     // offset to the water line
    depth.Le(std::uint8_t{0xFF});  // maximum range
    frames = EncodeN2k({kPgnWaterDepth, source, 3, depth.Release()}, false);
  }
  const auto ground = [&sample](Eigen::Index axis) {
    return sample.bottom_lock ? std::optional(sample.v_dvl_mps[axis]) : std::nullopt;
  };
  ByteWriter speed;
  for (const std::optional<double>& field : {std::optional<double>(),
                                             std::optional<double>(),
                                             ground(0),
                                             ground(1),
                                             std::optional<double>(),
                                             std::optional<double>()})
    WriteN2kField<std::int16_t>(field, kSpeedStep_mps, &speed);
  const auto packet = EncodeN2k({kPgnVesselSpeed, source, 2, speed.Release()}, true, sequence);
  frames.insert(frames.end(), packet.begin(), packet.end());
  return frames;
}

}  // namespace seastitch
