#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "drivers/nav/depth_codec.hpp"
#include "drivers/nav/nmea_fixes.hpp"
#include "drivers/nav/nmea_ins.hpp"

namespace {

using namespace seastitch;

// Each line that begins with '$' has its checksum made right, so that the fuzzer gets past it.
std::vector<std::uint8_t> Sealed(Bytes bytes) {
  std::vector<std::uint8_t> sealed;
  std::string line;
  const auto end = [&] {
    const std::string body = line.substr(0, line.find('*'));
    sealed.insert(sealed.end(), body.begin(), body.end());
    if (body.starts_with('$')) {
      unsigned sum = 0;
      for (std::size_t i = 1; i < body.size(); ++i) sum ^= static_cast<unsigned char>(body[i]);
      for (const char c : {'*', "0123456789ABCDEF"[sum >> 4 & 15], "0123456789ABCDEF"[sum & 15]})
        sealed.push_back(static_cast<std::uint8_t>(c));
    }
    sealed.push_back('\n');
    line.clear();
  };
  for (const std::uint8_t byte : bytes) {
    if (byte == '\n')
      end();
    else
      line.push_back(static_cast<char>(byte));
  }
  end();
  return sealed;
}

void Check(const NavOutput& output) {
  if (const auto* ins = std::get_if<NavigationSample>(&output)) {
    if (ins->position && !(std::abs(ins->position->latitude_rad) <= 1.5707963267949)) std::abort();
    if (ins->attitude && !ins->attitude->q_ned_imu.coeffs().allFinite()) std::abort();
    if (ins->velocity && !ins->velocity->v_ned_mps.allFinite()) std::abort();
  } else if (const auto* fix = std::get_if<PositionFix>(&output)) {
    if (!(fix->covariance_north_east_m2(0, 0) > 0.0)) std::abort();
  } else if (!std::isfinite(std::get<DepthSample>(output).depth_m)) {
    std::abort();
  }
}

}  // namespace

// Lines, those of NMEA with right checksums, through every instrument that speaks it; then the
// same bytes as they are.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  for (const auto& text : {Sealed(bytes), std::vector<std::uint8_t>(bytes.begin(), bytes.end())}) {
    NmeaInsParams ins;
    ins.clock.clock = DeviceClock::kModel;
    NmeaFixParams fixes;
    fixes.source = "gps";
    std::vector<std::unique_ptr<NavCodec>> codecs;
    codecs.push_back(std::make_unique<NmeaIns>(ins));
    codecs.push_back(std::make_unique<NmeaFixes>(fixes));
    codecs.push_back(std::make_unique<DepthCodec>(DepthCodecParams{}));
    std::int64_t utime = 1'700'000'000'000'000;
    for (std::size_t at = 0; at < text.size(); at += 100)
      for (const auto& codec : codecs)
        for (const NavOutput& output :
             codec->Add(Bytes(text).subspan(at, std::min<std::size_t>(100, text.size() - at)),
                        FromUtime(utime += 100'000)))
          Check(output);
  }
  return 0;
}
