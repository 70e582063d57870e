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

// A ping, raw or placed.
bool IsPing(const SurveyRecord& record);
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
  std::uint64_t missing() const { return reader_->missing(); }  // at the end
  // Pings and navigation that came too late to be sorted, at the end.
  std::int64_t late() const { return taken_late_ + reader_->late(); }
  bool is_out_of_order() const { return 100 * late() > taken_; }
  // Pings given so far, and those that were left out by their stamps.
  std::int64_t pings() const { return pings_; }
  std::int64_t pings_left_out() const { return reader_->pings_left_out(); }

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
  std::optional<Time> newest_taken_;  // of pings and navigation, as the next two
  std::int64_t taken_ = 0;
  std::int64_t pings_ = 0;
  std::int64_t taken_late_ = 0;  // after a newer one
  std::multimap<Time, SurveyRecord> records_;
};

}  // namespace seastitch
