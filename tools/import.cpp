#include "tools/import.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "codecs/kongsberg/kmall.hpp"
#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/config/vehicle_config.hpp"
#include "common/runtime/files/durable_file.hpp"
#include "common/runtime/files/unfinished_files.hpp"
#include "common/runtime/process/process.hpp"
#include "common/storage/event_log.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/socket/candump.hpp"
#include "products/report/counter_words.hpp"
#include "survey/plan/maker_soundings.hpp"
#include "survey/plan/profiles_beside.hpp"
#include "survey/plan/survey_config.hpp"
#include "survey/plan/survey_files.hpp"
#include "survey/plan/survey_groups.hpp"
#include "survey/progress.hpp"
#include "survey/read/message_types.hpp"
#include "tools/install_paths.hpp"

namespace seastitch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxKmallDatagram = 16 * 1024 * 1024;
// Frames within this time form one RAW_CAN message, as when a driver reads them from a socket.
constexpr Duration kBurst = std::chrono::milliseconds(1);

// A file to import, read piece by piece in the order of its recording.
class Source {
 public:
  virtual ~Source() = default;
  // Stamp of the next piece; nothing at the end.
  virtual std::optional<Time> next() const = 0;
  // Passes the next piece to its drivers.
  virtual void Feed() = 0;
  virtual std::uint64_t bytes_read() const = 0;
  virtual Counters counters() const = 0;
};

class KmallFile : public Source {
 public:
  // number: distinguishes it from other files.
  KmallFile(const fs::path& path, std::uint64_t number, MbesDriver* driver)
      : driver_(driver), number_(number), in_(path, std::ios::binary), size_(fs::file_size(path)) {
    ReadNext();
  }

  std::optional<Time> next() const override { return next_; }
  void Feed() override {
    driver_->Feed(Datagram{datagram_, *next_, number_});
    ReadNext();
  }
  std::uint64_t bytes_read() const override { return at_; }
  Counters counters() const override {
    return damaged_bytes_ == 0 ? Counters{}
                               : Counters{{"kmall_file_damaged_bytes", damaged_bytes_}};
  }

 private:
  // Bytes that are not a datagram are skipped one by one.
  void ReadNext() {
    next_.reset();
    for (; at_ + 8 <= size_ && !ReadAt(); ++at_) ++damaged_bytes_;
    if (!next_) damaged_bytes_ += static_cast<std::int64_t>(size_ - at_);
    if (!next_) at_ = size_;
  }
  bool ReadAt() {
    std::array<std::uint8_t, 8> head{};
    Read(head.data(), head.size());
    const std::size_t size = ByteReader(head).Le<std::uint32_t>();
    if (head[4] != '#' || size < head.size() || size > std::min(kMaxKmallDatagram, size_ - at_))
      return false;
    datagram_.resize(size);
    Read(datagram_.data(), size);
    const std::optional<KmallHeader> header = ReadKmallHeader(datagram_);
    if (!header) return false;
    next_ = header->time();
    at_ += size;
    return true;
  }
  void Read(std::uint8_t* to, std::size_t size) {
    in_.seekg(static_cast<std::streamoff>(at_));
    in_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(size));
  }

  MbesDriver* driver_;
  std::uint64_t number_;
  std::ifstream in_;
  std::uint64_t size_;
  std::uint64_t at_ = 0;  // end of the next datagram
  std::int64_t damaged_bytes_ = 0;
  std::vector<std::uint8_t> datagram_;
  std::optional<Time> next_;
};

class CandumpFile : public Source {
 public:
  CandumpFile(const fs::path& path, std::vector<CanDriver*> drivers)
      : drivers_(std::move(drivers)), in_(path) {
    ReadNext();
  }

  std::optional<Time> next() const override {
    return frame_ ? std::optional(frame_->recv) : std::nullopt;
  }
  void Feed() override {
    std::vector<ReceivedFrame> burst;
    const Time begin = frame_->recv;
    for (; frame_ && std::chrono::abs(frame_->recv - begin) <= kBurst; ReadNext())
      burst.push_back(*frame_);
    for (CanDriver* const driver : drivers_) {
      const std::vector<CanFilter> filters = driver->filters();
      std::vector<ReceivedFrame> wanted;
      std::copy_if(burst.begin(), burst.end(), std::back_inserter(wanted), [&](const auto& r) {
        return Passes(filters, r.frame);
      });
      if (!wanted.empty()) driver->Feed(wanted);
    }
  }
  std::uint64_t bytes_read() const override { return bytes_; }
  Counters counters() const override {
    return malformed_ == 0 ? Counters{} : Counters{{"candump_malformed", malformed_}};
  }

