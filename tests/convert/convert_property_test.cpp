// What ToLcm makes, FromLcm takes: every type, at its limits, inside them and, where ToLcm splits
// or thins, beyond. And every message fits one datagram.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>
#include <vector>

#include "common/convert/checks.hpp"
#include "common/convert/convert.hpp"
#include "common/core/sensors.hpp"
#include "tests/convert/example_messages.hpp"
#include "tests/support/property.hpp"

namespace seastitch {
namespace {

// Values at the ends of a range and between them, from one drawn seed: a fan has thousands.
class Draw {
 public:
  Draw() : random_(*rc::gen::arbitrary<std::uint32_t>()) {}

  double Within(double least, double most) {
    switch (Index(4)) {
      case 0: return least;
      case 1: return most;
      default: return std::uniform_real_distribution<double>(least, most)(random_);
    }
  }
  float WithinF(float least, float most) { return static_cast<float>(Within(least, most)); }
  int Index(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }
  bool Coin() { return Index(2) == 0; }
  // Around the limit of a list and far beyond it.
  std::size_t CountAround(int limit) {
    const int counts[] = {0, 1, limit - 1, limit, limit + 1, 3 * limit + 7, Index(limit)};
    return static_cast<std::size_t>(counts[Index(std::size(counts))]);
  }
  std::size_t CountUpTo(int limit) {
    const int counts[] = {0, 1, limit - 1, limit, Index(limit)};
    return static_cast<std::size_t>(counts[Index(std::size(counts))]);
  }
  std::string Text(std::size_t most) {
    return std::string(CountAround(static_cast<int>(most)), 'x');
  }
  Time Instant() {
    return FromUtime(static_cast<std::int64_t>(
        Within(0.0, static_cast<double>(ToUtime(kLatestTime) - 1'000'000))));
  }
  std::int64_t Version() { return Coin() ? 1 : std::numeric_limits<std::int64_t>::max(); }
  SubmapId Id() { return SubmapId{Coin() ? Index(1000) : std::numeric_limits<int>::max()}; }
  Eigen::Vector3d Vector(double most) {
    return {Within(-most, most), Within(-most, most), Within(-most, most)};
  }
  Eigen::Vector3d Sigmas() { return Vector(1e3).cwiseAbs(); }
  Pose2 Pose() {
    return {Within(-kMaxCoordinate_m, kMaxCoordinate_m),
            Within(-kMaxCoordinate_m, kMaxCoordinate_m),
            Within(-1e3, 1e3)};
  }
  Eigen::Quaterniond Rotation() {
    const Eigen::Quaterniond q(Within(-1, 1), Within(-1, 1), Within(-1, 1), Within(-1, 1));
    return q.norm() > 0.1 ? q.normalized() : Eigen::Quaterniond::Identity();
  }
  Eigen::Isometry3d Pose3() {
    return MakePose(Vector(kMaxCoordinate_m), Rotation().toRotationMatrix());
  }
  // Metres and radians in one matrix: entries from 1e-12 to 1e12; singular now and then.
  template <int N>
  Eigen::Matrix<double, N, N> Covariance() {
    Eigen::Matrix<double, N, N> root;
    for (double& value : root.reshaped())
      value = Index(5) == 0 ? 0.0 : std::pow(10.0, Within(-6, 6)) * Within(-1, 1);
    return root * root.transpose();
  }

