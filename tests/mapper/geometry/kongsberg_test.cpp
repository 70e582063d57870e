// Six pings of a real EM 2042 (the first stored as EM 2040), 3 to 5 m above the seabed of a
// harbour: Kongsberg's own x, y, z of every sounding beside the travel times and angles that they
// come from. From these, the installation parameters (#IIP), the motion (#SKM) and the profile
// (#SVP) of the same file, our geometry has to find the same places.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "codecs/kongsberg/kmall.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"
#include "mapper/geometry/georeference.hpp"
#include "tests/drivers/test_data.hpp"
#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"

namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;

constexpr double kMetresPerDegree = 111'250.0;  // of latitude at 51 degrees; a degree of longitude
                                                // is shorter by its cosine
constexpr double kTolerancePartOfDepth = 0.002;
constexpr double kTolerancePartOfAcross = 0.005;

ByteReader At(Bytes bytes, std::size_t offset) {
  ByteReader reader(bytes);
  reader.Skip(offset);
  return reader;
}

// --- the file ----------------------------------------------------------------------------------

struct Motion {
  double t_s;  // since kEpochS
  double roll_deg, pitch_deg, heading_deg, heave_m, latitude_deg, longitude_deg;
};
constexpr std::uint32_t kEpochS = 1'764'236'333;
const Time kEpoch = FromUtime(std::int64_t{kEpochS} * 1'000'000);

struct KongsbergPing {
  MbesPing ping;  // every beam marked valid: rejected ones are placed by the same geometry
  std::vector<int> sub_array;  // by beam: which third of the transmitter sent it
  std::vector<Eigen::Vector3d> forward_right_down;  // by beam: from the reference point, level
  double water_line_m = 0.0;                        // down from the reference point
  double heading_deg = 0.0;
};

struct File {
  std::vector<Motion> motion;
  std::vector<KongsbergPing> pings;
  SoundVelocityProfile profile;
  std::string installation;
};

void ReadMotion(Bytes d, std::vector<Motion>* motion) {
  const std::size_t info = At(d, 20).Le<std::uint16_t>();
  const std::size_t count = At(d, 26).Le<std::uint16_t>();
  const std::size_t size = At(d, 28).Le<std::uint16_t>();
  for (std::size_t i = 0; i < count; ++i) {
    ByteReader in = At(d, 20 + info + i * size + 8);
    Motion m;
    const std::uint32_t s = in.Le<std::uint32_t>();
    m.t_s = double(s) - double(kEpochS) + 1e-9 * in.Le<std::uint32_t>();
    in.Skip(4);
    m.latitude_deg = in.Le<double>();
    m.longitude_deg = in.Le<double>();
    in.Skip(4);
    m.roll_deg = in.Le<float>();
    m.pitch_deg = in.Le<float>();
    m.heading_deg = in.Le<float>();
    m.heave_m = in.Le<float>();
    motion->push_back(m);
  }
}

KongsbergPing ReadPing(Bytes d) {
  KongsbergPing result;
  const auto ping = DecodeMrz(d);
  EXPECT_TRUE(ping);
  result.ping = *ping;
  const std::size_t info_at = 24 + At(d, 24).Le<std::uint16_t>();
  result.heading_deg = At(d, info_at + 96).Le<float>();
  result.water_line_m = At(d, info_at + 108).Le<float>();
  const std::size_t sectors = At(d, info_at + 92).Le<std::uint16_t>();
  const std::size_t sector_size = At(d, info_at + 94).Le<std::uint16_t>();
  const std::size_t sectors_at = info_at + At(d, info_at).Le<std::uint16_t>();
  const std::size_t rx_at = sectors_at + sectors * sector_size;
  const std::size_t sounding_size = At(d, rx_at + 6).Le<std::uint16_t>();
  const std::size_t soundings_at =
      rx_at + At(d, rx_at).Le<std::uint16_t>() +
      At(d, rx_at + 28).Le<std::uint16_t>() * At(d, rx_at + 30).Le<std::uint16_t>();
  for (std::size_t i = 0; i < result.ping.beams.size(); ++i) {
    const std::size_t at = soundings_at + i * sounding_size;
    const std::size_t sector = At(d, at + 2).Le<std::uint8_t>();
    result.sub_array.push_back(At(d, sectors_at + sector * sector_size + 2).Le<std::uint8_t>());
    ByteReader in = At(d, at + 96);
    const double z = in.Le<float>();
    const double y = in.Le<float>();
    const double x = in.Le<float>();
    result.forward_right_down.emplace_back(x, y, z);
    result.ping.beams[i].flags |= kBeamValid;
  }
  return result;
}

File ReadFile() {
  File file;
  const ByteVector all = BytesOf(Shared("data/mbes/em2040_OS01.kmall"));
  for (std::size_t at = 0; at + 20 <= all.size();) {
    const std::size_t size = At(Bytes(all), at).Le<std::uint32_t>();
    const Bytes d = Bytes(all).subspan(at, size);
    const auto header = ReadKmallHeader(d);
    if (!header) break;
    if (header->Is("#SKM")) ReadMotion(d, &file.motion);
    if (header->Is("#MRZ")) file.pings.push_back(ReadPing(d));
    if (header->Is("#SVP")) file.profile = *DecodeSvp(d);
    if (header->Is("#IIP")) file.installation.assign(d.begin() + 26, d.end() - 4);
    at += size;
  }
  std::sort(file.motion.begin(), file.motion.end(), [](const Motion& a, const Motion& b) {
    return a.t_s < b.t_s;
  });
  return file;
}

