#include "codecs/kongsberg/em_all_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

#include "codecs/kongsberg/receiver_roll.hpp"
#include "common/core/bytes.hpp"
#include "common/core/pose.hpp"

namespace seastitch {
namespace {

constexpr std::uint16_t kModel = 710;
constexpr std::uint16_t kSerial = 1;
constexpr std::size_t kMaxBeams = 2048;

template <class T>
T Rounded(double value) {
  const double most = static_cast<double>(std::numeric_limits<T>::max());
  const double least = static_cast<double>(std::numeric_limits<T>::lowest());
  return static_cast<T>(std::lround(std::clamp(value, least, most)));
}

std::uint16_t Compass(double rad) {
  const double deg = std::fmod(Rad2Deg(rad) + 720.0, 360.0);
  return static_cast<std::uint16_t>(std::lround(deg * 100.0) % 36'000);
}

struct Calendar {
  std::uint32_t date;  // yyyymmdd
  std::uint32_t milliseconds;
};
Calendar CalendarOf(Time time) {
  using namespace std::chrono;
  const auto ms = round<milliseconds>(time.time_since_epoch());
  const auto day = floor<days>(ms);
  const year_month_day date{sys_days(day)};
  return {static_cast<std::uint32_t>(static_cast<int>(date.year()) * 10'000) +
              static_cast<unsigned>(date.month()) * 100 + static_cast<unsigned>(date.day()),
          static_cast<std::uint32_t>((ms - day).count())};
}

// Begins a datagram. Length, checksum and ETX are added by Seal().
ByteWriter Begin(char type, Time time, std::uint16_t counter) {
  ByteWriter out;
  out.Le(std::uint8_t{2});
  out.Le(static_cast<std::uint8_t>(type));
  out.Le(kModel);
  const Calendar calendar = CalendarOf(time);
  out.Le(calendar.date);
  out.Le(calendar.milliseconds);
  out.Le(counter);
  out.Le(kSerial);
  return out;
}

std::vector<std::uint8_t> Seal(ByteWriter* body) {
  std::vector<std::uint8_t> bytes = body->Release();
  if (bytes.size() % 2 == 0) bytes.push_back(0);  // an even number of bytes with ETX and checksum
  const auto sum = std::accumulate(bytes.begin() + 1, bytes.end(), std::uint32_t{0});
  ByteWriter out;
  out.Le(static_cast<std::uint32_t>(bytes.size() + 3));
  out.Append(bytes);
  out.Le(std::uint8_t{3});
  out.Le(static_cast<std::uint16_t>(sum));
  return out.Release();
}

struct Sector {
  float tilt_rad, delay_s;
  std::uint8_t array;
  bool operator==(const Sector&) const = default;
};

std::uint8_t DetectionOf(std::uint8_t flags) {
  constexpr std::uint8_t kInvalid = 0x80;
  const std::uint8_t method = (flags & kBeamPhase) != 0 ? 1 : 0;
  return (flags & kBeamValid) != 0 ? method : static_cast<std::uint8_t>(kInvalid | 3);
}

void Append(const char* name, double value, std::string* text) {
  char item[60];
  std::snprintf(item, sizeof item, "%s=%.4f,", name, value);
  *text += item;
}

void Append(const std::string& name,
            const Eigen::Isometry3d& pose,
            bool angles,
            std::string* text) {
  const Eigen::Vector3d& p = pose.translation();
  Append((name + "X").c_str(), p.x(), text);
  Append((name + "Y").c_str(), p.y(), text);
  Append((name + "Z").c_str(), p.z(), text);
  if (!angles) return;
  const Eigen::Vector3d rpy_deg = RpyFromRotation(pose.linear()) * Rad2Deg(1.0);
  Append((name + "R").c_str(), rpy_deg.x(), text);
  Append((name + "P").c_str(), rpy_deg.y(), text);
  Append((name + "H").c_str(), rpy_deg.z(), text);
}

}  // namespace

std::vector<std::uint8_t> EncodeEmN(const MbesPing& ping) {
  std::vector<Sector> sectors;
  std::vector<std::uint8_t> of_beam;
  std::uint16_t valid = 0;
  for (const MbesBeam& beam : ping.beams) {
    const Sector sector{beam.tx_tilt_rad, beam.tx_delay_s, beam.tx_array};
    auto found = std::find(sectors.begin(), sectors.end(), sector);
    if (found == sectors.end()) found = sectors.insert(sectors.end(), sector);
    of_beam.push_back(static_cast<std::uint8_t>(found - sectors.begin()));
    if ((beam.flags & kBeamValid) != 0) ++valid;
  }
  if (ping.beams.size() > kMaxBeams || sectors.size() > 255)
    throw std::invalid_argument("N: more beams or sectors than it can hold");
  ByteWriter out = Begin('N', ping.time, static_cast<std::uint16_t>(ping.ping_number));
  out.Le(Rounded<std::uint16_t>(10.0 * ping.sound_speed_mps));
  out.Le(static_cast<std::uint16_t>(sectors.size()));
  out.Le(static_cast<std::uint16_t>(ping.beams.size()));
  out.Le(valid);
  out.Le(10'000.0f);         // sampling frequency
  out.Le(std::uint32_t{0});  // no Doppler correction
  for (const Sector& sector : sectors) {
    out.Le(Rounded<std::int16_t>(100.0 * Rad2Deg(double{sector.tilt_rad})));
    out.Le(std::uint16_t{0});
    out.Le(0.0f);
    out.Le(sector.delay_s);
    out.Le(100'000.0f);
    out.Le(std::uint16_t{0});
    out.Le(std::uint8_t{0});
    out.Le(sector.array);
    out.Le(0.0f);
  }
  for (std::size_t i = 0; i < ping.beams.size(); ++i) {
    const MbesBeam& beam = ping.beams[i];
    // Positive to port in the file.
    out.Le(Rounded<std::int16_t>(-100.0 * Rad2Deg(double{beam.rx_angle_rad})));
    out.Le(of_beam[i]);
    out.Le(DetectionOf(beam.flags));
    out.Le(std::uint16_t{0});
    out.Le(Rounded<std::uint8_t>(2500.0 * double{beam.depth_sigma_ratio}));
    out.Le(std::int8_t{0});
    out.Le(beam.twtt_s);
    out.Le(Rounded<std::int16_t>(10.0 * double{beam.backscatter_db}));
    out.Le(std::int8_t{0});
    out.Le(std::uint8_t{0});
  }
  return Seal(&out);
}

std::vector<std::uint8_t> EncodeEmA(const std::vector<NavigationRecord>& samples) {
  constexpr std::uint16_t kOk = 0x9090;
  if (samples.empty() || samples.back().time - samples.front().time > std::chrono::seconds(60))
    throw std::invalid_argument("A: no sample, or more than a minute of them");
  // The samples' times are relative to the record's time, which has a resolution of 1 ms.
  const Time begin =
      Time(std::chrono::floor<std::chrono::milliseconds>(samples.front().time.time_since_epoch()));
  ByteWriter out = Begin('A', begin, 0);
  out.Le(static_cast<std::uint16_t>(samples.size()));
  for (const NavigationRecord& sample : samples) {
    const Eigen::Vector3d rpy =
        RpyFromRotation(sample.attitude.value_or(Attitude{}).q_ned_imu.toRotationMatrix());
    out.Le(Rounded<std::uint16_t>(1000.0 * ToSeconds(sample.time - begin)));
    out.Le(kOk);
    out.Le(Rounded<std::int16_t>(100.0 * Rad2Deg(rpy.x())));
    out.Le(Rounded<std::int16_t>(100.0 * Rad2Deg(rpy.y())));
    out.Le(Rounded<std::int16_t>(100.0 * sample.heave_m.value_or(0.0)));
    out.Le(Compass(rpy.z()));
  }
  out.Le(std::uint8_t{0});
  return Seal(&out);
}

std::vector<std::uint8_t> EncodeEmP(const NavigationRecord& sample) {
  constexpr std::uint8_t kFirstActive = 0x81;
  constexpr std::uint16_t kNotGiven = 0xFFFF;
  const GeoPosition position = sample.position.value_or(GeoPosition{});
  ByteWriter out = Begin('P', sample.time, 0);
  out.Le(Rounded<std::int32_t>(2e7 * Rad2Deg(position.latitude_rad)));
  out.Le(Rounded<std::int32_t>(1e7 * Rad2Deg(position.longitude_rad)));
  const double sigma_m = position.sigma_north_east_m.maxCoeff();
  out.Le(sigma_m > 0.0 ? Rounded<std::uint16_t>(100.0 * sigma_m) : kNotGiven);
  if (sample.velocity) {
    const Eigen::Vector3d& v = sample.velocity->v_ned_mps;
    out.Le(Rounded<std::uint16_t>(100.0 * v.head<2>().norm()));
    out.Le(Compass(std::atan2(v.y(), v.x())));
  } else {
    out.Le(kNotGiven);
    out.Le(kNotGiven);
  }
  out.Le(kNotGiven);  // heading
  out.Le(kFirstActive);
  out.Le(std::uint8_t{0});
  return Seal(&out);
}

std::vector<std::uint8_t> EncodeEmU(const SoundVelocityProfile& profile) {
  const std::size_t count = std::min(profile.depth_m.size(), profile.speed_mps.size());
  ByteWriter out = Begin('U', profile.time, 0);
  const Calendar calendar = CalendarOf(profile.time);
  out.Le(calendar.date);
  out.Le(calendar.milliseconds / 1000);  // seconds, as in real files
  out.Le(static_cast<std::uint16_t>(count));
  out.Le(std::uint16_t{1});  // cm
  for (std::size_t i = 0; i < count; ++i) {
    out.Le(Rounded<std::uint32_t>(100.0 * profile.depth_m[i]));
    out.Le(Rounded<std::uint32_t>(10.0 * profile.speed_mps[i]));
  }
  return Seal(&out);
}

std::vector<std::uint8_t> EncodeEmI(const SonarInstallation& installation) {
  std::string text;
  Append("WLZ", installation.water_line_m, &text);
  text += "SMH=1,STC=0,";
  if (const InstalledArray* const tx = installation.TransmitterOf(0))
    Append("S1", tx->At(0), true, &text);
  if (const InstalledArray* const rx = installation.ReceiverOf(0)) {
    Eigen::Isometry3d stated = rx->At(0);
    const Eigen::Vector3d rpy = RpyFromRotation(stated.linear());
    stated.linear() = RotationFromRpy(InclinationOfReceiver(rpy.x(), rpy.y()), rpy.y(), rpy.z());
    Append("S2", stated, true, &text);
  }
  Append("P1", Eigen::Isometry3d::Identity(), false, &text);
  text += "P1T=0,APS=0,";
  Append("MS", Eigen::Isometry3d::Identity(), true, &text);
  text += "ARO=2,AHE=2,AHS=2,MRP=RP,";
  ByteWriter out = Begin('I', installation.time, 0);
  out.Le(std::uint16_t{0});  // second serial number
  for (const char c : text) out.Le(static_cast<std::uint8_t>(c));
  return Seal(&out);
}

}  // namespace seastitch