 private:
  void ReadNext() {
    frame_.reset();
    for (std::string line; !frame_ && std::getline(in_, line);) {
      bytes_ += line.size() + 1;
      if (const std::optional<CandumpLine> parsed = ParseCandumpLine(line))
        frame_ = ReceivedFrame{parsed->frame, parsed->time};
      else if (line.starts_with('('))
        ++malformed_;
    }
  }

  std::vector<CanDriver*> drivers_;
  std::ifstream in_;
  std::uint64_t bytes_ = 0;
  std::int64_t malformed_ = 0;
  std::optional<ReceivedFrame> frame_;
};

enum class Kind { kKmall, kCandump };

Kind KindOf(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<char, 64> head{};
  if (fs::is_directory(path) || !in.read(head.data(), head.size()).gcount())
    throw std::runtime_error(path.string() + ": not a file that can be read");
  if (head[4] == '#') return Kind::kKmall;
  if (std::string_view(head.data(), head.size()).find_first_of('(') == 0) return Kind::kCandump;
  const std::string_view text(head.data(), head.size());
  const std::size_t length = text.find("  [");  // "  can0  110   [8]  00 00 ..."
  if (text.starts_with(' ') && length != std::string_view::npos && text.find("]  ", length) < 64)
    throw DataError(path.string() + ": a candump log without times; record it with candump -l");
  if (SurveyFiles::IsSurveyFile(path))
    throw UsageError("import: " + path.string() +
                     ": its format is not imported together with candump logs");
  throw DataError(path.string() + ": neither a survey file nor a candump log");
}

bool IsKmall(const std::vector<fs::path>& files) {
  return std::all_of(
      files.begin(), files.end(), [](const fs::path& f) { return KindOf(f) == Kind::kKmall; });
}

// Writes the imported messages to a log. It begins with the configuration to map it with.
class ImportLog {
 public:
  // configuration: of the mapper; empty if unknown.
  ImportLog(const fs::path& path, const std::vector<NamedText>& configuration, ImportResult* result)
      : log_(path, IfExists::kRefuse),
        configuration_(ConfigParts("mapper", configuration)),
        result_(result) {}

  void Write(Time now, const std::string& channel, const void* data, std::size_t size) {
    for (config_t& part : std::exchange(configuration_, {})) {
      part.utime = ToUtime(now);
      part.version = ProgramVersion();
      log_.Write(ToUtime(now), channels::kConfig, part);
      ++result_->channels[channels::kConfig];
    }
    log_.Write(ToUtime(now), channel, data, size);
    ++result_->channels[channel];
  }
  void Flush() { log_.Flush(); }

 private:
  EventLogWriter log_;
  std::vector<config_t> configuration_;  // to be written before the first event
  ImportResult* result_;
};

std::vector<NamedText> FilesOf(const fs::path& mapper_config) {
  if (mapper_config.empty()) return {};
  return ConfigFiles(LoadMapperConfig(mapper_config.string()));
}

// The drivers that the files need, and what they publish.
class Importer {
 public:
  explicit Importer(const ImportOptions& options)
      : log_(options.log, FilesOf(options.mapper_config), &result_) {
    for (const fs::path& file : options.files) {
      total_bytes_ += fs::file_size(file);
      if (KindOf(file) == Kind::kKmall)
        sources_.push_back(std::make_unique<KmallFile>(file, sources_.size(), Sonar()));
      else
        sources_.push_back(std::make_unique<CandumpFile>(file, CanDrivers(options)));
    }
    ExpectTimesThatMeet(options.files);
  }

  ImportResult Run(bool quiet) {
    ProgressLine progress("importing", total_bytes_, quiet);
    while (Source* const source = Earliest()) {
      now_ = std::max(now_, *source->next());  // stamps in a log never decrease
      source->Feed();
      std::uint64_t done = 0;
      for (const auto& s : sources_) done += s->bytes_read();
      progress.Set(done);
    }
    for (const auto& driver : can_drivers_) driver->Finish();
    log_.Flush();
    progress.Finish();
    for (const auto& source : sources_) Count(source->counters());
    for (const auto& driver : can_drivers_) Count(driver->decoder_counters());
    if (sonar_) Count(sonar_->decoder_counters());
    return result_;
  }

