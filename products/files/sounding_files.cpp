#include "products/files/sounding_files.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/core/bytes.hpp"
#include "common/geo/map_frame.hpp"
#include "products/files/navigation_files.hpp"
#include "products/files/placed_soundings.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

struct Row {
  Eigen::Vector3d p_ned;
  Eigen::Vector2d north_east;  // in the map's files
  SubmapSoundings::Ping ping;
  std::uint16_t beam;
  std::uint16_t file;
  std::uint16_t line;
  bool used;
};

class SoundingWriter {
 public:
  virtual ~SoundingWriter() = default;
  virtual void Add(const Row& row) = 0;
  virtual void Finish() = 0;
};

// ASPRS LAS specification 1.4, revision 15.
class LasWriter : public SoundingWriter {
 public:
  LasWriter(const MapProjection& projection, Time day, std::ofstream* out)
      : wkt_(projection.Wkt()), day_(day), out_(out) {
    WriteHead();
  }

  void Add(const Row& row) override {
    const Eigen::Vector3d p(row.north_east.y(), row.north_east.x(), -row.p_ned.z());
    // Millimetres in 32 bits reach 2147 km: less than northings.
    if (count_ == 0)
      offset_ = {std::round(p.x() / kOffsetStepM) * kOffsetStepM,
                 std::round(p.y() / kOffsetStepM) * kOffsetStepM,
                 0.0};
    box_.extend(p);
    ByteWriter point;
    for (const double coordinate : p - offset_)
      point.Le(static_cast<std::int32_t>(std::lround(coordinate / kScale)));
    point.Le(std::uint16_t{0});    // intensity
    point.Le(std::uint8_t{0x11});  // return 1 of 1
    const int withheld = row.used ? 0 : 1 << 2;
    point.Le(static_cast<std::uint8_t>(withheld | (row.ping.head & 3) << 4));
    point.Le(static_cast<std::uint8_t>(row.used ? kBathymetricPoint : kNoise));
    point.Le(std::uint8_t{0});  // user data
    point.Le(std::int16_t{0});  // scan angle
    point.Le(row.line);
    point.Le(GpsSeconds(row.ping.time) - 1e9);
    point.Le(row.ping.number);
    point.Le(row.beam);
    point.Le(row.file);
    Write(point);
    ++count_;
  }

  void Finish() override {
    out_->seekp(0);
    WriteHead();
  }

 private:
  static constexpr double kScale = 0.001;
  static constexpr double kOffsetStepM = 10'000.0;
  static constexpr int kNoise = 7;
  static constexpr int kBathymetricPoint = 40;
  static constexpr std::uint16_t kHeaderBytes = 375;
  static constexpr std::uint16_t kPointBytes = 30 + 8;
  struct Extra {
    const char* name;
    std::uint8_t type;
  };
  static constexpr std::array<Extra, 3> kExtra{{{"ping", 5}, {"beam", 3}, {"file", 3}}};

  void Write(const ByteWriter& bytes) {
    out_->write(reinterpret_cast<const char*>(bytes.bytes().data()),
                static_cast<std::streamsize>(bytes.size()));
  }

  static void Text(const std::string& text, std::size_t size, ByteWriter* out) {
    const std::size_t n = std::min(text.size(), size);
    out->Append(AsBytes({text.data(), n}));
    out->Zeros(size - n);
  }

  static void RecordHead(const char* user, std::uint16_t id, std::size_t size, ByteWriter* out) {
    out->Le(std::uint16_t{0});
    Text(user, 16, out);
    out->Le(id);
    out->Le(static_cast<std::uint16_t>(size));
    out->Zeros(32);
  }

  ByteWriter Records() const {
    ByteWriter out;
    if (!wkt_.empty()) {
      RecordHead("LASF_Projection", 2112, wkt_.size() + 1, &out);
      Text(wkt_, wkt_.size() + 1, &out);
    }
    RecordHead("LASF_Spec", 4, 192 * kExtra.size(), &out);
    for (const Extra& extra : kExtra) {
      out.Zeros(2);
      out.Le(extra.type);
      out.Zeros(1);
      Text(extra.name, 32, &out);
      out.Zeros(4 + 5 * 24 + 32);
    }
    return out;
  }

