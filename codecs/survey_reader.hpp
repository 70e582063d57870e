#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "codecs/survey_records.hpp"
#include "common/core/bytes.hpp"
#include "common/core/health/counters.hpp"

namespace seastitch {

// Reader of a survey file from its bytes, in pieces of any size. The records do not depend on the
// pieces and come in the file's order, which need not be that of time. Memory: one record of the
// file (at most 16 MB) and the last piece. After a damaged record it searches for the next one byte
// by byte.
class SurveyReader {
 public:
  virtual ~SurveyReader() = default;

  std::vector<SurveyRecord> Add(Bytes bytes);
  // To be called at the end of the file: decodes the rest or counts it as damaged.
  std::vector<SurveyRecord> Finish();

  // damaged_bytes, FORMAT_malformed (records), mbes_beam_unusable, and FORMAT_ignored_TYPE for
  // types of records that are not read.
  virtual Counters counters() const { return counters_; }
  // Records that the file's head states and the file does not have. To be called after Finish().
  std::uint64_t missing() const { return missing_; }
  // Records that are left out because they are older than those before them.
  std::int64_t late() const { return late_; }
  // Why the first record that cannot be read cannot, for people, where the reader knows.
  const std::string& problem() const { return problem_; }

 protected:
  static constexpr std::size_t kMaxRecordBytes = 16 * 1024 * 1024;

  // A record, or damaged bytes, at the beginning of the bytes.
  struct Look {
    enum class Kind { kRecord, kTooShortToTell, kDamage };
    Kind kind;
    std::size_t bytes = 0;  // of the record or damage, 1 at least
  };
  static Look Record(std::size_t bytes) { return {Look::Kind::kRecord, bytes}; }
  static Look TooShort() { return {Look::Kind::kTooShortToTell}; }
  static Look Damage(std::size_t bytes = 1) { return {Look::Kind::kDamage, bytes}; }

  // The record or damage at the beginning of `bytes`. at_end: no bytes follow these.
  virtual Look LookAt(Bytes bytes, bool at_end) const = 0;
  virtual void Read(Bytes record, std::vector<SurveyRecord>* out) = 0;
  // After the last record.
  virtual void End(std::vector<SurveyRecord>* /*out*/) {}

  void Count(const std::string& name, std::int64_t n = 1) { counters_[name] += n; }
  std::uint64_t missing_ = 0;
  std::int64_t late_ = 0;
  std::string problem_;

  // Counts a type of record that is not read. At most 256 types are counted by name.
  void CountIgnored(const std::string& format, const std::string& type);

 private:
  std::vector<SurveyRecord> ReadAll(bool at_end);

  std::vector<std::uint8_t> buffer_;
  Counters counters_;
  std::set<std::string> ignored_;
};

// Appends a decoded record to the output. False: it is absent.
template <class T>
bool AppendRecords(std::optional<T> decoded, std::vector<SurveyRecord>* out) {
  if (decoded) out->emplace_back(std::move(*decoded));
  return decoded.has_value();
}
template <class T>
bool AppendRecords(std::optional<std::vector<T>> decoded, std::vector<SurveyRecord>* out) {
  if (!decoded) return false;
  for (T& one : *decoded) out->emplace_back(std::move(one));
  return true;
}

}  // namespace seastitch