// --- installation ------------------------------------------------------------------------------

// "TRAI_TX1:N=5001;X=-0.512;Y=..." to {X: -0.512, ...}; what is no number is left out.
std::map<std::string, double> Item(const std::string& installation, const std::string& name) {
  std::map<std::string, double> values;
  const std::size_t from = installation.find(name + ":");
  std::string text = installation.substr(from + name.size() + 1);
  text.resize(text.find(','));
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(';', at), text.size());
    const std::size_t equals = text.find('=', at);
    char* stop = nullptr;
    const double value = std::strtod(text.c_str() + equals + 1, &stop);
    if (stop == text.c_str() + end) values[text.substr(at, equals - at)] = value;
    at = end + 1;
  }
  return values;
}

// Place and angles of an array, and in its own axes the place that sends or listens.
Eigen::Isometry3d Array(std::map<std::string, double> item, const std::string& centre) {
  return MakePose({item["X"], item["Y"], item["Z"]},
                  RotationFromRpy(Deg2Rad(item["R"]), Deg2Rad(item["P"]), Deg2Rad(item["H"]))) *
         Eigen::Translation3d(item[centre + "X"], item[centre + "Y"], item[centre + "Z"]);
}

// Sub-arrays 0, 1, 2: port, centre, starboard of the transmitter.
VehicleGeometry Vehicle(const std::string& installation, int sub_array) {
  static const std::array<std::string, 3> kCentres{"IP", "IC", "IS"};
  VehicleGeometry vehicle;
  vehicle.T_mbes_tx =
      Array(Item(installation, "TRAI_TX1"), kCentres[static_cast<std::size_t>(sub_array)]);
  vehicle.T_mbes_rx = Array(Item(installation, "TRAI_RX1"), "I");
  return vehicle;
}

// --- comparison --------------------------------------------------------------------------------

// The map lies at the water line under the reference point, north along the ping's heading.
PoseLookup PoseOf(const std::vector<Motion>& motion, const KongsbergPing& ping) {
  const auto at = [&motion](double t_s) {
    // The last ping lies 60 ms after the last motion: carried on.
    std::size_t i = 1;
    while (i + 1 < motion.size() && motion[i].t_s < t_s) ++i;
    const Motion& a = motion[i - 1];
    const Motion& b = motion[i];
    const double w = (t_s - a.t_s) / (b.t_s - a.t_s);
    const auto mix = [w](double from, double to) { return from + w * (to - from); };
    return Motion{t_s,
                  mix(a.roll_deg, b.roll_deg),
                  mix(a.pitch_deg, b.pitch_deg),
                  mix(a.heading_deg, b.heading_deg),
                  mix(a.heave_m, b.heave_m),
                  mix(a.latitude_deg, b.latitude_deg),
                  mix(a.longitude_deg, b.longitude_deg)};
  };
  const double start_s = ToSeconds(ping.ping.time - kEpoch);
  const Motion start = at(start_s);
  return [=](Time t) -> std::optional<Eigen::Isometry3d> {
    const Motion m = at(ToSeconds(t - kEpoch));
    const double north = (m.latitude_deg - start.latitude_deg) * kMetresPerDegree;
    const double east = (m.longitude_deg - start.longitude_deg) * kMetresPerDegree *
                        std::cos(Deg2Rad(start.latitude_deg));
    const double heading = Deg2Rad(start.heading_deg);
    return MakePose(
        {north * std::cos(heading) + east * std::sin(heading),
         east * std::cos(heading) - north * std::sin(heading),
         m.heave_m - start.heave_m - ping.water_line_m},
        RotationFromRpy(
            Deg2Rad(m.roll_deg), Deg2Rad(m.pitch_deg), Deg2Rad(m.heading_deg - start.heading_deg)));
  };
}

struct Residual {
  int beam;
  double angle_rad;  // from the vertical, from transmitter or receiver
  Eigen::Vector3d expected;
  Eigen::Vector3d error;  // ours - theirs
};

// vehicle_of: the installation as a beam of that sub-array sees it.
template <class VehicleOf>
std::vector<Residual> Residuals(const File& file,
                                const KongsbergPing& ping,
                                const RayTracer& rays,
                                const VehicleOf& vehicle_of) {
  std::vector<Residual> residuals;
  for (int sub_array = 0; sub_array < 3; ++sub_array) {
    MbesPing part = ping.ping;
    for (std::size_t i = 0; i < part.beams.size(); ++i)
      if (ping.sub_array[i] != sub_array) part.beams[i].flags = 0;
    const auto result = Georeference(part, PoseOf(file.motion, ping), vehicle_of(sub_array), rays);
    EXPECT_TRUE(result);
    EXPECT_EQ(result->beams_refused, 0);
    for (const Sounding& s : result->soundings) {
      const Eigen::Vector3d& expected = ping.forward_right_down[static_cast<std::size_t>(s.beam)];
      const Eigen::Vector3d ours = s.p_map + Eigen::Vector3d(0.0, 0.0, ping.water_line_m);
      residuals.push_back(
          {s.beam, std::atan2(expected.y(), expected.z() - 1.7), expected, ours - expected});
    }
  }
  std::sort(residuals.begin(), residuals.end(), [](const Residual& a, const Residual& b) {
    return a.beam < b.beam;
  });
  return residuals;
}

