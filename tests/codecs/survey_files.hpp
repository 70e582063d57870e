#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "codecs/survey_reader.hpp"

// What the tests and the fuzzers of file readers share.
namespace seastitch {

using ByteVector = std::vector<std::uint8_t>;
using MakeReader = std::function<std::unique_ptr<SurveyReader>()>;

struct SurveyContents {
  std::vector<SurveyRecord> records;
  Counters counters;

  template <class T>
  std::vector<T> All() const {
    std::vector<T> found;
    for (const SurveyRecord& record : records)
      if (const T* one = std::get_if<T>(&record)) found.push_back(*one);
    return found;
  }
};

// The file in pieces of that many bytes.
SurveyContents ReadSurvey(Bytes file, SurveyReader* reader, std::size_t piece_bytes = 65'536);
template <class Reader>
SurveyContents ReadSurvey(Bytes file) {
  Reader reader;
  return ReadSurvey(file, &reader);
}

// A line for each record, with all of its numbers, and one for each counter.
std::string TextOf(const SurveyContents& contents);
// What is wrong with a record that a reader gave; empty: nothing. Numbers must be finite, beams
// plausible, profiles rising.
std::string ProblemWith(const SurveyRecord& record);

// Properties of any reader, from a file that it reads: any pieces give the same records; any
// changed bytes, any cut and any hole give sane records; cut off anywhere it ends.
void ExpectRobust(Bytes file, const MakeReader& make);

}  // namespace seastitch
