#pragma once

#include <optional>
#include <string>

#include "codecs/kongsberg/kmall_stream.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of a .kmall file: #MRZ (its position and heading, the raw ping, then the same ray traced
// by the sonar), #SKM (motion), #SPO (position), #SVP (profile), #SVT (sound speed at the
// transducer), #IIP (installation), #IOP (settings). The delays of sensors in #IIP are subtracted
// from the times of #SKM and #SPO, which are those of the sensor's data or of their arrival,
// uncorrected (Kongsberg 410224).
class KmallFileReader : public SurveyReader {
 public:
  // Counters of every reader and of KmallReassembler, and stamps_wrong (of sensors: more than
  // kMaxStampError from their datagram's), kmall_version_newer (#MRZ of a version
  // after kNewestMrz, decoded because all of its sizes fit), kmall_version_unknown (those whose
  // sizes do not) and kmall_ping_empty (pings without a valid sounding, which are left out).
  Counters counters() const override;

 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  void ReadPing(Bytes datagram, std::vector<SurveyRecord>* out);
  bool ReadPosition(const KmallHeader& header, Bytes datagram, std::vector<SurveyRecord>* out);
  // SensorTime() by the datagram's time; counts a wrong stamp.
  std::optional<Time> RightStamp(const KmallHeader& header, Time stamp);
  // Without the samples that have a wrong stamp.
  template <class Sample>
  std::optional<std::vector<Sample>> WithRightStamps(const KmallHeader& header,
                                                     std::optional<std::vector<Sample>> samples);
  // False: malformed.
  bool ReadSensor(const KmallHeader& header, Bytes datagram, std::vector<SurveyRecord>* out);

  // Delay of the sensor of this kind ("ATTI_", "POSI_") with these records; 0: none is stated.
  Duration DelayOf(const std::string& kind, const std::string& source) const;

  KmallReassembler reassembler_{PartCollectorParams{}};
  SonarInstallation installation_;  // the latest
};

}  // namespace seastitch
