#include "survey/read/survey_stream.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "codecs/kongsberg/em_all_file.hpp"
#include "codecs/kongsberg/kmall_file.hpp"
#include "codecs/makers/cereal_file.hpp"
#include "codecs/makers/gsf_file.hpp"
#include "codecs/makers/s7k_file.hpp"
#include "codecs/makers/xtf_file.hpp"
#include "codecs/navigation/text_navigation.hpp"
#include "common/runtime/config/config.hpp"
#include "products/geo/geographic_converter.hpp"
#include "survey/line/line_plan.hpp"
#include "survey/line/text_columns.hpp"
#include "survey/read/sbet_beside.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPieceBytes = 65'536;
// Limit of records in memory, for stamps that do not advance within the window.
constexpr std::size_t kMaxRecords = 50'000;

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

// Columns of navigation, with positions in a grid that the file describing them names.
TextNavigationFormat TextFormatOf(const fs::path& path) {
  TextNavigationFormat format = LoadTextColumns(path);
  if (!fs::exists(ColumnsFileOf(path))) return format;
  const std::string crs = LoadFileNotes(path).crs;
  if (crs.empty()) return format;
  try {
    format.from_grid = [grid = std::make_shared<GeographicConverter>(crs)](
                           const Eigen::Vector2d& north_east_m) -> std::optional<GeoPosition> {
      std::vector<Eigen::Vector2d> p{{north_east_m.y(), north_east_m.x()}};
      grid->Convert(&p);
      return p[0].allFinite() ? std::optional(GeoPosition{p[0].x(), p[0].y()}) : std::nullopt;
    };
  } catch (const std::runtime_error& e) {
    throw ConfigError(ColumnsFileOf(path).string() + ": crs: " + e.what());
  }
  return format;
}

// The reader for the name of a sonar's file.
std::unique_ptr<SurveyReader> ReaderByName(const std::string& extension) {
  if (extension == ".kmall") return std::make_unique<KmallFileReader>();
  if (extension == ".all") return std::make_unique<EmAllFileReader>();
  if (extension == ".s7k") return std::make_unique<S7kFileReader>();
  if (extension == ".gsf") return std::make_unique<GsfFileReader>();
  if (extension == ".xtf") return std::make_unique<XtfFileReader>();
  return nullptr;
}

// True for a file whose beginning is damaged, if a whole record of the format that its name states
// follows within a megabyte.
bool HoldsRecordOfItsName(const fs::path& path) {
  const auto reader = ReaderByName(LowerExtension(path));
  if (!reader) return false;
  std::vector<std::uint8_t> head(1 << 20);
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  return !reader->Add(Bytes(head.data(), static_cast<std::size_t>(in.gcount()))).empty();
}

}  // namespace

std::unique_ptr<SurveyReader> ReaderFor(const fs::path& path, const ReaderParams& params) {
  std::string bytes(32, '\0');
  std::ifstream in(path, std::ios::binary);
  if (fs::is_directory(path) || !in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return nullptr;
  if (IsSbet(path)) return std::make_unique<SbetFileReader>(params.sbet);
  if (IsLineFile(path)) return LineReader(path, std::make_unique<LinePlacer>(params.line));
  if (IsKmallTypeName(bytes.substr(4, 4))) return std::make_unique<KmallFileReader>();
  if (bytes.substr(8, 4) == "GSF-") return std::make_unique<GsfFileReader>();
  if (bytes.substr(4, 4) == std::string_view("\xFF\xFF\0\0", 4))
    return std::make_unique<S7kFileReader>();
  const std::string extension = LowerExtension(path);
  if (bytes[0] == '\x7B' && extension == ".xtf") return std::make_unique<XtfFileReader>();
  const bool stx = bytes[4] == '\x02' || bytes[0] == '\x02';
  if (stx && (extension == ".all" || bytes[5] == 'I')) return std::make_unique<EmAllFileReader>();
  if (extension == ".cereal") return std::make_unique<CerealFileReader>();
  if (extension == ".fnv")
    return std::make_unique<TextNavigationReader>(TextNavigationFormat::Fnv());
  if (extension == ".na0" || extension == ".na1")
    return std::make_unique<TextNavigationReader>(TextNavigationFormat::Na0());
  if (HasTextColumns(path)) return std::make_unique<TextNavigationReader>(TextFormatOf(path));
  return HoldsRecordOfItsName(path) ? ReaderByName(extension) : nullptr;
}

bool IsPing(const SurveyRecord& record) {
  return std::holds_alternative<MbesPing>(record) || std::holds_alternative<PlacedPing>(record);
}

Time TimeOf(const SurveyRecord& record) {
  return std::visit([](const auto& r) { return r.time; }, record);
}

SurveyStream::SurveyStream(const fs::path& path, double reorder_s, const ReaderParams& params)
    : path_(path), reorder_s_(reorder_s), in_(path, std::ios::binary), bytes_(fs::file_size(path)) {
  auto reader = ReaderFor(path, params);
  if (!reader || !in_) throw std::runtime_error(path.string() + ": no survey file that is known");
  reader_.emplace(std::move(reader), params.clock_offsets_s);
  Fill();
}

std::optional<Time> SurveyStream::next() const {
  if (records_.empty()) return std::nullopt;
  return records_.begin()->first;
}

// Place of a record in the order of time. Profiles have the time of their cast, but the sonar uses
// them from their place in the file on; the first one also before.
Time SurveyStream::PlaceOf(const SurveyRecord& record) {
  const Time own = TimeOf(record);
  if (!std::holds_alternative<SoundVelocityProfile>(record) || last_read_ == Time{}) return own;
  return std::exchange(has_profile_, true) ? last_read_ : std::min(own, last_read_);
}

SurveyRecord SurveyStream::Take() {
  auto node = records_.extract(records_.begin());
  Fill();
  const SurveyRecord& record = node.mapped();
  if (std::holds_alternative<NavigationRecord>(record) || IsPing(record)) {
    ++taken_;
    if (IsPing(record)) ++pings_;
    if (newest_taken_ && TimeOf(record) < *newest_taken_)
      ++taken_late_;
    else
      newest_taken_ = TimeOf(record);
  }
  return std::move(node.mapped());
}

bool SurveyStream::IsSettled() const {
  if (records_.empty()) return false;
  // The last stamp read, not the newest of all: a wrong one would remain the newest for ever.
  const double span_s = ToSeconds(last_read_ - records_.begin()->first);
  return span_s >= reorder_s_ || records_.size() >= kMaxRecords;
}

void SurveyStream::Fill() {
  std::vector<std::uint8_t> piece(kPieceBytes);
  while (!ended_ && !IsSettled()) {
    in_.read(reinterpret_cast<char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    const auto got = static_cast<std::size_t>(in_.gcount());
    if (in_.bad()) throw std::runtime_error(path_.string() + ": cannot be read to its end");
    bytes_read_ += got;
    ended_ = got == 0;
    for (SurveyRecord& record :
         ended_ ? reader_->Finish() : reader_->Add(Bytes(piece.data(), got))) {
      last_read_ = PlaceOf(record);
      records_.emplace(last_read_, std::move(record));
    }
  }
}

}  // namespace seastitch
