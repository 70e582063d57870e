#pragma once

#include <vector>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "seastitch/config_request_t.hpp"
#include "seastitch/graph_request_t.hpp"
#include "seastitch/health_t.hpp"

// A message of every channel, each field filled and every list with elements.
namespace seastitch::examples {

inline const Time kTime = FromUtime(1'700'000'000'123'456);
inline const MessageStamp kStamp{FromUtime(1'700'000'000'200'000), 42};

template <class Msg>
std::vector<std::uint8_t> Encoded(const Msg& msg) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(msg.getEncodedSize()));
  msg.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

inline ImuSample Imu() {
  ImuSample sample;
  sample.time = kTime;
  sample.angular_rate_radps = {0.1, -0.2, 0.3};
  sample.specific_force_mps2 = {0.5, 0.6, -9.8};
  sample.attitude = Attitude{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0.01, 0.02, 0.03}};
  sample.alignment = HeadingAlignment::kAligned;
  return sample;
}

inline DvlSample Dvl() {
  DvlSample sample;
  sample.time = kTime;
  sample.bottom_lock = true;
  sample.v_dvl_mps = {1.5, 0.1, -0.05};
  sample.sigma_v_mps = {0.01, 0.01, 0.005};
  for (DvlBeam& beam : sample.beams) beam = {true, 25.5, 0.3, 0.9};
  sample.altitude_m = 22.0;
  sample.error_velocity_mps = -0.02;
  return sample;
}

inline DepthSample Depth() { return {kTime, 1.2e5, 12.0, 0.05}; }

inline MbesPing Ping(int beams) {
  MbesPing ping;
  ping.time = kTime;
  ping.ping_number = 4'000'000'000;
  ping.sound_speed_mps = 1487.5;
  ping.head = 1;
  for (int i = 0; i < beams; ++i)
    ping.beams.push_back({0.04f,
                          0.001f * static_cast<float>(i),
                          -0.01f,
                          1e-4f,
                          0.002f,
                          -31.5f,
                          kBeamValid | kBeamPhase,
                          2});
  return ping;
}

inline SoundingPing Soundings(int soundings) {
  SoundingPing ping{kTime, 7, 1, {}};
  for (int i = 0; i < soundings; ++i)
    ping.soundings.push_back({{0.5f, static_cast<float>(i), 20.0f}, 0.1f, kBeamValid});
  return ping;
}

inline NavigationSample Navigation() {
  NavigationSample sample;
  sample.time = kTime;
  sample.status = InsStatus::kAided;
  sample.position = GeoPosition{0.75, -1.2, {1.5, 2.5}};
  sample.depth = InsVertical{12.0, 0.1};
  sample.height = InsVertical{-12.5, 0.2};
  sample.attitude = Imu().attitude;
  sample.velocity = GeoVelocity{{1.0, -0.5, 0.1}, {0.01, 0.02, 0.03}};
  sample.source = "phins";
  return sample;
}

inline NavState Nav() {
  NavState nav;
  nav.time = kTime;
  nav.T_map_vehicle = MakePose({100.0, -200.0, 30.0}, RotationFromRpy(0.1, -0.05, 2.5));
  nav.v_map_mps = {1.0, 0.5, 0.0};
  for (int i = 0; i < 6; ++i) nav.covariance(i, i) = 0.1 * (i + 1);
  nav.covariance(0, 5) = nav.covariance(5, 0) = 0.02;
  nav.bottom_lock = true;
  return nav;
}

inline CorrectedNavState Corrected() {
  CorrectedNavState corrected;
  corrected.state = Nav();
  corrected.T_map_nav = {1.0, -2.0, 0.03};
  corrected.graph_version = 5;
  corrected.jumps = 3;
  corrected.last_jump_m = 0.4;
  corrected.last_jump_yaw_rad = -0.01;
  return corrected;
}

inline Submap ClosedSubmap() {
  Submap submap;
  submap.id = SubmapId{3};
  submap.start = kTime;
  submap.frame_time = kTime + std::chrono::seconds(30);
  submap.end = kTime + std::chrono::seconds(60);
  submap.T_map_submap = Nav().T_map_vehicle;
  submap.covariance_from_previous = Eigen::Matrix3d::Identity() * 0.01;
  submap.heading_sigma_rad = 0.02;
  submap.predicted_information = Eigen::Matrix3d::Identity() * 100.0;
  submap.soundings_read = 20;
  submap.soundings_used = 10;
  submap.footprint = {{0, 0}, {1, 0}, {1, 1}};
  for (int i = 0; i < 5; ++i) submap.cloud.Add({1, static_cast<float>(i), 3}, 2);
  return submap;
}

inline GraphUpdate Update() {
  GraphUpdate update;
  update.version = 3;
  update.graph_id = 1'700'000'000'000'001;
  update.final = true;
  update.resumed = true;
  update.vertices = {{SubmapId{4}, kTime, {10.0, 20.0, 0.5}, 0.02, 1}};
  GraphEdge loop;
  loop.kind = EdgeKind::kLoopClosure;
  loop.from = SubmapId{1};
  loop.to = SubmapId{4};
  loop.T_from_to = {1.0, -2.0, 3.0};
  loop.information << 4.0, 1.0, 0.0, 1.0, 9.0, 0.5, 0.0, 0.5, 100.0;
  loop.verdict = LoopVerdict::kPoorFit;
  loop.z_offset_m = -0.1;
  loop.rms_m = 0.05;
  loop.overlap_m2 = 300.0;
  loop.overlap_center_m = {12.0, -7.0};
  GraphEdge fix;
  fix.kind = EdgeKind::kPositionFix;
  fix.from = fix.to = SubmapId{4};
  update.edges = {loop, fix};
  update.mounting = {0.25, 0.004};
  return update;
}

inline PoseGraph Graph(int vertices, int edges) {
  PoseGraph graph;
  graph.graph_version = 5;
  graph.graph_id = 1'700'000'000'000'001;
  graph.mounting[0] = {{0.3, -0.1}, 0.002, Eigen::Matrix3d::Identity() * 0.01};
  for (int i = 0; i < vertices; ++i) {
    SolvedVertex vertex;
    vertex.id = SubmapId{i};
    vertex.T_map_level = {1.0 * i, -2.0 * i, 0.01};
    vertex.covariance = Eigen::Matrix3d::Identity() * (i + 1);
    vertex.covariance_with_newest(0, 2) = 0.5;  // not symmetric, and need not be
    graph.vertices.push_back(vertex);
  }
  for (int i = 0; i < edges; ++i)
    graph.loop_edges.push_back({SubmapId{0}, SubmapId{i + 1}, 1.0 / (i + 1)});
  return graph;
}

inline CovarianceRequest Request(int pairs) {
  CovarianceRequest request{"mapper", 3, 7, {}, 1'700'000'000'000'001};
  for (int k = 0; k < pairs; ++k) request.pairs.emplace_back(SubmapId{k}, SubmapId{2 * k + 1});
  return request;
}

inline PairCovariances Answer(int pairs) {
  PairCovariances answer{"mapper", 3, 7, {}, 1'700'000'000'000'001};
  for (int k = 0; k < pairs; ++k) {
    answer.pairs.push_back({SubmapId{k}, SubmapId{2 * k + 1}, Eigen::Matrix3d::Identity()});
    answer.pairs.back().covariance *= k + 1.0;
  }
  return answer;
}

inline graph_request_t GraphRequest() {
  graph_request_t msg{};
  msg.utime = ToUtime(kTime);
  msg.seq = kStamp.seq;
  msg.sender = "optimizer";
  msg.graph_id = 1'700'000'000'000'001;
  msg.have_version = 2;
  return msg;
}

inline config_request_t ConfigRequest() {
  config_request_t msg{};
  msg.utime = ToUtime(kTime);
  msg.seq = kStamp.seq;
  msg.sender = "logger";
  msg.process = "mapper";
  return msg;
}

inline health_t Health() {
  health_t msg{};
  msg.utime = ToUtime(kTime);
  msg.seq = kStamp.seq;
  msg.process = "mapper";
  msg.version = "0.1.0";
  msg.uptime_s = 12.5;
  msg.restarts = 1;
  msg.state = health_t::STATE_DEGRADED;
  msg.state_since_utime = ToUtime(kTime);
  msg.text = "the Doppler log has no bottom lock";
  msg.num_conditions = 1;
  msg.conditions.resize(1);
  msg.conditions[0].name = "no_bottom_lock";
  msg.conditions[0].severity = health_t::STATE_DEGRADED;
  msg.conditions[0].sentence = msg.text;
  msg.conditions[0].since_utime = ToUtime(kTime);
  msg.conditions[0].count = 2;
  msg.num_counters = 2;
  msg.counters.resize(2);
  msg.counters[0].name = "imu_lost";
  msg.counters[1].name = "dvl_lost";
  msg.counters[1].value = 3;
  msg.num_rates = 2;
  msg.rate_names = {"imu_hz", "dvl_hz"};
  msg.rate_hz = {100.0, 8.0};
  return msg;
}

inline ConfigText Config() {
  return {"mapper", "0.1.0", "mapper.yaml", "submap:\n  max_length_m: 80\n"};
}

// Calls visit(channel, message) for every channel.
template <class Visit>
void ForEach(Visit visit) {
  visit(channels::kImu, ToLcm(Imu(), kStamp));
  visit(channels::kDvl, ToLcm(Dvl(), kStamp));
  visit(channels::kDepth, ToLcm(Depth(), kStamp));
  visit(channels::kMbesPing, ToLcm(Ping(5), kStamp));
  visit(channels::kMbesSoundings, ToLcm(Soundings(5), kStamp)[0]);
  visit(channels::kIns, ToLcm(Navigation(), kStamp));
  visit(channels::kSvp, ToLcm(SoundVelocityProfile{kTime, {1, 2, 3}, {1500, 1490, 1480}}, kStamp));
  visit(channels::kPositionFix,
        ToLcm(PositionFix{{0.75, -1.2}, kTime, Eigen::Matrix2d::Identity(), "gps"}, kStamp));
  const std::vector<std::uint8_t> bytes{1, 2, 3};
  for (const char* raw :
       {channels::kRawCan, channels::kRawDvl, channels::kRawMbes, channels::kRawNav})
    visit(raw, ToRawParts(bytes, "can:can0#imu-driver", kStamp.recv, kStamp.seq)[0]);
  visit(channels::kNav, ToLcm(Nav(), kStamp.seq));
  visit(channels::kNavCorrected, ToLcm(Corrected(), kStamp.seq));
  const SubmapMessages submap = ToLcm(ClosedSubmap(), kStamp.seq, kStamp.seq);
  visit(channels::kSubmap, submap.announcement);
  visit(channels::kSubmapPoints, submap.chunks[0]);
  visit(channels::kGraphUpdate, ToLcm(Update(), kTime, kStamp.seq));
  visit(channels::kGraphRequest, GraphRequest());
  visit(channels::kPoseGraph, ToLcm(Graph(2, 2), 1, kTime, kStamp.seq)[0]);
  CovarianceRequest request = Request(2);
  request.seq = kStamp.seq;
  visit(channels::kCovarianceRequest, ToLcm(request, kTime));
  visit(channels::kCovariances, ToLcm(Answer(2), kTime, kStamp.seq));
  visit(channels::kHealth, Health());
  visit(channels::kConfig, ToLcm(Config(), kTime, kStamp.seq)[0]);
  visit(channels::kConfigRequest, ConfigRequest());
}

}  // namespace seastitch::examples
