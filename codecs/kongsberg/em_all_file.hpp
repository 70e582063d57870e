#pragma once

#include <cstdint>
#include <optional>

#include "codecs/kongsberg/em_all.hpp"
#include "codecs/survey_reader.hpp"

namespace seastitch {

// Reader of a Kongsberg .all file: N (raw pings), X (the same, ray traced by the sonar), D (the
// same of older sonars, whose raw datagrams are not read), A and n (attitude), P (position), U
// (sound-speed profile), G (sound speed at the transducer), I (installation).
class EmAllFileReader : public SurveyReader {
 protected:
  Look LookAt(Bytes bytes, bool at_end) const override;
  void Read(Bytes record, std::vector<SurveyRecord>* out) override;

 private:
  // False: malformed.
  bool ReadDatagram(const EmDatagram& datagram, std::vector<SurveyRecord>* out);
  std::uint8_t HeadOf(const EmDatagram& datagram);

  SonarInstallation installation_;
  std::optional<std::uint16_t> first_serial_;  // of the system, or of the first receiver
};

}  // namespace seastitch
