#pragma once

// Names of all LCM channels. Their types and rates: common/convert/channels.hpp.
namespace seastitch::channels {

inline constexpr char kImu[] = "IMU";
inline constexpr char kDvl[] = "DVL";
inline constexpr char kDepth[] = "DEPTH";
inline constexpr char kMbesPing[] = "MBES_PING";
inline constexpr char kMbesSoundings[] = "MBES_SOUNDINGS";
inline constexpr char kIns[] = "INS";
inline constexpr char kSvp[] = "SVP";
inline constexpr char kPositionFix[] = "POSITION_FIX";
// Channels with the raw bytes of devices.
inline constexpr char kRawPrefix[] = "RAW_";
inline constexpr char kRawCan[] = "RAW_CAN";
inline constexpr char kRawDvl[] = "RAW_DVL";
inline constexpr char kRawMbes[] = "RAW_MBES";
inline constexpr char kRawNav[] = "RAW_NAV";
inline constexpr char kNav[] = "NAV";
inline constexpr char kNavCorrected[] = "NAV_CORRECTED";
inline constexpr char kSubmap[] = "SUBMAP";
inline constexpr char kSubmapPoints[] = "SUBMAP_POINTS";
inline constexpr char kGraphUpdate[] = "GRAPH_UPDATE";
inline constexpr char kGraphRequest[] = "GRAPH_REQUEST";
inline constexpr char kPoseGraph[] = "POSE_GRAPH";
inline constexpr char kCovarianceRequest[] = "COVARIANCE_REQUEST";
inline constexpr char kCovariances[] = "COVARIANCES";
inline constexpr char kHealth[] = "HEALTH";
inline constexpr char kConfig[] = "CONFIG";
inline constexpr char kConfigRequest[] = "CONFIG_REQUEST";

}  // namespace seastitch::channels
