#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "codecs/kongsberg/em_all_file.hpp"
#include "codecs/kongsberg/kmall_file.hpp"
#include "codecs/makers/gsf_file.hpp"
#include "codecs/makers/xtf_file.hpp"
#include "tests/support/paths.hpp"

// What reading a survey file costs, in pieces of 64 kB as they come from a disk, beside a plain
// copy of the same pieces: 2 GB of a real file, over and over through one reader. peak_MB: of the
// process, which holds the real file once.
namespace seastitch {
namespace {

using ByteVector = std::vector<std::uint8_t>;

constexpr std::size_t kPieceBytes = 65'536;
constexpr std::size_t kTotalBytes = 2'000'000'000;

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// Hands 2 GB to `take`, piece by piece.
template <class Take>
void OverAndOver(const ByteVector& file, const Take& take) {
  for (std::size_t done = 0; done < kTotalBytes; done += file.size())
    for (std::size_t at = 0; at < file.size(); at += kPieceBytes)
      take(Bytes(file).subspan(at, std::min(kPieceBytes, file.size() - at)));
}

template <class Reader>
void ReadSurveyFile(benchmark::State& state, const char* name) {
  const auto path = Shared(name);
  if (!std::filesystem::exists(path)) return state.SkipWithError("file is not here");
  std::ifstream in(path, std::ios::binary);
  const ByteVector file((std::istreambuf_iterator<char>(in)), {});
  std::size_t records = 0;
  for ([[maybe_unused]] auto _ : state) {
    Reader reader;
    OverAndOver(file, [&](Bytes piece) { records += reader.Add(piece).size(); });
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(kTotalBytes) * state.iterations());
  state.counters["records"] = static_cast<double>(records);
  state.counters["peak_MB"] = PeakMegabytes();
}

void BM_CopyPieces(benchmark::State& state) {
  const ByteVector file(700'000, 1);
  ByteVector to(kPieceBytes);
  for ([[maybe_unused]] auto _ : state)
    OverAndOver(file, [&](Bytes piece) {
      std::memcpy(to.data(), piece.data(), piece.size());
      benchmark::DoNotOptimize(to.data());
      benchmark::ClobberMemory();
    });
  state.SetBytesProcessed(static_cast<std::int64_t>(kTotalBytes) * state.iterations());
}

void BM_ReadAll(benchmark::State& state) {
  ReadSurveyFile<EmAllFileReader>(state, "data/mbes/em2040c_ay.all");
}
void BM_ReadKmall(benchmark::State& state) {
  ReadSurveyFile<KmallFileReader>(state, "data/mbes/em2040_eg.kmall");
}
void BM_ReadXtf(benchmark::State& state) {
  ReadSurveyFile<XtfFileReader>(state, "data/mbes/r2sonic2026.xtf");
}
void BM_ReadGsf(benchmark::State& state) {
  ReadSurveyFile<GsfFileReader>(state, "data/mbes/gsf_v3_08.gsf");
}

BENCHMARK(BM_CopyPieces);
BENCHMARK(BM_ReadAll);
BENCHMARK(BM_ReadKmall);
BENCHMARK(BM_ReadXtf);
BENCHMARK(BM_ReadGsf);

}  // namespace
}  // namespace seastitch
