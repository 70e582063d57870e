#pragma once

namespace seastitch {

// Keys that had another name: the former name is read with one warning, so that a dive replays with
// its own configuration.
struct RenamedKey {
  const char* path;   // as Parameter::path()
  const char* was;    // in the same section
  const char* since;  // the version that renamed it
};

inline constexpr RenamedKey kRenamedKeys[] = {
    {"filter.min_support_fraction", "min_support_part", "0.1.0"},
    {"navigation.accel_resolution_mps2", "accel_step_mps2", "0.1.0"},
    {"navigation.attitude_heading_deviation_deg", "attitude_deviation_deg", "0.1.0"},
    {"navigation.attitude_noise_deg", "attitude_white_deg", "0.1.0"},
    {"navigation.depth_sigma_min_m", "depth_sigma_floor_m", "0.1.0"},
    {"navigation.dvl_sigma_min_mps", "dvl_sigma_floor_mps", "0.1.0"},
    {"navigation.gyro_resolution_radps", "gyro_step_radps", "0.1.0"},
    {"navigation.history_s", "window_s", "0.1.0"},
    {"navigation.pose_history_s", "pose_window_s", "0.1.0"},
    {"navigation.resolution_correlation_s", "step_correlation_s", "0.1.0"},
    {"overlap.min_overlap_fraction", "min_overlap_part", "0.1.0"},
    {"registration.ambiguity_margin_nats_per_patch", "ambiguity_per_patch", "0.1.0"},
    {"registration.correlated_error_ratio", "shared_error_ratio", "0.1.0"},
    {"registration.estimate_noise", "learn_noise", "0.1.0"},
    {"registration.max_residual_ratio", "max_misfit", "0.1.0"},
    {"registration.min_evidence_nats", "ambiguity_floor", "0.1.0"},
    {"sonar_mounting_sigma_deg", "sonar_mounting_deg", "0.1.0"},
    {"sonar_mounting_sigma_m", "sonar_mounting_m", "0.1.0"},
    {"water.profile_speed_error_mps", "told_speed_error_mps", "0.1.0"},
};

}  // namespace seastitch
