#include "codecs/survey_reader.hpp"

#include <algorithm>

namespace seastitch {

std::vector<SurveyRecord> SurveyReader::Add(Bytes bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return ReadAll(false);
}

std::vector<SurveyRecord> SurveyReader::Finish() {
  std::vector<SurveyRecord> out = ReadAll(true);
  End(&out);
  return out;
}

std::vector<SurveyRecord> SurveyReader::ReadAll(bool at_end) {
  std::vector<SurveyRecord> out;
  Bytes left(buffer_);
  while (!left.empty()) {
    Look look = LookAt(left, at_end);
    if (look.kind == Look::Kind::kTooShortToTell || look.bytes > left.size()) {
      if (!at_end && look.bytes <= kMaxRecordBytes) break;
      look = Damage();
    }
    if (look.kind == Look::Kind::kRecord)
      Read(left.first(look.bytes), &out);
    else
      Count("damaged_bytes", static_cast<std::int64_t>(look.bytes));
    left = left.subspan(look.bytes);
  }
  buffer_.erase(buffer_.begin(), buffer_.end() - static_cast<std::ptrdiff_t>(left.size()));
  return out;
}

void SurveyReader::CountIgnored(const std::string& format, const std::string& type) {
  constexpr std::size_t kMaxNames = 256;
  const bool named =
      ignored_.contains(type) || (ignored_.size() < kMaxNames && ignored_.insert(type).second);
  Count(format + "_ignored_" + (named ? type : "others"));
}

}  // namespace seastitch
