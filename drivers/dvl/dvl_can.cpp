#include "drivers/dvl/dvl_can.hpp"

#include <algorithm>
#include <cmath>

namespace seastitch {
namespace {

std::bitset<kMaxFields> Mapped(const SignalMap& signals, std::size_t first, std::size_t last) {
  std::bitset<kMaxFields> fields;
  for (std::size_t field = first; field <= last; ++field) fields.set(field, signals.Has(field));
  return fields;
}

Eigen::Vector3d Vector(const FieldValues& v, std::size_t first) {
  return {v.value[first], v.value[first + 1], v.value[first + 2]};
}

// A sigma of 0 means "below the signal's resolution": half the resolution is used.
double Sigma(const FieldValues& v, const SignalMap& signals, std::size_t field) {
  return std::max(v.value[field], 0.5 * signals.Resolution(field));
}

DvlBeam ToBeam(const FieldValues& v, const SignalMap& signals, std::size_t beam) {
  DvlBeam out;
  out.valid = v.value[kDvlBeamValid1 + beam] != 0.0;
  if (signals.Has(kDvlBeamQuality1))
    out.quality = std::clamp(v.value[kDvlBeamQuality1 + beam], 0.0, 1.0);
  if (!out.valid) return out;
  out.range_m = v.value[kDvlBeamRange1 + beam];
  out.velocity_mps = v.value[kDvlBeamVelocity1 + beam];
  return out;
}

DvlSample ToDvl(const FieldValues& v, const SignalMap& signals, Time time) {
  DvlSample sample;
  sample.time = time;
  sample.bottom_lock = v.value[kDvlBottomLock] != 0.0;
  if (sample.bottom_lock) {
    sample.v_dvl_mps = Vector(v, kDvlVelocityX);
    for (std::size_t axis = 0; axis < 3; ++axis)
      sample.sigma_v_mps[static_cast<Eigen::Index>(axis)] = Sigma(v, signals, kDvlSigmaX + axis);
    if (signals.Has(kDvlErrorVelocity)) sample.error_velocity_mps = v.value[kDvlErrorVelocity];
  }
  for (std::size_t beam = 0; beam < sample.beams.size(); ++beam)
    sample.beams[beam] = ToBeam(v, signals, beam);
  if (v.value[kDvlAltitudeValid] != 0.0) sample.altitude_m = v.value[kDvlAltitude];
  return sample;
}

DepthSample ToDepth(const FieldValues& v, const SignalMap& signals, Time time) {
  DepthSample sample;
  sample.time = time;
  if (signals.Has(kDepthPressure)) sample.pressure_pa = v.value[kDepthPressure];
  sample.depth_m = v.value[kDepthDepth];
  if (signals.Has(kDepthSigma)) sample.sigma_m = Sigma(v, signals, kDepthSigma);
  return sample;
}

void Fill(const DvlSample& sample, FieldValues* v) {
  v->Set(kDvlBottomLock, sample.bottom_lock ? 1.0 : 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    v->Set(kDvlVelocityX + axis, sample.v_dvl_mps[i]);
    v->Set(kDvlSigmaX + axis, sample.sigma_v_mps[i]);
  }
  for (std::size_t beam = 0; beam < sample.beams.size(); ++beam) {
    v->Set(kDvlBeamRange1 + beam, sample.beams[beam].range_m);
    v->Set(kDvlBeamValid1 + beam, sample.beams[beam].valid ? 1.0 : 0.0);
    v->Set(kDvlBeamVelocity1 + beam, sample.beams[beam].velocity_mps);
    v->Set(kDvlBeamQuality1 + beam, sample.beams[beam].quality.value_or(0.0));
  }
  v->Set(kDvlErrorVelocity, sample.error_velocity_mps.value_or(0.0));
  v->Set(kDvlAltitude, sample.altitude_m.value_or(0.0));
  v->Set(kDvlAltitudeValid, sample.altitude_m ? 1.0 : 0.0);
}

void Fill(const DepthSample& sample, FieldValues* v) {
  v->Set(kDepthPressure, sample.pressure_pa.value_or(0.0));
  v->Set(kDepthDepth, sample.depth_m);
  v->Set(kDepthSigma, sample.sigma_m);
}

}  // namespace

const std::vector<std::string> kDvlFieldKeys = {"time_s",
                                                "time_us",
                                                "velocity_x_mps",
                                                "velocity_y_mps",
                                                "velocity_z_mps",
                                                "bottom_lock",
                                                "sigma_x_mps",
                                                "sigma_y_mps",
                                                "sigma_z_mps",
                                                "beam_1_range_m",
                                                "beam_2_range_m",
                                                "beam_3_range_m",
                                                "beam_4_range_m",
                                                "beam_1_valid",
                                                "beam_2_valid",
                                                "beam_3_valid",
                                                "beam_4_valid",
                                                "beam_1_velocity_mps",
                                                "beam_2_velocity_mps",
                                                "beam_3_velocity_mps",
                                                "beam_4_velocity_mps",
                                                "beam_1_quality",
                                                "beam_2_quality",
                                                "beam_3_quality",
                                                "beam_4_quality",
                                                "error_velocity_mps",
                                                "altitude_m",
                                                "altitude_valid",
                                                "pressure_pa",
                                                "depth_m",
                                                "depth_sigma_m"};

std::string DvlCanParams::Validate() const {
  const auto missing = [this](std::size_t first, std::size_t last) -> std::string {
    for (std::size_t field = first; field <= last; ++field)
      if (!signals.Has(field)) return "signals." + kDvlFieldKeys[field] + ": missing";
    return "";
  };
  if (const std::string problem = missing(kDvlTimeS, kDvlSigmaZ); !problem.empty()) return problem;
  // Groups of signals that must be mapped together.
  if (Mapped(signals, kDvlBeamRange1, kDvlBeamVelocity4).any())
    if (const std::string problem = missing(kDvlBeamRange1, kDvlBeamValid4); !problem.empty())
      return problem;
  if (Mapped(signals, kDvlBeamQuality1, kDvlBeamQuality4).any())
    if (const std::string problem = missing(kDvlBeamQuality1, kDvlBeamQuality4); !problem.empty())
      return problem;
  if (Mapped(signals, kDvlAltitude, kDvlAltitudeValid).any())
    if (const std::string problem = missing(kDvlAltitude, kDvlAltitudeValid); !problem.empty())
      return problem;
  if (Mapped(signals, kDepthPressure, kDepthSigma).any())
    if (const std::string problem = missing(kDepthDepth, kDepthDepth); !problem.empty())
      return problem;
  return "";
}

DvlCanDecoder::DvlCanDecoder(const DvlCanParams& params)
    : params_(params),
      dvl_fields_(Mapped(params.signals, kDvlVelocityX, kDvlAltitudeValid)),
      depth_fields_(Mapped(params.signals, kDepthPressure, kDepthSigma)),
      stamper_(params.clock) {}

DvlOutput DvlCanDecoder::Add(const CanFrame& frame, Time recv) {
  const std::optional<SignalMap::Reading> reading = params_.signals.Read(frame);
  if (!reading) return {};
  if (!reading->complete) {
    ++counters_["dvl_frame_malformed"];
    return {};
  }
  const FieldValues& values = reading->values;
  if (values.present.test(kDvlTimeS)) Open(values, recv);
  const std::bitset<kMaxFields> fields = values.present & (dvl_fields_ | depth_fields_);
  if (fields.none()) return {};
  const bool belongs = ensemble_ && (fields & ensemble_->values.present).none() &&
                       std::abs(ToSeconds(recv - ensemble_->first_recv)) <= params_.max_ensemble_s;
  if (!belongs) {
    ++counters_["dvl_frame_outside_ensemble"];
    // its time frame was lost: the following frames do not belong to the open ensemble either
    Finish();
    return {};
  }
  Ensemble& e = *ensemble_;
  for (std::size_t field = 0; field < kMaxFields; ++field)
    if (fields.test(field)) e.values.Set(field, values.value[field]);

  DvlOutput out;
  if (!e.dvl_given && (e.values.present & dvl_fields_) == dvl_fields_) {
    e.dvl_given = true;
    out.dvl = ToDvl(e.values, params_.signals, e.time);
  }
  if (!e.depth_given && depth_fields_.any() &&
      (e.values.present & depth_fields_) == depth_fields_) {
    e.depth_given = true;
    out.depth = ToDepth(e.values, params_.signals, e.time);
  }
  return out;
}

void DvlCanDecoder::Open(const FieldValues& values, Time recv) {
  Finish();
  const double seconds = values.value[kDvlTimeS];
  const double microseconds = values.value[kDvlTimeUs];
  // Both parts of the time must be in one frame: in two frames, parts of different ensembles could
  // not be distinguished.
  const bool usable = values.present.test(kDvlTimeUs) && seconds > 0.0 && seconds < 8e9 &&
                      microseconds >= 0.0 && microseconds < 1e6;
  if (!usable) {
    ++counters_["dvl_time_malformed"];
    return;
  }
  const Time device = FromUtime(static_cast<std::int64_t>(seconds) * 1'000'000 +
                                static_cast<std::int64_t>(microseconds));
  const std::optional<Time> time = stamper_.Stamp(device, recv);
  if (!time) {
    ++counters_["dvl_ensemble_unstamped"];
    return;
  }
  ensemble_ = Ensemble{};
  ensemble_->first_recv = recv;
  ensemble_->time = *time;
}

void DvlCanDecoder::Finish() {
  if (!ensemble_) return;
  const auto started = [this](const std::bitset<kMaxFields>& fields) {
    return (ensemble_->values.present & fields).any();
  };
  const bool nothing_given = !ensemble_->dvl_given && !ensemble_->depth_given;
  const bool dvl_lost = !ensemble_->dvl_given && started(dvl_fields_);
  const bool depth_lost = !ensemble_->depth_given && started(depth_fields_);
  if (dvl_lost || (nothing_given && !depth_lost)) ++counters_["dvl_ensemble_incomplete"];
  if (depth_lost) ++counters_["depth_ensemble_incomplete"];
  ensemble_.reset();
}

std::vector<CanFrame> DvlCanEncoder::Encode(const std::optional<DvlSample>& dvl,
                                            const std::optional<DepthSample>& depth) const {
  if (!dvl && !depth) return {};
  const std::int64_t utime = ToUtime(dvl ? dvl->time : depth->time);
  FieldValues v;
  v.Set(kDvlTimeS, static_cast<double>(utime / 1'000'000));
  v.Set(kDvlTimeUs, static_cast<double>(utime % 1'000'000));
  if (dvl) Fill(*dvl, &v);
  if (depth) Fill(*depth, &v);
  return signals_.Write(v);
}

}  // namespace seastitch
