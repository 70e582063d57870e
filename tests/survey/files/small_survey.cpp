#include "tests/survey/files/small_survey.hpp"
#include "tests/support/files.hpp"

#include <GeographicLib/UTMUPS.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <sstream>

#include "codecs/kongsberg/em_all_writer.hpp"
#include "codecs/kongsberg/kmall.hpp"
#include "codecs/kongsberg/kmall_sensors.hpp"
#include "codecs/makers/r2sonic.hpp"
#include "codecs/makers/s7k.hpp"
#include "codecs/makers/s7k_writer.hpp"
#include "common/core/pose.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/run_command.hpp"
#include "tests/survey/files/maker_records.hpp"

namespace seastitch {
namespace {

constexpr double kLatitudeDeg = 57.1, kLongitudeDeg = 11.2;
constexpr double kSpeedMps = 1.5, kDepthM = 10.0, kAboveBedM = 20.0, kSoundMps = 1500.0;
constexpr double kPingS = 0.5;
constexpr double kUsFootM = 1200.0 / 3937.0;
constexpr int kBeamsToASide = 30;
constexpr double kGpsEpochS = 315'964'800.0, kWeekS = 604'800.0;
constexpr int kLeapS = 18;
constexpr std::int64_t kNoonS = 1'777'723'200;  // 2026-05-02T12:00:00Z, a Saturday
constexpr std::int64_t kLastOfWeekS = kNoonS + 12 * 3600 - kLeapS;

// A place about the start of the survey.
struct Place {
  double latitude_deg, longitude_deg;
};
Place PlaceAt(double north_m, double east_m = 0.0) {
  constexpr double kNorthMPerDeg = 111'358.0;  // here, to a millimetre in 100 m
  const double east_m_per_deg = 60'640.0;
  return {kLatitudeDeg + north_m / kNorthMPerDeg, kLongitudeDeg + east_m / east_m_per_deg};
}

double GpsSeconds(Time t, bool in_utc) {
  return 1e-6 * static_cast<double>(ToUtime(t)) - kGpsEpochS + (in_utc ? 0 : kLeapS);
}

double AcrossM(int beam) { return 0.75 * beam; }

MbesPing PingAt(Time t, int number, bool two_heads) {
  MbesPing ping;
  ping.time = t;
  ping.ping_number = static_cast<std::uint32_t>(number);
  ping.sound_speed_mps = kSoundMps;
  ping.head = two_heads ? static_cast<std::uint8_t>(number % 2) : std::uint8_t{0};
  for (int i = -kBeamsToASide; i <= kBeamsToASide; ++i) {
    MbesBeam beam;
    const double range_m = std::hypot(AcrossM(i), kAboveBedM);
    beam.twtt_s = static_cast<float>(2.0 * range_m / kSoundMps);
    beam.rx_angle_rad = static_cast<float>(std::atan2(AcrossM(i), kAboveBedM));
    beam.backscatter_db = -20.0f;
    beam.flags = kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

SonarInstallation Installation(Time t, double water_line_m) {
  SonarInstallation installation;
  installation.time = t;
  installation.transmitters.resize(1);
  installation.receivers.resize(1);
  installation.water_line_m = water_line_m;
  return installation;
}

SoundVelocityProfile Profile(Time t) { return {t, {0.0, 60.0}, {kSoundMps, kSoundMps}}; }

std::string Text(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

Time SmallSurvey::Start(const SurveyFaults& faults) {
  const std::int64_t start_s =
      faults.week_ends ? kLastOfWeekS - static_cast<std::int64_t>(kPings * kPingS / 2) : kNoonS;
  return FromUtime(start_s * 1'000'000);
}

namespace {

// Position, attitude and heave at a time of the survey.
NavigationRecord SampleAt(Time start, double t_s) {
  const Place place = PlaceAt(kSpeedMps * t_s);
  NavigationRecord sample;
  sample.time = start + FromSeconds(t_s);
  sample.position =
      GeoPosition{Deg2Rad(place.latitude_deg), Deg2Rad(place.longitude_deg), {1.0, 1.0}};
  sample.velocity = GeoVelocity{{kSpeedMps, 0.0, 0.0}};
  sample.attitude = Attitude{};
  sample.heave_m = kDepthM;
  return sample;
}

// A second of motion.
std::vector<NavigationRecord> MotionFrom(Time start, double t_s) {
  std::vector<NavigationRecord> samples;
  for (int i = 0; i < 10; ++i) samples.push_back(SampleAt(start, t_s + 0.1 * i));
  return samples;
}

std::string Track(Time start, double pause_s) {
  constexpr int kPings = SmallSurvey::kPings;
  std::ostringstream text;
  text.precision(15);
  for (int i = -50; i < kPings * 5 + 50; ++i) {
    const double t_s = 0.1 * i + (2 * i < 5 * kPings ? 0.0 : pause_s);
    const Place place = PlaceAt(kSpeedMps * t_s);
    text << 1e-6 * static_cast<double>(ToUtime(start)) + t_s << ',' << place.longitude_deg << ','
         << place.latitude_deg << ',' << kDepthM << ",0,0,0\n";
  }
  return text.str();
}
constexpr const char* kTrackColumns =
    "columns:\n  - {quantity: epoch, column: 1}\n  - {quantity: longitude, column: 2}\n"
    "  - {quantity: latitude, column: 3}\n  - {quantity: depth, column: 4}\n"
    "  - {quantity: heading, column: 5}\n  - {quantity: roll, column: 6}\n"
    "  - {quantity: pitch, column: 7}\n";

// East and north in the grid of soundings by line, in metres.
Eigen::Vector2d Grid(const Place& place) {
  int zone = 0;
  bool is_north = false;
  double x = 0.0, y = 0.0;
  GeographicLib::UTMUPS::Forward(place.latitude_deg, place.longitude_deg, zone, is_north, x, y, 32);
  return {x, y};
}

}  // namespace

SmallSurvey::SmallSurvey(SurveyFormat format, const SurveyFaults& faults)
    : format_(format), faults_(faults) {
  switch (format) {
    case SurveyFormat::kKmall: WriteKmall(); break;
    case SurveyFormat::kAll: WriteAll(); break;
    case SurveyFormat::kS7k: WriteS7k(); break;
    case SurveyFormat::kXtf: WriteXtf(); break;
    case SurveyFormat::kGsf: WriteGsf(); break;
    case SurveyFormat::kCereal: WriteCereal(); break;
    case SurveyFormat::kSbet: WriteSbet(); break;
    case SurveyFormat::kText: WriteText(); break;
    case SurveyFormat::kLas: WriteLas(); break;
    case SurveyFormat::kXyz: WriteXyz(); break;
  }
}

double SmallSurvey::At(double t_s) const {
  return 2.0 * t_s < kPings * kPingS ? t_s : t_s + faults_.pause_s;
}

Time SmallSurvey::StampOf(int ping) const {
  const double jump_s = ping >= 100 && ping < 108 ? faults_.jump_s : 0.0;
  return Start(faults_) + FromSeconds(At(kPingS * ping + 0.25) + jump_s);
}

std::string SmallSurvey::bytes() const {
  return std::accumulate(records_.begin(), records_.end(), head_);
}

void SmallSurvey::Add(const std::vector<std::uint8_t>& record) { records_.push_back(Text(record)); }

void SmallSurvey::WriteKmall() {
  constexpr std::size_t kStampOfSpo = 28;
  constexpr std::int64_t k1024WeeksS = 1024LL * 7 * 86'400;
  const KmallHeader header;
  const Time start = Start(faults_);
  head_ = Text(EncodeIip(Installation(start, 0.0), header));
  if (!faults_.no_profile) head_ += Text(EncodeSvp(Profile(start), header));
  for (int i = 0; i < kPings; ++i) {
    const Time t = StampOf(i);
    if (i % 2 == 0) {
      auto motion = MotionFrom(start, At(kPingS * i));
      for (NavigationRecord& sample : motion) {
        sample.position.reset();
        sample.velocity.reset();
        sample.time += FromSeconds(faults_.sensors_ahead_s);
      }
      if (!faults_.no_attitude) Add(EncodeSkm(motion, header));
      auto position = EncodeSpo(SampleAt(start, At(kPingS * i)), header);
      Patch32(&position,
              kStampOfSpo,
              std::llround(faults_.sensors_ahead_s) - (faults_.weeks_overflow ? k1024WeeksS : 0));
      Add(position);
    }
    if (i == kPings / 2 && faults_.water_line_m != 0.0)
      Add(EncodeIip(Installation(t, faults_.water_line_m), header));
    Add(EncodeMrz(PingAt(t, i, faults_.two_heads), header));
  }
}

void SmallSurvey::WriteAll() {
  const Time start = Start(faults_);
  head_ = Text(EncodeEmI(Installation(start, 0.0)));
  if (!faults_.no_profile) head_ += Text(EncodeEmU(Profile(start)));
  for (int i = 0; i < kPings; ++i) {
    const Time t = StampOf(i);
    if (i % 2 == 0) {
      const NavigationRecord sample = SampleAt(start, At(kPingS * i));
      if (!faults_.no_attitude) Add(EncodeEmA(MotionFrom(start, At(kPingS * i))));
      Add(WithGga(EncodeEmP(sample), sample.time + FromSeconds(faults_.sensors_ahead_s)));
    }
    if (i == kPings / 2 && faults_.water_line_m != 0.0)
      Add(EncodeEmI(Installation(t, faults_.water_line_m)));
    const auto ping = EncodeEmN(PingAt(t, i, false));
    Add(faults_.two_heads && i % 2 == 1 ? OfSecondHead(ping) : ping);
  }
}

void SmallSurvey::WriteS7k() {
  const Time start = Start(faults_);
  head_ = Text(EncodeS7k7030(Installation(start, 0.0)));
  if (!faults_.no_profile) head_ += Text(EncodeS7k1009(Profile(start)));
  for (int i = 0; i < kPings; ++i) {
    const Time t = StampOf(i);
    if (i % 2 == 0) {
      if (faults_.no_attitude) {
        ByteWriter heading;
        heading.Le(0.0f);
        Add(EncodeS7kRecord(1013, {}, start + FromSeconds(At(kPingS * i)), heading.bytes()));
      } else {
        Add(EncodeS7k1016(MotionFrom(start, At(kPingS * i))));
      }
      Add(EncodeS7k1003(SampleAt(start, At(kPingS * i))));
    }
    if (i == kPings / 2 && faults_.water_line_m != 0.0)
      Add(EncodeS7k7030(Installation(t, faults_.water_line_m)));
    const MbesPing ping = PingAt(t, i, faults_.two_heads);
    const S7kPingId id{.head = ping.head, .ping_number = ping.ping_number};
    Add(EncodeS7k7000(id, t, kSoundMps));
    Add(EncodeS7k7027(id, ping));
  }
}

void SmallSurvey::WriteXtf() {
  const Time start = Start(faults_);
  ByteWriter head;
  head.Le(std::uint8_t{123});
  head.Zeros(163);
  head.Le(std::uint16_t{3});  // degrees
  head.Le(std::uint16_t{0});
  head.Le(std::uint16_t{1});
  head.Zeros(1024 - head.size());
  head_ = Text(head.bytes());
  for (int i = 0; i < kPings; ++i) {
    const Time t = StampOf(i);
    if (i % 2 == 0) {
      for (const NavigationRecord& sample : MotionFrom(start, At(kPingS * i))) {
        ByteWriter motion;
        motion.Zeros(16);
        for (const float v : {0.0f, 0.0f, static_cast<float>(-kDepthM), 0.0f, 0.0f, 0.0f})
          motion.Le(v);
        AddXtfTime(sample.time, &motion);
        motion.Le(static_cast<std::uint16_t>(ToUtime(sample.time) / 1000 % 1000));
        if (!faults_.no_attitude) Add(XtfPacket(3, 0, motion));
      }
      const Place place = PlaceAt(kSpeedMps * At(kPingS * i));
      ByteWriter position;
      AddXtfTime(start + FromSeconds(At(kPingS * i)), &position);
      position.Le(std::uint16_t{0});
      for (const double v : {place.latitude_deg, place.longitude_deg, 0.0}) position.Le(v);
      Add(XtfPacket(107, 0, position));
    }
    ByteWriter ping;
    AddXtfTime(t, &ping);
    ping.Le(static_cast<std::uint8_t>(ToUtime(t) / 10'000 % 100));
    ping.Zeros(242 - ping.size());
    ping.Append(EncodeBth0(PingAt(t, i, false)));
    Add(XtfPacket(65, faults_.two_heads ? static_cast<std::uint8_t>(i % 2) : 0, ping, 2048));
  }
}

void SmallSurvey::WriteGsf() {
  ByteWriter version;
  for (const char c : std::string("GSF-v03.09")) version.Be(static_cast<std::uint8_t>(c));
  version.Zeros(2);
  head_ = Text(GsfRecord(1, version));
  for (int i = 0; i < kPings; ++i) {
    const Time t = StampOf(i);
    const Place place = PlaceAt(kSpeedMps * At(kPingS * i + 0.25));
    ByteWriter d;
    d.Be(static_cast<std::uint32_t>(ToUtime(t) / 1'000'000));
    d.Be(static_cast<std::uint32_t>(ToUtime(t) % 1'000'000 * 1000));
    d.Be(static_cast<std::int32_t>(std::lround(1e7 * place.longitude_deg)));
    d.Be(static_cast<std::int32_t>(std::lround(1e7 * place.latitude_deg)));
    d.Be(static_cast<std::uint16_t>(2 * kBeamsToASide + 1));
    d.Be(static_cast<std::uint16_t>(kBeamsToASide));
    d.Zeros(2 + 8 + 8 + 18);  // flags, correctors, attitude, the rest
    const auto sub = [&d](std::uint8_t id, std::size_t size) {
      d.Be(std::uint32_t{id} << 24 | static_cast<std::uint32_t>(size));
    };
    sub(100, 4 + 24);
    d.Be(std::uint32_t{2});
    for (const std::uint32_t id : {1u, 2u}) {  // depth and across, both in centimetres
      d.Be(id << 24);
      d.Be(std::uint32_t{100});
      d.Be(std::int32_t{0});
    }
    sub(1, 2 * (2 * kBeamsToASide + 1));
    for (int b = -kBeamsToASide; b <= kBeamsToASide; ++b)
      d.Be(static_cast<std::uint16_t>(std::lround(100.0 * (kDepthM + kAboveBedM))));
    sub(2, 2 * (2 * kBeamsToASide + 1));
    for (int b = -kBeamsToASide; b <= kBeamsToASide; ++b)
      d.Be(static_cast<std::int16_t>(std::lround(100.0 * AcrossM(b))));
    Add(GsfRecord(2, d));
  }
}

// The vehicle runs east.
void SmallSurvey::WriteCereal() {
  ByteWriter count;
  count.Le(std::uint64_t{kPings});
  head_ = Text(count.bytes());
  const auto point = [](ByteWriter* out, double east_m, double north_m, double down_m) {
    out->Le(std::int32_t{3});
    out->Le(std::int32_t{1});
    for (const double v : {east_m, north_m, -down_m}) out->Le(v);
  };
  for (int i = 0; i < kPings; ++i) {
    ByteWriter out;
    out.Le(static_cast<std::uint32_t>(i));
    const std::string name = "ping";
    out.Le(static_cast<std::uint64_t>(name.size()));
    for (const char c : name) out.Le(static_cast<std::uint8_t>(c));
    out.Le(ToUtime(StampOf(i)) / 1000);
    for (int k = 0; k < 4; ++k) out.Le(0.0);
    out.Le(static_cast<std::uint8_t>(i == 0));
    const double east_m = kSpeedMps * At(kPingS * i + 0.25);
    point(&out, east_m, 0.0, kDepthM);
    out.Le(static_cast<std::uint64_t>(2 * kBeamsToASide + 1));
    for (int b = -kBeamsToASide; b <= kBeamsToASide; ++b)
      point(&out, east_m, AcrossM(b), kDepthM + kAboveBedM);
    out.Le(std::uint64_t{0});
    Add(out.bytes());
  }
}

void SmallSurvey::WriteSbet() {
  const Time start = Start(faults_);
  for (int i = -50; i < kPings * 5 + 50; ++i) {
    const double t_s = At(0.1 * i);
    const Place place = PlaceAt(kSpeedMps * t_s, 1.0);
    std::array<double, 17> row{};
    row[0] = std::fmod(GpsSeconds(start + FromSeconds(t_s), faults_.in_utc), kWeekS);
    row[1] = Deg2Rad(place.latitude_deg);
    row[2] = Deg2Rad(place.longitude_deg);
    row[4] = kSpeedMps;
    records_.emplace_back(reinterpret_cast<const char*>(row.data()), sizeof row);
  }
}

void SmallSurvey::WriteText() {
  std::istringstream lines(Track(Start(faults_), faults_.pause_s));
  for (std::string line; std::getline(lines, line);) records_.push_back(line + "\n");
}

void SmallSurvey::WriteLas() {
  nlohmann::json points = nlohmann::json::array();
  const double unit_m = faults_.in_feet ? kUsFootM : 1.0;
  for (int i = 0; i < kPings; ++i)
    for (int b = -kBeamsToASide; b <= kBeamsToASide; ++b) {
      const Eigen::Vector2d p =
          Grid(PlaceAt(kSpeedMps * At(kPingS * i + 0.25), AcrossM(b))) / unit_m;
      const double gps_s = GpsSeconds(StampOf(i), faults_.in_utc);
      points.push_back({p.x(),
                        p.y(),
                        -(kDepthM + kAboveBedM) / unit_m,
                        faults_.week_ends ? std::fmod(gps_s, kWeekS) : gps_s - 1e9,
                        2,
                        1,
                        0,
                        0});
    }
  nlohmann::json spec{{"version", 4}, {"format", 1}, {"adjusted", !faults_.week_ends}};
  if (faults_.in_feet)
    spec["wkt"] =
        "PROJCS[\"\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,"
        "298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],"
        "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",0],"
        "PARAMETER[\"central_meridian\",9],PARAMETER[\"scale_factor\",0.9996],"
        "PARAMETER[\"false_easting\",1640416.66666667],PARAMETER[\"false_northing\",0],"
        "UNIT[\"US survey foot\",0.304800609601219]]";
  else
    spec["epsg"] = 32632;
  spec["points"] = points;
  const TemporaryDir dir;
  const std::string input = dir.Write("in.json", spec.dump());
  const auto written =
      RunCommand("python3 " + (SourceDir() / "tests/codecs/write_las.py").string() + " " +
                 (dir / "a.las").string() + " < " + input);
  EXPECT_EQ(written.exit_code, 0) << written.output;
  const std::string all = TextOf(dir / "a.las");
  constexpr std::size_t kPointBytes = 28;
  const std::size_t of_points = kPointBytes * points.size();
  head_ = all.substr(0, all.size() - of_points);
  for (std::size_t at = head_.size(); at < all.size(); at += kPointBytes)
    records_.push_back(all.substr(at, kPointBytes));
}

void SmallSurvey::WriteXyz() {
  const double unit_m = faults_.in_feet ? kUsFootM : 1.0;
  for (int i = 0; i < kPings; ++i)
    for (int b = -kBeamsToASide; b <= kBeamsToASide; ++b) {
      const Eigen::Vector2d p =
          Grid(PlaceAt(kSpeedMps * At(kPingS * i + 0.25), AcrossM(b))) / unit_m;
      std::ostringstream line;
      line.precision(12);
      line << p.x() << ' ' << p.y() << ' ' << (kDepthM + kAboveBedM) / unit_m << '\n';
      records_.push_back(line.str());
    }
}

std::vector<std::filesystem::path> SmallSurvey::Write(const std::string& bytes,
                                                      const TemporaryDir& dir) const {
  constexpr std::array<const char*, kSurveyFormats> kNames{"a.kmall",
                                                           "a.all",
                                                           "a.s7k",
                                                           "a.xtf",
                                                           "a.gsf",
                                                           "a.cereal",
                                                           "a.sbet",
                                                           "a.csv",
                                                           "a.las",
                                                           "a.xyz"};
  std::vector<std::filesystem::path> files{
      dir.Write(kNames.at(static_cast<std::size_t>(format_)), bytes)};
  if (format_ == SurveyFormat::kText) dir.Write("a.csv.yaml", kTrackColumns);
  if (format_ == SurveyFormat::kSbet || format_ == SurveyFormat::kText) {
    SurveyFaults of_kmall;
    of_kmall.week_ends = faults_.week_ends;
    of_kmall.pause_s = faults_.pause_s;
    files.push_back(dir.Write("b.kmall", SmallSurvey(SurveyFormat::kKmall, of_kmall).bytes()));
  }
  if (format_ == SurveyFormat::kXyz)
    dir.Write("a.xyz.yaml",
              faults_.in_feet ? "crs: +proj=utm +zone=32 +datum=WGS84 +units=us-ft\n"
                              : "crs: EPSG:32632\n");
  if (format_ == SurveyFormat::kLas || format_ == SurveyFormat::kXyz) {
    files.push_back(dir.Write("track.csv", Track(Start(faults_), faults_.pause_s)));
    dir.Write("track.csv.yaml", kTrackColumns);
  }
  return files;
}

}  // namespace seastitch