 private:
  // A candump log whose times count from its own start says nothing of when it was recorded.
  void ExpectTimesThatMeet(const std::vector<fs::path>& files) const {
    constexpr double kMostApartS = 30.0 * 86'400.0;
    std::vector<std::pair<Time, std::string>> starts;
    for (std::size_t i = 0; i < files.size(); ++i)
      if (const auto start = sources_[i]->next()) starts.emplace_back(*start, files[i].filename());
    std::sort(starts.begin(), starts.end());
    for (std::size_t i = 1; i < starts.size(); ++i) {
      const auto& [before, first] = starts[i - 1];
      const auto& [after, second] = starts[i];
      if (ToSeconds(after - before) > kMostApartS)
        throw DataError(
            first + " begins at " + UtcText(before) + ", " + second + " at " + UtcText(after) +
            ": these times do not meet. Record with candump -l, whose log has the date");
    }
  }

  void Count(const Counters& counters) {
    for (const auto& [name, value] : counters)
      if (value != 0) result_.counters[name] += value;
  }

  Source* Earliest() {
    Source* earliest = nullptr;
    for (const auto& source : sources_)
      if (source->next() && (earliest == nullptr || *source->next() < *earliest->next()))
        earliest = source.get();
    return earliest;
  }

  MbesDriver* Sonar() {
    if (!sonar_) {
      MbesDriverConfig config;  // KMALL, with its own stamps: a file has no receive stamps
      config.driver.source = "import";
      sonar_ = std::make_unique<MbesDriver>(config, &from_sonar_);
    }
    return sonar_.get();
  }

  std::vector<CanDriver*> CanDrivers(const ImportOptions& options) {
    if (can_drivers_.empty()) {
      can_drivers_.push_back(std::make_unique<ImuDriver>(
          LoadImuDriverConfig(options.imu_config.string()), &from_imu_));
      can_drivers_.push_back(std::make_unique<DvlDriver>(
          LoadDvlDriverConfig(options.dvl_config.string()), &from_dvl_));
    }
    std::vector<CanDriver*> drivers;
    for (const auto& driver : can_drivers_) drivers.push_back(driver.get());
    return drivers;
  }

  ImportResult result_;
  ImportLog log_;
  Time now_;
  const MessageOutput::Write write_ =
      [this](const std::string& channel, const void* data, std::size_t size) {
        log_.Write(now_, channel, data, size);
      };
  // One each, as every driver process numbers its own messages.
  MessageOutput from_imu_{write_}, from_dvl_{write_}, from_sonar_{write_};
  std::unique_ptr<MbesDriver> sonar_;
  std::vector<std::unique_ptr<CanDriver>> can_drivers_;
  std::vector<std::unique_ptr<Source>> sources_;
  std::uint64_t total_bytes_ = 0;
};

// A mapper.yaml that uses the navigation in the files, with their installation parameters.
MapperConfig ConfigFor(const SurveyPlan& plan) {
  MapperConfig config = LoadMapperConfig((ConfigDir() / "mapper.yaml").string());
  UseSurvey(plan, false, &config);
  return config;
}

// Writes the configuration beside the log, for people to edit.
void WriteConfigs(const SurveyPlan& plan, const fs::path& log) {
  const SurveyConfigFiles files = SurveyConfigFilesFor(log);
  WriteAtomically(files.vehicle, PrintConfig(plan.vehicle));
  MapperConfig config = ConfigFor(plan);
  config.vehicle_file = files.vehicle.filename();
  WriteAtomically(files.mapper, PrintConfig(config));
}

// Imports survey files that contain navigation.
ImportResult ImportSurvey(SurveyFiles* survey, const ImportOptions& options) {
  ImportResult result;
  ImportLog log(options.log, ConfigFiles(ConfigFor(survey->plan())), &result);
  MessageOutput output([&](const std::string& channel, const void* data, std::size_t size) {
    log.Write(survey->now(), channel, data, size);
  });
  ProgressLine progress("importing", survey->bytes(), options.quiet);
  while (std::optional<Received> received = survey->Next()) {
    output.Put(std::move(received->sample), received->stamp.recv);
    progress.Set(survey->bytes_read());
  }
  log.Flush();
  progress.Finish();
  for (const auto& [name, value] : survey->counters())
    if (value != 0) result.counters[name] = value;
  return result;
}