 private:
  std::mt19937_64 random_;
};

template <class Msg>
Msg Wire(const Msg& msg) {
  RC_ASSERT(msg.getEncodedSize() < kMaxMessageBytes);
  const std::vector<std::uint8_t> bytes = examples::Encoded(msg);
  Msg copy{};
  RC_ASSERT(copy.decode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
            static_cast<int>(bytes.size()));
  return copy;
}

template <class Msg>
void ExpectTaken(const Msg& msg) {
  RC_ASSERT(FromLcm(Wire(msg)).has_value());
}

// A message is taken, and what it gives is what Checked() makes of the value where both are in one
// process. (Compared as messages, which hold every field.)
template <class Value>
Value Quantised(Value value) {  // those without a pose lose nothing
  return value;
}
template <class Value, class... Rest>
void ExpectSameAtBothEdges(const Value& value, const Rest&... rest) {
  const std::optional<Value> received = FromLcm(Wire(ToLcm(value, rest...)));
  RC_ASSERT(received.has_value());
  const std::optional<Value> checked = Checked(Quantised(value));
  RC_ASSERT(checked.has_value());
  RC_ASSERT(examples::Encoded(ToLcm(*received, rest...)) ==
            examples::Encoded(ToLcm(*checked, rest...)));
}

template <class Fn>
void ForAll(const char* what, Fn property) {
  EXPECT_TRUE(rc::check(what, [&] {
    Draw draw;
    property(draw);
  }));
}

const MessageStamp kStamp = examples::kStamp;

TEST(WhatToLcmMakes, IsTakenOfInertialUnitsAndLogs) {
  ForAll("IMU", [](Draw& draw) {
    ImuSample sample{draw.Instant(), draw.Vector(1e300), draw.Vector(1e300), {}, {}};
    if (draw.Coin()) sample.attitude = Attitude{draw.Rotation(), draw.Sigmas()};
    sample.alignment = static_cast<HeadingAlignment>(draw.Index(3));
    ExpectSameAtBothEdges(sample, kStamp);
  });
  ForAll("DVL", [](Draw& draw) {
    DvlSample sample;
    sample.time = draw.Instant();
    sample.bottom_lock = draw.Coin();
    sample.v_dvl_mps = draw.Vector(1e300);
    sample.sigma_v_mps = draw.Sigmas();
    for (DvlBeam& beam : sample.beams) {
      beam = {draw.Coin(), draw.Within(0, 1e300), draw.Within(-1e300, 1e300), {}};
      if (draw.Index(4) > 0) beam.quality = draw.Within(0, 1);
    }
    if (draw.Coin()) sample.altitude_m = draw.Within(0, 1e300);
    if (draw.Coin()) sample.error_velocity_mps = draw.Within(-1e300, 1e300);
    ExpectSameAtBothEdges(sample, kStamp);
  });
  ForAll("DEPTH", [](Draw& draw) {
    DepthSample sample{draw.Instant(), {}, draw.Within(-1e300, 1e300), draw.Within(0, 1e300)};
    if (draw.Coin()) sample.pressure_pa = draw.Within(-1e300, 1e300);
    ExpectSameAtBothEdges(sample, kStamp);
  });
}

TEST(WhatToLcmMakes, IsTakenOfSonars) {
  ForAll("MBES_PING", [](Draw& draw) {
    MbesPing ping;
    ping.time = draw.Instant();
    ping.ping_number = draw.Coin() ? 0 : std::numeric_limits<std::uint32_t>::max();
    ping.head = static_cast<std::uint8_t>(draw.Index(256));
    ping.sound_speed_mps = draw.Within(0, 1e300);
    ping.beams.resize(draw.CountAround(kMaxBeams));
    for (MbesBeam& beam : ping.beams)
      beam = {draw.WithinF(0, kMaxTravelTime_s),
              draw.WithinF(-3.1415f, 3.1415f),
              draw.WithinF(-3.1415f, 3.1415f),
              draw.WithinF(0, kMaxTravelTime_s),
              draw.WithinF(0, 1e30f),
              draw.WithinF(-1e30f, 1e30f),
              static_cast<std::uint8_t>(draw.Index(256)),
              static_cast<std::uint8_t>(draw.Index(256))};
    ExpectSameAtBothEdges(ping, kStamp);
  });
  ForAll("MBES_SOUNDINGS", [](Draw& draw) {
    SoundingPing ping;
    ping.time = draw.Instant();
    ping.ping_number = draw.Coin() ? 0 : std::numeric_limits<std::uint32_t>::max();
    ping.head = static_cast<std::uint8_t>(draw.Index(256));
    ping.soundings.resize(draw.CountAround(kMaxSoundings));
    for (LevelSounding& sounding : ping.soundings)
      sounding = {draw.Vector(15'000.0).cast<float>(),
                  draw.WithinF(0, 1e30f),
                  static_cast<std::uint8_t>(draw.Index(256))};
    std::size_t taken = 0;
    for (const mbes_soundings_t& msg : ToLcm(ping, kStamp)) {
      const auto part = FromLcm(Wire(msg));
      RC_ASSERT(part.has_value());
      taken += part->soundings.size();
    }
    RC_ASSERT(taken == ping.soundings.size());
  });
  ForAll("SVP", [](Draw& draw) {
    SoundVelocityProfile profile{draw.Instant(), {}, {}};
    const std::size_t samples = std::max<std::size_t>(1, draw.CountAround(kMaxProfileSamples));
    for (std::size_t i = 0; i < samples; ++i) {
      profile.depth_m.push_back(static_cast<double>(i) + draw.Within(0, 0.5));
      profile.speed_mps.push_back(draw.Within(kMinSoundSpeedMps, kMaxSoundSpeedMps));
    }
    ExpectSameAtBothEdges(profile, kStamp);
  });
}

TEST(WhatToLcmMakes, IsTakenOfNavigation) {
  ForAll("POSITION_FIX", [](Draw& draw) {
    PositionFix fix;
    fix.time = draw.Instant();
    fix.latitude_rad = draw.Within(-kPi / 2, kPi / 2);
    fix.longitude_rad = draw.Within(-kPi, kPi);
    fix.covariance_north_east_m2 = draw.Covariance<2>() + 1e-6 *
                                                              std::pow(10.0, draw.Within(0, 12)) *
                                                              Eigen::Matrix2d::Identity();
    RC_PRE(fix.covariance_north_east_m2.determinant() > 0.0);
    fix.source = draw.Text(kMaxSourceLength);
    ExpectSameAtBothEdges(fix, kStamp);
  });
  ForAll("INS", [](Draw& draw) {
    NavigationSample sample;
    sample.time = draw.Instant();
    sample.status = static_cast<InsStatus>(draw.Index(5));
    if (draw.Coin())
      sample.position = GeoPosition{draw.Within(-kPi / 2, kPi / 2),
                                    draw.Within(-kPi, kPi),
                                    {draw.Within(0, 1e9), draw.Within(0, 1e9)}};
    const double most = kMaxCoordinate_m;
    if (draw.Coin()) sample.depth = InsVertical{draw.Within(-most, most), draw.Within(0, 1e9)};
    if (draw.Coin()) sample.height = InsVertical{draw.Within(-most, most), draw.Within(0, 1e9)};
    if (draw.Coin()) sample.attitude = Attitude{draw.Rotation(), draw.Sigmas()};
    if (draw.Coin()) sample.velocity = GeoVelocity{draw.Vector(1e300), draw.Sigmas()};
    sample.source = draw.Text(kMaxSourceLength);
    ExpectSameAtBothEdges(sample, kStamp);
  });
  ForAll("NAV and NAV_CORRECTED", [](Draw& draw) {
    CorrectedNavState corrected;
    corrected.state.time = draw.Instant();
    corrected.state.T_map_vehicle = draw.Pose3();
    corrected.state.v_map_mps = draw.Vector(1e300);
    corrected.state.covariance = draw.Covariance<6>();
    corrected.state.bottom_lock = draw.Coin();
    corrected.T_map_nav = draw.Pose();
    corrected.graph_version = draw.Version() - 1;
    corrected.jumps = draw.Version() - 1;
    corrected.last_jump_m = draw.Within(0, 1e300);
    corrected.last_jump_yaw_rad = draw.Within(-1e300, 1e300);
    ExpectSameAtBothEdges(corrected.state, std::int64_t{0});
    ExpectSameAtBothEdges(corrected, std::int64_t{0});
  });
}

TEST(WhatToLcmMakes, IsTakenOfSubmaps) {
  ForAll("SUBMAP and SUBMAP_POINTS", [](Draw& draw) {
    Submap submap;
    submap.id = draw.Id();
    submap.start = draw.Instant();
    submap.frame_time = submap.start + Duration(draw.Index(500'000));
    submap.end = submap.frame_time + Duration(draw.Index(500'000));
    submap.T_map_submap = draw.Pose3();
    if (draw.Coin()) submap.covariance_from_previous = draw.Covariance<3>();
    if (draw.Coin()) submap.heading_sigma_rad = draw.Within(0, 10);
    submap.predicted_information = draw.Covariance<3>();
    submap.trigger = static_cast<SubmapTrigger>(draw.Index(6));
    submap.soundings_read = submap.soundings_used = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = draw.CountAround(kMaxFootprintCorners); i > 0; --i)
      submap.footprint.emplace_back(draw.Within(-1e7, 1e7), draw.Within(-1e7, 1e7));
    for (std::size_t i = draw.CountAround(kMaxPointsPerChunk); i > 0; --i)
      submap.cloud.Add(draw.Vector(1e30).cast<float>(), draw.WithinF(0, 1e30f));
    const SubmapMessages messages = ToLcm(submap, 0, 0);
    SubmapAssembler assembler;
    std::optional<Submap> back = assembler.Add(Wire(messages.announcement));
    for (const submap_points_t& chunk : messages.chunks) {
      RC_ASSERT(!back);
      back = assembler.Add(Wire(chunk));
    }
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->cloud.points == submap.cloud.points);
  });
}

TEST(WhatToLcmMakes, IsTakenOfGraphs) {
  const auto draw_edge = [](Draw& draw) {
    GraphEdge edge;
    edge.kind = static_cast<EdgeKind>(draw.Index(3));
    edge.from = edge.to = SubmapId{draw.Index(1000)};
    if (edge.kind == EdgeKind::kLoopClosure ||
        (edge.kind == EdgeKind::kDeadReckoning && draw.Coin()))
      edge.to = SubmapId{std::numeric_limits<int>::max()};
    edge.T_from_to = draw.Pose();
    edge.information = draw.Covariance<3>();
    edge.verdict = static_cast<LoopVerdict>(draw.Index(7));
    edge.z_offset_m = draw.Within(-1e300, 1e300);
    edge.rms_m = draw.Within(0, 1e300);
    edge.overlap_m2 = draw.Within(0, 1e300);
    edge.overlap_center_m = {draw.Within(-7e3, 7e3), draw.Within(-7e3, 7e3)};
    return edge;
  };
  ForAll("GRAPH_UPDATE", [&draw_edge](Draw& draw) {
    GraphUpdate update;
    update.version = draw.Version();
    update.graph_id = draw.Version();
    update.final = draw.Coin();
    update.resumed = draw.Coin();
    update.mounting = {draw.Within(0, 10), draw.Within(0, 1)};
    for (std::size_t i = draw.CountUpTo(kMaxVerticesPerUpdate); i > 0; --i) {
      GraphVertex vertex{draw.Id(), draw.Instant(), draw.Pose(), {}, draw.Index(100)};
      if (draw.Coin()) vertex.heading_sigma_rad = draw.Within(0, 1e300);
      update.vertices.push_back(vertex);
    }
    for (std::size_t i = draw.CountUpTo(kMaxEdgesPerUpdate); i > 0; --i)
      update.edges.push_back(draw_edge(draw));
    ExpectSameAtBothEdges(update, kStamp.recv, std::int64_t{0});
  });
  ForAll("POSE_GRAPH", [](Draw& draw) {
    PoseGraph graph;
    graph.graph_version = draw.Version() - 1;
    graph.graph_id = draw.Version();
    for (std::size_t i = draw.CountAround(50); i > 0; --i)
      graph.mounting[draw.Id().value] = {
          {draw.Within(-1, 1), draw.Within(-1, 1)}, draw.Within(-1, 1), draw.Covariance<3>()};
    for (std::size_t i = draw.CountAround(250); i > 0; --i)
      graph.vertices.push_back({SubmapId{static_cast<int>(graph.vertices.size())},
                                draw.Pose(),
                                draw.Covariance<3>(),
                                draw.Covariance<3>()});
    for (std::size_t i = draw.CountAround(500); i > 0; --i)
      graph.loop_edges.push_back({draw.Id(), draw.Id(), draw.Within(0, 1)});
    PoseGraphAssembler assembler;
    std::optional<PoseGraph> back;
    for (const pose_graph_t& part : ToLcm(graph, 1, draw.Instant(), 0)) {
      RC_ASSERT(!back);
      back = assembler.Add(Wire(part));
    }
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->vertices.size() == graph.vertices.size());
    RC_ASSERT(back->loop_edges.size() == graph.loop_edges.size());
    RC_ASSERT(back->mounting.size() == graph.mounting.size());
  });
  ForAll("COVARIANCE_REQUEST and COVARIANCES", [](Draw& draw) {
    CovarianceRequest request{draw.Text(kMaxProcessName), 0, draw.Version(), {}, 0};
    PairCovariances answer{draw.Text(kMaxProcessName), 0, draw.Version(), {}, 0};
    for (std::size_t i = draw.CountAround(kMaxCovariancePairs); i > 0; --i) {
      request.pairs.emplace_back(draw.Id(), draw.Id());
      answer.pairs.push_back({draw.Id(), draw.Id(), draw.Covariance<3>()});
    }
    ExpectSameAtBothEdges(request, kStamp.recv);
    ExpectSameAtBothEdges(answer, kStamp.recv, std::int64_t{0});
  });
}

TEST(WhatToLcmMakes, IsTakenOfRawBytesAndConfigurations) {
  ForAll("RAW_*", [](Draw& draw) {
    const std::vector<std::uint8_t> bytes(draw.CountAround(kMaxRawBytesPerPart), 7);
    std::size_t together = 0;
    for (const raw_bytes_t& part :
         ToRawParts(bytes, draw.Text(kMaxSourceLength), draw.Instant(), 0))
      together += Wire(part).data.size();
    RC_ASSERT(together == bytes.size());
  });
  ForAll("CONFIG", [](Draw& draw) {
    const ConfigText file{draw.Text(kMaxProcessName) + "p",
                          draw.Text(kMaxProcessName),
                          draw.Text(kMaxSourceLength) + "n",
                          std::string(draw.CountAround(kMaxConfigBytesPerPart), 'x')};
    ConfigAssembler assembler;
    std::optional<ConfigText> back;
    for (const config_t& part : ToLcm(file, draw.Instant(), 0)) {
      RC_ASSERT(!back);
      back = assembler.Add(Wire(part));
    }
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->text == file.text);
  });
}

}  // namespace
}  // namespace seastitch