  // Counts and extents are right when it is written again at the end.
  void WriteHead() {
    using namespace std::chrono;
    const ByteWriter records = Records();
    const auto days_since = floor<days>(day_.time_since_epoch());
    const year_month_day date{sys_days(days_since)};
    const auto of_year = sys_days(days_since) - sys_days(date.year() / 1 / 1);
    ByteWriter h;
    Text("LASF", 4, &h);
    h.Le(std::uint16_t{0});
    h.Le(std::uint16_t{1 | 16});  // adjusted GPS time, projection as text
    h.Zeros(16);
    h.Le(std::uint8_t{1});
    h.Le(std::uint8_t{4});
    Text("MERGE", 32, &h);
    Text("Seastitch", 32, &h);
    h.Le(static_cast<std::uint16_t>(of_year.count() + 1));
    h.Le(static_cast<std::uint16_t>(static_cast<int>(date.year())));
    h.Le(kHeaderBytes);
    h.Le(static_cast<std::uint32_t>(kHeaderBytes + records.size()));
    h.Le(std::uint32_t{wkt_.empty() ? 1u : 2u});
    h.Le(std::uint8_t{6});
    h.Le(kPointBytes);
    h.Zeros(4 + 5 * 4);  // counts of before 1.4
    for (int axis = 0; axis < 3; ++axis) h.Le(kScale);
    for (const double offset : offset_) h.Le(offset);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      h.Le(count_ == 0 ? 0.0 : box_.max()(axis));
      h.Le(count_ == 0 ? 0.0 : box_.min()(axis));
    }
    h.Zeros(8 + 8 + 4);
    h.Le(count_);
    h.Le(count_);
    h.Zeros(14 * 8);
    h.Append(records.bytes());
    Write(h);
  }

  const std::string wkt_;
  const Time day_;
  std::ofstream* const out_;
  std::uint64_t count_ = 0;
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d box_;
};

class XyzWriter : public SoundingWriter {
 public:
  XyzWriter(const std::optional<Datum>& datum, std::ofstream* out) : out_(out) {
    if (datum) map_.emplace(*datum);
    *out_ << (datum ? "# longitude latitude" : "# east_m north_m")
          << " depth_m time file line ping head beam used\n";
  }

  void Add(const Row& row) override {
    char place[80];
    if (map_) {
      const Datum point = map_->PointAt(row.p_ned.head<2>(), row.p_ned.z());
      std::snprintf(place,
                    sizeof place,
                    "%.9f %.9f %.3f",
                    point.longitude_deg,
                    point.latitude_deg,
                    row.p_ned.z());
    } else {
      std::snprintf(
          place, sizeof place, "%.3f %.3f %.3f", row.p_ned.y(), row.p_ned.x(), row.p_ned.z());
    }
    if (row.ping.time != time_ || text_.empty()) {
      time_ = row.ping.time;
      text_ = IsoTime(time_);
    }
    *out_ << place << ' ' << text_ << ' ' << row.file << ' ' << row.line << ' ' << row.ping.number
          << ' ' << int{row.ping.head} << ' ' << row.beam << ' ' << (row.used ? "1\n" : "0\n");
  }

  void Finish() override {}

 private:
  std::ofstream* const out_;
  std::optional<MapFrame> map_;
  Time time_;
  std::string text_;  // time_
};

}  // namespace

std::uint64_t WriteSoundings(const Survey& survey,
                             const SurveyPoses& poses,
                             const SoundingOutput& output,
                             SoundingLog* log,
                             const fs::path& path) {
  const fs::path partial = path.string() + ".partial";
  std::ofstream out(partial, std::ios::binary | std::ios::trunc);
  std::unique_ptr<SoundingWriter> writer;
  if (output.format == SoundingFormat::kLas)
    writer = std::make_unique<LasWriter>(output.projection, survey.End(), &out);
  else
    writer = std::make_unique<XyzWriter>(output.datum, &out);
  std::uint64_t count = 0;
  const MapAxes axes = output.projection.axes();
  ForEachPlaced(survey, poses, axes, log, [&](const PlacedSoundings& placed) {
    const std::vector<Eigen::Vector2d> north_east = output.projection.NorthEast(placed.p_ned);
    for (std::size_t k = 0; k < placed.p_ned.size(); ++k) {
      const SubmapSoundings::Sounding& s = placed.submap.soundings[k];
      writer->Add({placed.p_ned[k],
                   north_east[k],
                   placed.submap.pings[s.ping],
                   s.beam,
                   static_cast<std::uint16_t>(placed.inputs[s.ping] + 1),
                   placed.line,
                   s.used});
    }
    count += placed.p_ned.size();
  });
  writer->Finish();
  out.close();
  std::error_code error;
  if (out) fs::rename(partial, path, error);
  if (out && !error) return count;
  fs::remove(partial, error);
  throw std::runtime_error(path.string() + ": cannot be written: disk full?");
}

}  // namespace seastitch