bool AreSurveyFiles(const std::vector<fs::path>& files) {
  return std::all_of(files.begin(), files.end(), SurveyFiles::IsSurveyFile);
}

}  // namespace

// Candump logs, and KMALL files without navigation, go through the drivers, as at sea. Other survey
// files are imported by ImportSurvey().
ImportResult Import(const ImportOptions& options) {
  if (fs::exists(options.log))
    throw UsageError(options.log.string() + ": exists already; name another log, or delete it");
  const SurveyConfigFiles configs = SurveyConfigFilesFor(options.log);
  UnfinishedFiles unfinished({options.log, configs.vehicle, configs.mapper});
  if (AreSurveyFiles(options.files)) {
    SurveyFiles survey(PlanSurvey(options.files, false, {options.profile, options.profiles}));
    const bool sonar_alone = survey.plan().soundings && survey.plan().position_source.empty() &&
                             survey.plan().attitude_source.empty() && IsKmall(options.files);
    if (!sonar_alone) {
      if (const auto problem = survey.plan().Problem()) throw DataError(*problem);
      ImportResult result = ImportSurvey(&survey, options);
      result.installation = survey.plan().Text();
      result.warnings = survey.warnings();
      if (const auto outcome = survey.Outcome()) throw DataError(*outcome);
      WriteConfigs(survey.plan(), options.log);
      unfinished.Keep();
      return result;
    }
  }
  if (!options.profile.empty() || !options.profiles.empty())
    throw UsageError(
        "import: a sound speed profile is for survey files with navigation; a log of a sonar alone "
        "takes sound_velocity_profile of mapper.yaml");
  for (const fs::path& file : options.files) KindOf(file);  // throws before a log is made
  ImportResult result = Importer(options).Run(options.quiet);
  if (std::none_of(result.channels.begin(), result.channels.end(), [](const auto& channel) {
        return channel.first != channels::kConfig;
      }))
    throw DataError(options.files[0].string() +
                    ": nothing in it that can be read; a line of candump -l is "
                    "(1700000000.250000) can0 123#11223344");
  unfinished.Keep();
  return result;
}

namespace {

// For b.lcmlog and 2: b-2.lcmlog.
fs::path LogOf(const fs::path& log, std::size_t dive) {
  if (dive == 1) return log;
  return log.parent_path() /
         (log.stem().string() + "-" + std::to_string(dive) + log.extension().string());
}

void ImportDive(const ImportOptions& options) {
  const ImportResult result = Import(options);
  for (const MapWarning& warning : result.warnings)
    std::fprintf(stderr, "warning: %s\n", warning.text.c_str());
  if (!result.installation.empty()) std::fputs(result.installation.c_str(), stdout);
  for (const auto& [channel, events] : result.channels)
    std::printf("%-12s %10lld events\n", channel.c_str(), static_cast<long long>(events));
  for (const auto& [name, value] : result.counters)
    std::printf("%s: %lld\n", CounterInWords(name).c_str(), static_cast<long long>(value));
  if (!result.installation.empty())
    std::printf("to map it: seastitch replay %s --out MAP (if you edit %s, add --config with it)\n",
                options.log.c_str(),
                SurveyConfigFilesFor(options.log).mapper.c_str());
}

}  // namespace

int RunImport(ImportOptions options) {
  const auto files =
      std::stable_partition(options.files.begin(), options.files.end(), std::not_fn(IsProfileFile));
  options.profiles.assign(files, options.files.end());
  options.files.erase(files, options.files.end());
  if (options.files.empty())
    throw UsageError("import: sound speed profiles beside survey files, but no survey file");
  std::vector<SurveyGroup> dives{{options.files}};
  if (AreSurveyFiles(options.files)) dives = GroupSurveyFiles(options.files, options.one_dive);
  for (std::size_t i = 0; i < dives.size(); ++i) {
    ImportOptions of_dive = options;
    of_dive.files = dives[i].files;
    of_dive.log = LogOf(options.log, i + 1);
    if (dives.size() > 1)
      std::printf("%s: %s of %s%s%s\n",
                  of_dive.log.c_str(),
                  NumberOfFiles(of_dive.files.size()).c_str(),
                  dives[i].sonar.empty() ? "a sonar" : dives[i].sonar.c_str(),
                  dives[i].reason.empty() ? "" : "; ",
                  dives[i].reason.c_str());
    ImportDive(of_dive);
  }
  return EXIT_SUCCESS;
}

}  // namespace seastitch
