#pragma once

#include <optional>

#include "codecs/frame_stream.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

struct PhinsInsParams {
  ClockParams clock;
  bool altitude_is_depth = false;  // depth = -altitude: an INS with a pressure sensor
  double depth_sigma_m = 0.05;     // for an INS that states none
};

// Decodes iXblue's standard binary. Each frame is a navigation sample; a depth that a pressure
// sensor sent to the INS becomes a DEPTH sample too.
class PhinsIns : public NavCodec {
 public:
  explicit PhinsIns(const PhinsInsParams& params);

  std::vector<NavOutput> Add(Bytes bytes, Time recv) override;
  std::int64_t heard() const override { return heard_; }
  std::string hears_instead() const override;

  // phins_malformed (right checksum, invalid content), phins_gaps (frames lost, by their counter),
  // skipped_bytes, unstamped.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  void Take(const FrameStream::Frame& bytes, std::vector<NavOutput>* out);

  PhinsInsParams params_;
  FrameStream frames_;
  DayClock clock_;
  std::int64_t heard_ = 0;
  std::optional<std::uint32_t> counter_;
  std::optional<Duration> depth_at_;
  Counters counters_;
};

// Decodes Kongsberg's KM binary. Each datagram is a navigation sample with its own UTC.
class KmBinaryIns : public NavCodec {
 public:
  explicit KmBinaryIns(const ClockParams& clock);

  std::vector<NavOutput> Add(Bytes bytes, Time recv) override;
  std::int64_t heard() const override { return heard_; }
  std::string hears_instead() const override;

  // skipped_bytes, nothing_valid (position and attitude are called invalid), unstamped.
  Counters counters() const override;
  Counters clock_figures(const std::string& prefix) const override {
    return stamper_.Figures(prefix);
  }

 private:
  FrameStream frames_;
  Stamper stamper_;
  std::int64_t heard_ = 0;
  Counters counters_;
};

}  // namespace seastitch
