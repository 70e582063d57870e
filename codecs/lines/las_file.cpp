#include "codecs/lines/las_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "codecs/calendar.hpp"
#include "codecs/text.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kShortestHead = 227;  // of LAS 1.0 to 1.2
constexpr std::size_t kHead14 = 375;
constexpr std::size_t kRecordHead = 54;  // of a variable length record
constexpr std::array<std::size_t, 11> kPointBytes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr double kMostCoordinate = 1e10;

// Keys of GeoTIFF that name a reference system or a unit.
enum : std::uint16_t { kGeographic = 2048, kProjected = 3072, kVerticalUnit = 4099 };
constexpr std::uint16_t kUserDefined = 32767;

void ReadGeoKeys(Bytes body, LasHead* head) {
  ByteReader in(body);
  in.Skip(6);
  const auto count = in.Le<std::uint16_t>();
  std::uint16_t geographic = 0, projected = 0;
  for (int i = 0; i < count && in.left() >= 8; ++i) {
    const auto key = in.Le<std::uint16_t>();
    const bool in_place = in.Le<std::uint16_t>() == 0;
    in.Skip(2);
    const auto value = in.Le<std::uint16_t>();
    if (!in_place || value == kUserDefined) continue;
    if (key == kGeographic) geographic = value;
    if (key == kProjected) projected = value;
    if (key == kVerticalUnit && value == 9001) head->z_unit_m = 1.0;
    if (key == kVerticalUnit && value == 9002) head->z_unit_m = 0.3048;
    if (key == kVerticalUnit && value == 9003) head->z_unit_m = 1200.0 / 3937.0;
  }
  const std::uint16_t code = projected != 0 ? projected : geographic;
  if (code != 0 && head->crs.empty()) head->crs = "EPSG:" + std::to_string(code);
}

void ReadRecords(Bytes records, std::uint32_t count, LasHead* head) {
  ByteReader in(records);
  for (std::uint32_t i = 0; i < count && in.ok() && in.left() >= kRecordHead; ++i) {
    in.Skip(2);
    const std::string user = TextFromBytes(in.Take(16));
    const auto id = in.Le<std::uint16_t>();
    const auto bytes = in.Le<std::uint16_t>();
    in.Skip(32);
    const Bytes body = in.Take(bytes);
    if (user != "LASF_Projection") continue;
    if (id == 2112) head->crs = TextFromBytes(body);
    if (id == 34735) ReadGeoKeys(body, head);
  }
}

bool IsUsable(const LasHead& head) {
  return head.format < kPointBytes.size() && head.point_bytes >= kPointBytes[head.format] &&
         head.scale.allFinite() && head.offset.allFinite() && (head.scale.array() > 0.0).all();
}

}  // namespace

bool LasHead::has_time() const { return format != 0 && format != 2; }

std::optional<std::size_t> LasHeadBytes(Bytes bytes) {
  constexpr std::string_view kMark = "LASF";
  if (bytes.size() < 100 || !std::equal(kMark.begin(), kMark.end(), bytes.begin()))
    return std::nullopt;
  const std::size_t head = ByteReader(bytes.subspan(94)).Le<std::uint16_t>();
  const std::size_t all = ByteReader(bytes.subspan(96)).Le<std::uint32_t>();
  if (head < kShortestHead || all < head) return std::nullopt;
  return all;
}

std::optional<LasHead> ReadLasHead(Bytes bytes) {
  const std::optional<std::size_t> head_bytes = LasHeadBytes(bytes);
  if (!head_bytes || *head_bytes > bytes.size()) return std::nullopt;
  LasHead head;
  head.head_bytes = *head_bytes;
  ByteReader in(bytes);
  in.Skip(6);
  head.adjusted_time = (in.Le<std::uint16_t>() & 1) != 0;
  in.Skip(16);
  const auto major = in.Le<std::uint8_t>();
  const auto minor = in.Le<std::uint8_t>();
  in.Skip(94 - 26);
  const std::size_t own_bytes = in.Le<std::uint16_t>();
  in.Skip(4);
  const auto records = in.Le<std::uint32_t>();
  const auto format = in.Le<std::uint8_t>();
  head.compressed = (format & 0xC0) != 0;
  head.format = format & 0x3F;
  head.point_bytes = in.Le<std::uint16_t>();
  head.points = in.Le<std::uint32_t>();
  in.Skip(5 * 4);
  for (double& scale : head.scale) scale = in.Le<double>();
  for (double& offset : head.offset) offset = in.Le<double>();
  if (minor >= 4 && own_bytes >= kHead14)
    if (const auto points = ByteReader(bytes.subspan(247)).Le<std::uint64_t>(); points != 0)
      head.points = points;
  if (major != 1 || minor > 4 || !IsUsable(head)) return std::nullopt;
  ReadRecords(bytes.subspan(own_bytes, *head_bytes - own_bytes), records, &head);
  return head;
}

Counters LasFileReader::counters() const {
  Counters all = SurveyReader::counters();
  for (const auto& [name, value] : points_->counters()) all[name] += value;
  return all;
}

SurveyReader::Look LasFileReader::LookAt(Bytes bytes, bool at_end) const {
  if (at_start_) {
    if (bytes.size() < 100 && !at_end) return TooShort();
    const std::optional<std::size_t> head_bytes = LasHeadBytes(bytes);
    return head_bytes ? Record(*head_bytes) : Damage();
  }
  // After the points: wave packets and extended records, which are not read.
  return Record(IsInPoints() ? head_->point_bytes : bytes.size());
}

void LasFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  if (IsInPoints()) return ReadPoint(record, out);
  if (!std::exchange(at_start_, false)) return;
  head_ = ReadLasHead(record);
  if (head_ && head_->compressed) head_.reset();
  if (!head_) Count("las_malformed");
}

void LasFileReader::ReadPoint(Bytes record, std::vector<SurveyRecord>* out) {
  ++read_;
  ByteReader in(record);
  Eigen::Vector3d raw;
  for (double& coordinate : raw) coordinate = in.Le<std::int32_t>();
  in.Skip(2);
  const bool is_new = head_->format >= 6;
  in.Skip(1);
  auto flags = in.Le<std::uint8_t>();
  int kind = flags & 0x1F;
  bool withheld = (flags & 0x80) != 0;
  if (is_new) {
    withheld = (flags & 4) != 0;
    kind = in.Le<std::uint8_t>();
    in.Skip(3);
  } else {
    in.Skip(2);
  }
  LinePoint point;
  point.line = in.Le<std::uint16_t>();
  const double time_s = head_->has_time() ? in.Le<double>() : 0.0;
  if (withheld) return Count("las_points_withheld");
  if (kind == 7 || kind == 18) return Count("las_points_noise");
  point.p = raw.cwiseProduct(head_->scale) + head_->offset;
  if (!(point.p.cwiseAbs().maxCoeff() < kMostCoordinate) || !(std::abs(time_s) < kMostCoordinate))
    return Count("las_malformed");
  if (time_s != 0.0) point.time_s = time_s;
  // Longer times are none of the week: a writer has forgotten the bit.
  if (time_s != 0.0 && !head_->adjusted_time && std::abs(time_s) <= 2.0 * kGpsWeekS) {
    if (!first_s_) first_s_ = time_s;
    point.time_s = WeekSecondsNear(time_s, *first_s_);
  }
  points_->Add(point, out);
}

void LasFileReader::End(std::vector<SurveyRecord>* out) {
  if (head_ && read_ < head_->points) missing_ = head_->points - read_;
  points_->Finish(out);
}

}  // namespace seastitch
