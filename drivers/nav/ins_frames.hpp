#pragma once

#include <optional>

#include "codecs/frame_stream.hpp"
#include "drivers/nav/nav_codec.hpp"

namespace seastitch {

struct PhinsInsParams {
  ClockParams clock;
  bool altitude_is_depth = false;  // with its sign turned: of an INS under water
  double depth_sigma_m = 0.05;     // where the INS states none
};

// What instruments that send binary frames share: bytes to frames, and what was of none.
class FrameCodec : public NavCodec {
 public:
  std::string hears_instead() const override;
  // skipped_bytes, unstamped, and those of the instrument.
  Counters counters() const override;

 protected:
  explicit FrameCodec(FrameStream::SizeOf size_of) : frames_(size_of) {}
  virtual void Take(const FrameStream::Frame& frame) = 0;

 private:
  void Read(Bytes bytes, Time recv) final;
  FrameStream frames_;
};

// iXblue's standard binary: each frame a sample; what a pressure sensor gave to the INS is a depth
// of its own.
class PhinsIns : public FrameCodec {
 public:
  // Counters: those of FrameCodec; phins_malformed (a frame with a right checksum that makes no
  // sense), phins_gaps (frames that never came).
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

// Kongsberg's KM binary: each datagram a sample, by its own UTC.
class KmBinaryIns : public FrameCodec {
 public:
  // Counters: those of FrameCodec; nothing_valid (position and attitude are called invalid).
  explicit KmBinaryIns(const ClockParams& clock);

  Counters clock_figures(const std::string& prefix) const override {
    return stamper_.Figures(prefix);
  }

 private:
  void Take(const FrameStream::Frame& frame) override;

  Stamper stamper_;
};

}  // namespace seastitch
