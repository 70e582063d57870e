#include "drivers/mbes/mbes_decoder.hpp"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string_view>

#include "codecs/kongsberg/kmall_stream.hpp"
#include "codecs/makers/r2sonic.hpp"
#include "codecs/makers/s7k.hpp"
#include "codecs/makers/wbms.hpp"
#include "drivers/registry.hpp"

namespace seastitch {
namespace {

// Number of recent datagrams that are compared: enough for some pings in several parts. Duplicates
// made by a network come much sooner.
constexpr std::size_t kRecent = 64;

template <class Codec>
std::unique_ptr<MbesCodec> Make(const MbesCodecParams& params) {
  return std::make_unique<Codec>(params);
}

struct Format {
  const char* name;
  bool is_stream;
  std::unique_ptr<MbesCodec> (*make)(const MbesCodecParams& params);
};

constexpr Format kFormats[] = {
    {"kmall", false, Make<KmallStream>},      // Kongsberg EM
    {"r2sonic", false, Make<R2SonicStream>},  // R2Sonic BTH0
    {"s7k", false, Make<S7kStream>},          // Teledyne Reson SeaBat
    {"wbms", true, Make<WbmsStream>},         // Norbit WBMS
};

const Format& FormatOf(const std::string& name) {
  const Format* const format = FindEntry(kFormats, name);
  if (format == nullptr) throw std::invalid_argument("no format " + name);
  return *format;
}

}  // namespace

std::vector<std::string> MbesFormats() { return NamesOf(kFormats); }

bool IsStream(const std::string& format) { return FormatOf(format).is_stream; }

MbesDecoder::MbesDecoder(const MbesDecoderParams& params)
    : codec_(FormatOf(params.format).make(params.codec)),
      is_stream_(IsStream(params.format)),
      stamper_(params.clock) {}

std::vector<MbesOutput> MbesDecoder::Add(Bytes payload, Time recv, std::uint64_t sender) {
  if (!is_stream_ && IsRepeat(payload)) {
    ++counters_["mbes_datagram_repeated"];
    return {};
  }
  std::vector<MbesOutput> outputs = codec_->Add(payload, recv, sender);
  std::erase_if(outputs, [&](MbesOutput& output) {
    auto* const ping = std::get_if<MbesPing>(&output);
    return ping != nullptr && !Stamp(recv, ping);
  });
  return outputs;
}

bool MbesDecoder::Stamp(Time recv, MbesPing* ping) {
  const std::optional<Time> time = stamper_.Stamp(ping->time, recv, LastEcho(*ping) - ping->time);
  if (time)
    ping->time = *time;
  else
    ++counters_["mbes_ping_unstamped"];
  return time.has_value();
}

bool MbesDecoder::IsRepeat(Bytes payload) {
  const std::size_t hash = std::hash<std::string_view>()(
      {reinterpret_cast<const char*>(payload.data()), payload.size()});
  if (std::find(recent_.begin(), recent_.end(), hash) != recent_.end()) return true;
  recent_.push_back(hash);
  if (recent_.size() > kRecent) recent_.pop_front();
  return false;
}

Counters MbesDecoder::counters() const {
  Counters all = codec_->counters();
  all.insert(counters_.begin(), counters_.end());
  return all;
}

}  // namespace seastitch