struct Rms {
  double sum2 = 0.0;
  int n = 0;
  void Add(double value) { sum2 += value * value, ++n; }
  double Value() const { return std::sqrt(sum2 / std::max(n, 1)); }
};

struct Summary {
  Eigen::Vector3d rms_m;
  double depth_part;   // RMS of z error by depth below the transducer
  double across_part;  // RMS of y error by distance across, soundings abreast by over a metre
};

// Over the beams within 60 degrees.
Summary Summarise(const std::vector<Residual>& residuals) {
  std::array<Rms, 3> rms;
  Rms depth, across;
  for (const Residual& r : residuals) {
    if (std::abs(r.angle_rad) > Deg2Rad(60.0)) continue;
    for (int axis = 0; axis < 3; ++axis) rms[static_cast<std::size_t>(axis)].Add(r.error(axis));
    depth.Add(r.error.z() / (r.expected.z() - 1.7));
    if (std::abs(r.expected.y()) > 1.0) across.Add(r.error.y() / r.expected.y());
  }
  return {{rms[0].Value(), rms[1].Value(), rms[2].Value()}, depth.Value(), across.Value()};
}

class KongsbergPings : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_WITHOUT(Shared("data/mbes/em2040_OS01.kmall"));
    file_ = ReadFile();
    ASSERT_EQ(file_.pings.size(), 6u);
    ASSERT_EQ(file_.motion.size(), 204u);
    rays_ = RayTracer::Make(file_.profile);
    ASSERT_TRUE(rays_);
  }
  template <class VehicleOf>
  std::vector<Residual> AllResiduals(const VehicleOf& vehicle_of) const {
    std::vector<Residual> all;
    for (const KongsbergPing& ping : file_.pings) {
      const auto one = Residuals(file_, ping, *rays_, vehicle_of);
      all.insert(all.end(), one.begin(), one.end());
    }
    return all;
  }

  File file_;
  std::optional<RayTracer> rays_;
};

TEST_F(KongsbergPings, SoundingsFromRawTimesAndAnglesAreWhereKongsbergPutsThem) {
  std::printf("ping  beams  RMS within 60 deg, mm: x y z;  of depth and of distance across, %%\n");
  for (const KongsbergPing& ping : file_.pings) {
    const auto residuals = Residuals(
        file_, ping, *rays_, [&](int sub_array) { return Vehicle(file_.installation, sub_array); });
    ASSERT_EQ(residuals.size(), ping.ping.beams.size());
    const Summary summary = Summarise(residuals);
    std::printf("%5u  %5zu  %.2f %.2f %.2f  %.4f %.4f\n",
                ping.ping.ping_number,
                residuals.size(),
                1e3 * summary.rms_m.x(),
                1e3 * summary.rms_m.y(),
                1e3 * summary.rms_m.z(),
                1e2 * summary.depth_part,
                1e2 * summary.across_part);
    for (std::size_t i = 0; i < residuals.size(); i += 64) {
      const Residual& r = residuals[i];
      std::printf("       beam %3d at %5.1f deg: %6.2f %6.2f %6.2f mm\n",
                  r.beam,
                  Rad2Deg(r.angle_rad),
                  1e3 * r.error.x(),
                  1e3 * r.error.y(),
                  1e3 * r.error.z());
    }
    EXPECT_LT(summary.depth_part, kTolerancePartOfDepth);
    EXPECT_LT(summary.across_part, kTolerancePartOfAcross);
    // And as far out as the sonar looks, within 3 mm (the last ping, whose motion is guessed) or 1.
    const double worst_m = ping.ping.time - kEpoch > FromSeconds(2.0) ? 0.003 : 0.001;
    for (const Residual& r : residuals) EXPECT_LT(r.error.norm(), worst_m) << r.beam;
  }
}

// With the three parts of the transmitter, 5 cm to either side, taken to be at its centre.
TEST_F(KongsbergPings, WithoutTheTransmittersSubArraysTheyAreOffByCentimetres) {
  const auto residuals = AllResiduals([&](int) { return Vehicle(file_.installation, 1); });
  const Summary summary = Summarise(residuals);
  std::printf("one transmit centre for all sectors, RMS mm: %.1f %.1f %.1f\n",
              1e3 * summary.rms_m.x(),
              1e3 * summary.rms_m.y(),
              1e3 * summary.rms_m.z());
  EXPECT_LT(summary.rms_m.maxCoeff(), 0.03);
}

}  // namespace
}  // namespace seastitch
