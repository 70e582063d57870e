#pragma once

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <vector>

#include "tests/codecs/survey_files.hpp"

namespace seastitch {

using RecordSeal = std::function<void(ByteVector* record)>;

inline void PutLe(ByteVector* bytes, std::size_t at, std::size_t value, std::size_t size = 4) {
  for (std::size_t i = 0; i < size; ++i)
    (*bytes)[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

// A file of records, each behind a length of two bytes, through two readers: in pieces whose size
// the first byte gives, and whole. `seal` makes right what a fuzzer would hardly guess: marks,
// sizes, sums. What is read must be sane and the same.
inline void FuzzSurveyFile(Bytes input, const MakeReader& make, const RecordSeal& seal) {
  ByteReader in(input);
  const std::size_t piece_bytes = 1 + in.Le<std::uint8_t>();
  ByteVector file;
  for (int i = 0; i < 64 && in.left() >= 2; ++i) {
    const Bytes bytes = in.Take(std::min<std::size_t>(in.Le<std::uint16_t>(), in.left()));
    ByteVector record(bytes.begin(), bytes.end());
    seal(&record);
    file.insert(file.end(), record.begin(), record.end());
  }
  const auto whole = make();
  const auto pieces = make();
  const SurveyContents contents = ReadSurvey(file, whole.get());
  for (const SurveyRecord& record : contents.records)
    if (!ProblemWith(record).empty()) std::abort();
  if (TextOf(contents) != TextOf(ReadSurvey(file, pieces.get(), piece_bytes))) std::abort();
}

}  // namespace seastitch
