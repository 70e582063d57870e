#include "codecs/kongsberg/em_all_file.hpp"

#include <cctype>
#include <string>
#include <utility>

namespace seastitch {
namespace {

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kLeastBytes = 19;
constexpr std::size_t kMostBytes = 1024 * 1024;
constexpr std::uint8_t kStx = 2;

std::string NameOf(char type) {
  const auto letter = static_cast<unsigned char>(type);
  return std::isalnum(letter) != 0 ? std::string(1, type) : std::to_string(letter);
}

}  // namespace

SurveyReader::Look EmAllFileReader::LookAt(Bytes bytes, bool at_end) const {
  if (bytes.size() <= kLengthBytes) return TooShort();
  if (bytes[kLengthBytes] != kStx) return Damage();
  ByteReader little(bytes);
  ByteReader big(bytes);
  for (const std::size_t length :
       {std::size_t{little.Le<std::uint32_t>()}, std::size_t{big.Be<std::uint32_t>()}}) {
    if (length < kLeastBytes || length > kMostBytes) continue;
    const std::size_t size = kLengthBytes + length;
    if (bytes.size() < size) {
      if (at_end) continue;
      return Record(size);
    }
    if (ReadEmDatagram(bytes.first(size))) return Record(size);
  }
  return Damage();
}

void EmAllFileReader::Read(Bytes record, std::vector<SurveyRecord>* out) {
  const EmDatagram datagram = *ReadEmDatagram(record);
  if (!ReadDatagram(datagram, out)) Count("all_malformed");
}

bool EmAllFileReader::ReadDatagram(const EmDatagram& datagram, std::vector<SurveyRecord>* out) {
  switch (datagram.type) {
    case 'N': {
      int unusable = 0;
      const bool read = AppendRecords(DecodeEmN(datagram, HeadOf(datagram), &unusable), out);
      if (unusable > 0) Count("mbes_beam_unusable", unusable);
      return read;
    }
    case 'X':
      AppendRecords(DecodeEmPingHeading(datagram), out);
      return AppendRecords(DecodeEmX(datagram, HeadOf(datagram), installation_), out);
    case 'D':
      AppendRecords(DecodeEmPingHeading(datagram), out);
      return AppendRecords(DecodeEmD(datagram, HeadOf(datagram), installation_), out);
    case 'A': return AppendRecords(DecodeEmA(datagram), out);
    case 'n': return AppendRecords(DecodeEmNetworkAttitude(datagram), out);
    case 'P': return AppendRecords(DecodeEmP(datagram, installation_), out);
    case 'C':
      if (!AppendRecords(DecodeEmC(datagram), out)) CountIgnored("all", NameOf(datagram.type));
      return true;
    case 'U': return AppendRecords(DecodeEmU(datagram), out);
    case 'h': return AppendRecords(DecodeEmHeight(datagram), out);
    case 'G': return AppendRecords(DecodeEmG(datagram), out);
    case 'I': {
      auto installation = DecodeEmI(datagram);
      if (!installation) return false;
      installation_ = *installation;
      first_serial_ = datagram.serial;
      out->emplace_back(std::move(*installation));
      return true;
    }
    default: CountIgnored("all", NameOf(datagram.type)); return true;
  }
}

std::uint8_t EmAllFileReader::HeadOf(const EmDatagram& datagram) {
  if (!first_serial_) first_serial_ = datagram.serial;
  return datagram.serial == *first_serial_ ? 0 : 1;
}

}  // namespace seastitch
