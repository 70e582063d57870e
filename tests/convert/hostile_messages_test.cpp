// The decoders that lcm-gen writes, after cmake/HardenLcmType.cmake: no byte of a message makes
// them throw, read past the end or allocate more than the message could hold.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

using examples::Encoded;

template <class Msg>
int Decode(const std::vector<std::uint8_t>& bytes) {
  // A heap block of exactly this size, so that the address sanitizer sees a step past its end.
  const std::vector<std::uint8_t> exact(bytes);
  Msg msg{};
  return msg.decode(exact.data(), 0, static_cast<int>(exact.size()));
}

template <class Msg>
void ExpectNoMessageHurts(const Msg& good) {
  const std::vector<std::uint8_t> bytes = Encoded(good);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_LT(Decode<Msg>({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}), 0);
  // Every aligned word once as each count that hurts: -1, the largest, and 2^30, which times four
  // is zero in 32 bits.
  for (std::size_t at = 8; at + 4 <= bytes.size(); ++at)
    for (const std::uint32_t count : {0xffffffffu, 0x7fffffffu, 0x40000000u, 0u}) {
      std::vector<std::uint8_t> bad = bytes;
      for (std::size_t i = 0; i < 4; ++i)
        bad[at + i] = static_cast<std::uint8_t>(count >> (24 - 8 * i));
      EXPECT_NO_THROW(Decode<Msg>(bad)) << Msg::getTypeName() << " at " << at;
    }
}

TEST(HostileMessages, HurtNoDecoder) {
  examples::ForEach([](const char*, const auto& msg) { ExpectNoMessageHurts(msg); });
}

// What stands behind the decoder: whatever decodes is judged, never trusted.
class Judge {
 public:
  template <class Msg>
  void operator()(const Msg& msg) {
    if constexpr (requires { FromLcm(msg); }) FromLcm(msg);
    if constexpr (requires { submaps_.Add(msg); }) submaps_.Add(msg);
    if constexpr (requires { graphs_.Add(msg); }) graphs_.Add(msg);
    if constexpr (requires { configs_.Add(msg); }) configs_.Add(msg);
  }
  void operator()(const submap_points_t& msg) {
    submaps_.Add(ToLcm(examples::ClosedSubmap(), 0, 0).announcement);
    submaps_.Add(msg);
  }

 private:
  SubmapAssembler submaps_;
  PoseGraphAssembler graphs_;
  ConfigAssembler configs_;
};

template <class Msg>
void ExpectNoFlippedBitThrows(const Msg& good) {
  std::mt19937 random(3);
  Judge judge;
  const std::vector<std::uint8_t> bytes = Encoded(good);
  int decoded = 0;
  for (int i = 0; i < 5'000; ++i) {
    std::vector<std::uint8_t> bad = bytes;
    const std::size_t bit = 64 + random() % (8 * (bytes.size() - 8));
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_NO_THROW(PlaceOf(bad));
    Msg msg{};
    if (msg.decode(bad.data(), 0, static_cast<int>(bad.size())) < 0) continue;
    ++decoded;
    EXPECT_NO_THROW(judge(msg)) << Msg::getTypeName() << ", bit " << bit;
  }
  EXPECT_GT(decoded, 1'000) << Msg::getTypeName();
}

TEST(HostileMessages, WithFlippedBitsNeverThrow) {
  examples::ForEach([](const char*, const auto& msg) { ExpectNoFlippedBitThrows(msg); });
}

}  // namespace
}  // namespace seastitch
