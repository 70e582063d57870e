#pragma once

#include <optional>

#include "codecs/frame_stream.hpp"
#include "codecs/survey_records.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

struct PhinsInsParams {
  ClockParams clock;
  bool altitude_is_depth = false;  // depth = -altitude: an INS with a pressure sensor
  double depth_sigma_m = 0.05;     // for an INS that states none
};

// Base class of codecs of binary frames: splits bytes into frames and counts bytes of no frame.
class FrameCodec : public NavCodec {
 public:
  std::string unused_messages() const override;
  // skipped_bytes, unstamped, and those of the instrument.
  Counters counters() const override;

 protected:
  explicit FrameCodec(FrameStream::SizeOf size_of) : frames_(size_of) {}
  virtual void Take(const FrameStream::Frame& frame) = 0;

 private:
  void Read(Bytes bytes, Time recv) final;
  FrameStream frames_;
};

// Decodes iXblue's standard binary. Each frame is a navigation sample; a depth that a pressure
// sensor sent to the INS becomes a DEPTH sample too.
class PhinsIns : public FrameCodec {
 public:
  // Counters: those of FrameCodec; phins_malformed (invalid content, correct checksum),
  // phins_gaps (frames lost, by their counter).
  explicit PhinsIns(const PhinsInsParams& params);

  Counters clock_figures(const std::string& prefix) const override {
    return clock_.Figures(prefix);
  }

 private:
  void Take(const FrameStream::Frame& bytes) override;

  PhinsInsParams params_;
  DayClock clock_;
  std::optional<std::uint32_t> counter_;
  std::optional<Duration> depth_at_;
};

// Decodes Kongsberg's KM binary: each #KMB is a navigation sample with its own UTC, whether a
// sensor sends it alone or a sonar sends many in a #SKM.
class KmBinaryIns : public FrameCodec {
 public:
  // Counters: those of FrameCodec; nothing_valid (samples whose position and attitude are called
  // invalid); km_malformed (#SKM whose sizes contradict each other).
  explicit KmBinaryIns(const ClockParams& clock);

  Counters clock_figures(const std::string& prefix) const override {
    return stamper_.Figures(prefix);
  }

 private:
  void Take(const FrameStream::Frame& frame) override;
  void Take(const NavigationRecord& record, Time recv);

  Stamper stamper_;
};

}  // namespace seastitch
