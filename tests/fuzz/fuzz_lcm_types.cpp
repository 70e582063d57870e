// Every LCM type: the first byte chooses it, the rest is a message of it behind its fingerprint.
#include <array>
#include <cstdlib>
#include <functional>
#include <vector>

#include "common/convert/channels.hpp"
#include "common/convert/convert.hpp"
#include "tests/convert/example_messages.hpp"

namespace {

using namespace seastitch;

// What stands behind the decoder: whatever decodes is judged, and encodes to a message that
// decodes.
class Judge {
 public:
  template <class Msg>
  void operator()(const Msg& msg) {
    if constexpr (requires { FromLcm(msg); }) FromLcm(msg);
    if constexpr (requires { submaps_.Add(msg); }) submaps_.Add(msg);
    if constexpr (requires { graphs_.Add(msg); }) graphs_.Add(msg);
    if constexpr (requires { configs_.Add(msg); }) configs_.Add(msg);
  }

 private:
  SubmapAssembler submaps_;
  PoseGraphAssembler graphs_;
  ConfigAssembler configs_;
};

using Try = std::function<void(Bytes message)>;

template <class Msg>
void TryType(Bytes body) {
  std::vector<std::uint8_t> bytes;
  const auto hash = static_cast<std::uint64_t>(Msg::getHash());
  for (int shift = 56; shift >= 0; shift -= 8)
    bytes.push_back(static_cast<std::uint8_t>(hash >> shift));
  bytes.insert(bytes.end(), body.begin(), body.end());
  PlaceOf(bytes);
  Msg msg{};
  const int size = static_cast<int>(bytes.size());
  if (msg.decode(bytes.data(), 0, size) < 0) return;
  Judge()(msg);
  std::vector<std::uint8_t> again(static_cast<std::size_t>(msg.getEncodedSize()));
  if (msg.encode(again.data(), 0, static_cast<int>(again.size())) < 0) std::abort();
  Msg same{};
  if (same.decode(again.data(), 0, static_cast<int>(again.size())) < 0) std::abort();
}

const std::vector<Try>& Types() {
  static const std::vector<Try> all = [] {
    std::vector<Try> types;
    examples::ForEach([&types]<class Msg>(const char*, const Msg&) {
      types.emplace_back([](Bytes body) { TryType<Msg>(body); });
    });
    return types;
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Types()[data[0] % Types().size()](Bytes(data + 1, size - 1));
  return 0;
}
