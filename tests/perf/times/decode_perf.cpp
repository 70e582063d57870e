#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "codecs/kongsberg/kmall_stream.hpp"
#include "codecs/makers/r2sonic.hpp"
#include "codecs/makers/s7k.hpp"
#include "drivers/mbes/mbes_decoder.hpp"

// What the sonar formats cost: items are soundings, of pings of 1024 beams. BM_Copy is a plain
// memcpy of the same bytes as BM_DecodeKmall, BM_Driver* all that a driver does between socket and
// LCM: repeats, parts, decoding, clock.
namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;

MbesPing Ping(int number = 0) {
  MbesPing ping;
  ping.time = FromUtime(1'700'000'000'000'000 + 16'667 * std::int64_t{number});
  ping.ping_number = static_cast<std::uint32_t>(number);
  ping.sound_speed_mps = 1500.0;
  for (int i = 0; i < 1024; ++i) {
    MbesBeam beam;
    beam.rx_angle_rad = -1.0f + 2.0f * static_cast<float>(i) / 1023.0f;
    beam.twtt_s = 0.04f / std::cos(beam.rx_angle_rad);
    beam.tx_tilt_rad = 0.01f;
    beam.depth_sigma_ratio = 0.002f;
    beam.backscatter_db = 40.0f;
    beam.flags = kBeamValid | kBeamPhase;
    ping.beams.push_back(beam);
  }
  return ping;
}

void Report(benchmark::State* state, std::size_t bytes_each) {
  state->SetItemsProcessed(state->iterations() * 1024);
  state->SetBytesProcessed(state->iterations() * static_cast<std::int64_t>(bytes_each));
}

void BM_Copy(benchmark::State& state) {
  const ByteVector bytes = EncodeMrz(Ping(), KmallHeader{});
  ByteVector copy(bytes.size());
  for (auto _ : state) {
    std::memcpy(copy.data(), bytes.data(), bytes.size());
    benchmark::DoNotOptimize(copy.data());
    benchmark::ClobberMemory();
  }
  Report(&state, bytes.size());
}

void BM_DecodeKmall(benchmark::State& state) {
  const ByteVector bytes = EncodeMrz(Ping(), KmallHeader{});
  for (auto _ : state) benchmark::DoNotOptimize(DecodeMrz(bytes));
  Report(&state, bytes.size());
}

void BM_DecodeR2Sonic(benchmark::State& state) {
  const ByteVector bytes = EncodeBth0(Ping());
  for (auto _ : state) benchmark::DoNotOptimize(DecodeBth0(bytes));
  Report(&state, bytes.size());
}

void BM_DecodeS7k(benchmark::State& state) {
  const ByteVector bytes = EncodeS7k7027({}, Ping());
  for (auto _ : state) benchmark::DoNotOptimize(DecodeS7k7027(*ReadS7kRecord(bytes)));
  Report(&state, bytes.size());
}

// Pings enough that none is taken for a repeat.
constexpr int kPings = 100;

void RunDriver(benchmark::State* state,
               const std::string& format,
               const std::vector<std::vector<ByteVector>>& pings) {
  MbesDecoderParams params;
  params.format = format;
  MbesDecoder decoder(params);
  std::size_t bytes_each = 0;
  for (const ByteVector& datagram : pings[0]) bytes_each += datagram.size();
  std::int64_t recv = 1'700'000'000'000'000;
  std::size_t given = 0;
  std::size_t next = 0;
  for (auto _ : *state) {
    for (const ByteVector& datagram : pings[next]) {
      const auto outputs = decoder.Add(datagram, FromUtime(recv));
      given += outputs.size();
    }
    recv += 16'667;
    next = (next + 1) % pings.size();
  }
  if (static_cast<std::int64_t>(given) != state->iterations())
    state->SkipWithError("not every ping was given");
  Report(state, bytes_each);
}

void BM_DriverKmall(benchmark::State& state) {
  std::vector<std::vector<ByteVector>> pings;
  for (int i = 0; i < kPings; ++i)
    pings.push_back(SplitIntoParts(EncodeMrz(Ping(i), KmallHeader{})));
  RunDriver(&state, "kmall", pings);
}

void BM_DriverR2Sonic(benchmark::State& state) {
  std::vector<std::vector<ByteVector>> pings;
  for (int i = 0; i < kPings; ++i) pings.push_back({EncodeBth0(Ping(i))});
  RunDriver(&state, "r2sonic", pings);
}

void BM_DriverS7k(benchmark::State& state) {
  std::vector<std::vector<ByteVector>> pings;
  for (int i = 0; i < kPings; ++i) {
    const MbesPing ping = Ping(i);
    S7kPingId id;
    id.ping_number = ping.ping_number;
    const auto transmission = static_cast<std::uint16_t>(2 * i);
    std::vector<ByteVector> packets =
        FrameS7k(EncodeS7k7000(id, ping.time, ping.sound_speed_mps), transmission);
    for (ByteVector& packet :
         FrameS7k(EncodeS7k7027(id, ping), static_cast<std::uint16_t>(transmission + 1)))
      packets.push_back(std::move(packet));
    pings.push_back(std::move(packets));
  }
  RunDriver(&state, "s7k", pings);
}

BENCHMARK(BM_Copy);
BENCHMARK(BM_DecodeKmall);
BENCHMARK(BM_DecodeR2Sonic);
BENCHMARK(BM_DecodeS7k);
BENCHMARK(BM_DriverKmall);
BENCHMARK(BM_DriverR2Sonic);
BENCHMARK(BM_DriverS7k);

}  // namespace
}  // namespace seastitch
