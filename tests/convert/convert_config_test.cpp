#include "common/convert/convert.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/convert/damage.hpp"
#include "tests/convert/example_messages.hpp"

namespace seastitch {
namespace {

using namespace examples;

TEST(ConvertConfig, ComesBackFromItsParts) {
  for (const std::size_t size : {0u, 1u, 50'000u, 50'001u, 170'000u}) {
    ConfigText file = Config();
    file.text.assign(size, 'x');
    const std::vector<config_t> parts = ToLcm(file, kTime, 10);
    ConfigAssembler assembler;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_LT(parts[i].getEncodedSize(), kMaxMessageBytes);
      EXPECT_EQ(parts[i].seq, 10 + static_cast<int>(i));
      const auto whole = assembler.Add(Wire(parts[i]));
      ASSERT_EQ(whole.has_value(), i + 1 == parts.size());
      if (whole) {
        EXPECT_EQ(*whole, file);
      }
    }
    EXPECT_EQ(assembler.malformed(), 0);
  }
}

TEST(ConvertConfig, OfSeveralProcessesMayCross) {
  ConfigText mapper = Config();
  ConfigText logger = Config();
  mapper.text.assign(60'000, 'm');
  logger.text.assign(60'000, 'l');
  logger.process = "logger";
  const auto a = ToLcm(mapper, kTime, 0);
  const auto b = ToLcm(logger, kTime, 0);
  ConfigAssembler assembler;
  EXPECT_FALSE(assembler.Add(a[0]));
  EXPECT_FALSE(assembler.Add(b[0]));
  EXPECT_EQ(assembler.Add(a[1]), mapper);
  EXPECT_EQ(assembler.Add(b[1]), logger);
  EXPECT_EQ(assembler.malformed(), 0);
}

TEST(ConvertConfig, WithAPartMissingIsNoFileAndTheNextOneIs) {
  ConfigText file = Config();
  file.text.assign(120'000, 'x');
  const auto parts = ToLcm(file, kTime, 0);
  ASSERT_EQ(parts.size(), 3u);
  ConfigAssembler assembler;
  EXPECT_FALSE(assembler.Add(parts[0]));
  EXPECT_FALSE(assembler.Add(parts[2]));
  EXPECT_EQ(assembler.malformed(), 1);
  EXPECT_EQ(assembler.Add(ToLcm(Config(), kTime, 0)[0]), Config());
  EXPECT_EQ(assembler.malformed(), 1);
}

TEST(ConvertConfig, RefusesEachDamage) {
  using M = config_t;
  for (const Damage<M>& damage : std::vector<Damage<M>>{
           {"time", [](M& m) { m.utime = -1; }},
           {"of nobody", [](M& m) { m.process = ""; }},
           {"a name without end", [](M& m) { m.process = std::string(65, 'x'); }},
           {"a file name without end", [](M& m) { m.name = std::string(257, 'x'); }},
           {"part negative", [](M& m) { m.part = -1; }},
           {"no parts", [](M& m) { m.num_parts = 0; }},
           {"endless parts", [](M& m) { m.num_parts = 1 << 30; }},
           {"text too long", [](M& m) { m.text.assign(50'001, 'x'); }}}) {
    config_t msg = ToLcm(Config(), kTime, 0)[0];
    damage.apply(msg);
    ConfigAssembler assembler;
    EXPECT_FALSE(assembler.Add(msg)) << damage.name;
    EXPECT_EQ(assembler.malformed(), 1) << damage.name;
  }
}

TEST(ConvertConfig, IsBoundedWhateverProcessesThereAre) {
  ConfigAssembler assembler;
  config_t msg = ToLcm(Config(), kTime, 0)[0];
  msg.num_parts = 2;
  for (int i = 0; i < 1'000; ++i) {
    msg.process = "p" + std::to_string(i);
    assembler.Add(msg);
  }
  EXPECT_GT(assembler.malformed(), 900);
}

}  // namespace
}  // namespace seastitch
