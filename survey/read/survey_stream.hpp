#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "codecs/navigation/sbet_file.hpp"
#include "codecs/survey_reader.hpp"
#include "survey/line/line_placer.hpp"
#include "survey/read/checked_reader.hpp"

namespace seastitch {

// What a reader needs and its file does not state.
struct ReaderParams {
  SbetParams sbet{};  // of an SBET
  LineParams line{};  // of soundings by line
  // Of navigation whose clock is off, by source: taken off its stamps.
  std::map<std::string, double> clock_offsets_s{};
};

// The reader for a file, by its content or its name. Nothing: not a supported format.
std::unique_ptr<SurveyReader> ReaderFor(const std::filesystem::path& path,
                                        const ReaderParams& params = {});

// Time of any record.
Time TimeOf(const SurveyRecord& record);

// Records of one file, sorted by time within a window of some seconds. Memory: the window and one
// piece of the file.
class SurveyStream {
 public:
  // Throws std::runtime_error naming the file.
  SurveyStream(const std::filesystem::path& path,
               double reorder_s,
               const ReaderParams& params = {});

  // Time of the next record; nothing at the end.
  std::optional<Time> next() const;
  SurveyRecord Take();

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t bytes_read() const { return bytes_read_; }
  Counters counters() const { return reader_->counters(); }

 private:
  Time PlaceOf(const SurveyRecord& record);
  void Fill();
  bool IsSettled() const;

  std::filesystem::path path_;
  double reorder_s_;
  std::optional<CheckedReader> reader_;
  std::ifstream in_;
  std::uint64_t bytes_;
  std::uint64_t bytes_read_ = 0;
  bool ended_ = false;
  Time last_read_;
  bool has_profile_ = false;
  std::multimap<Time, SurveyRecord> records_;
};

}  // namespace seastitch
