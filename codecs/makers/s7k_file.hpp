#pragma once

#include <cstddef>
#include <map>

#include "codecs/makers/s7k.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of a Teledyne .s7k file: records without network frames. 7000 with 7027 (pings), 1003
// (position), 1012 (roll, pitch, heave), 1013 (heading), 1015 (navigation), 1016 (attitude), 1009
// (sound-speed profile), 7030 (installation, one record for each head).
//
// In a file whose 7027 have no 7000 of their own (s7k_ping_without_settings) they are used with the
// sound speed of the last 7000 of any device; without one, with 0, which stands for that of the
// profile.
class S7kFileReader : public SurveyReader {
 public:
  // Counters of every reader and of S7kPings.
  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;
  void End(std::vector<SurveyRecord>* out) override;

 private:
  struct Arrays {
    InstalledArray transmitter, receiver;
  };
  void GiveUpOld(Time now, std::vector<SurveyRecord>* out);
  void ReadInstallation(const S7kRecord& record, std::vector<SurveyRecord>* out);
  // False: malformed.
  bool ReadSensor(const S7kRecord& record, std::vector<SurveyRecord>* out);

  std::map<std::size_t, Arrays> arrays_;  // by head
  S7kPings pings_{std::chrono::seconds(2)};
};

}  // namespace seastitch
