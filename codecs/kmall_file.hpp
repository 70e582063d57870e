#pragma once

#include <optional>
#include <string>

#include "codecs/kmall_stream.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// A .kmall file: pings (raw, then as the sonar placed them), #SKM, #SPO, #SVP, #SVT, #IIP, #IOP.
class KmallFileReader : public SurveyReader {
 public:
  // Besides those of every reader: those of KmallReassembler, kmall_version_unknown and
  // kmall_ping_empty (pings without a valid sounding, which are left out).
  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  void ReadPing(Bytes datagram, std::vector<SurveyRecord>* out);
  // False: refused.
  bool ReadSensor(const KmallHeader& header, Bytes datagram, std::vector<SurveyRecord>* out);

  KmallReassembler reassembler_{PartCollectorParams{}};
};

}  // namespace seastitch
