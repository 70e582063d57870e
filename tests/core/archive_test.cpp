#include "common/core/archive.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tests/support/property.hpp"

namespace seastitch {
namespace {

using Sample = std::pair<std::string, std::vector<std::int32_t>>;

std::vector<std::uint8_t> Written(const Sample& sample, bool flag, double number) {
  ArchiveWriter archive;
  archive(flag ? std::optional(sample) : std::nullopt,
          sample,
          flag,
          number,
          Eigen::Matrix3d(Eigen::Matrix3d::Constant(number)),
          FromUtime(7));
  return archive.Release();
}

bool CanBeRead(Bytes bytes, Sample* sample, bool* flag, double* number) {
  ArchiveReader archive(bytes);
  Eigen::Matrix3d matrix;
  Time time;
  std::optional<Sample> sometimes;
  archive(sometimes, *sample, *flag, *number, matrix, time);
  return archive.IsDone() && time == FromUtime(7) && sometimes.has_value() == *flag;
}

RC_GTEST_PROP(Archive, ReadsWhatWasWritten, (const Sample& sample, bool flag, double number)) {
  Sample read;
  bool read_flag = !flag;
  double read_number = 0.0;
  RC_ASSERT(CanBeRead(Written(sample, flag, number), &read, &read_flag, &read_number));
  RC_ASSERT(read == sample);
  RC_ASSERT(read_flag == flag);
  RC_ASSERT(read_number == number);
}

RC_GTEST_PROP(Archive, RefusesEveryCut, (const Sample& sample, bool flag, double number)) {
  const std::vector<std::uint8_t> whole = Written(sample, flag, number);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    Sample read;
    bool read_flag = false;
    double read_number = 0.0;
    RC_ASSERT(!CanBeRead(Bytes(whole).first(size), &read, &read_flag, &read_number));
  }
}

using Either = std::variant<double, std::string, std::deque<std::int16_t>>;

RC_GTEST_PROP(Archive, ReadsWhicheverAlternativeWasWritten, (double number, std::string text)) {
  const std::deque<std::int16_t> list(text.begin(), text.end());
  for (const Either& either : {Either(number), Either(text), Either(list)}) {
    ArchiveWriter writer;
    writer(either);
    const std::vector<std::uint8_t> bytes = writer.Release();
    Either read;
    ArchiveReader reader(bytes);
    reader(read);
    RC_ASSERT(reader.IsDone());
    RC_ASSERT(read == either);
  }
}

TEST(Archive, RefusesAnAlternativeThatThereIsNot) {
  const std::vector<std::uint8_t> bytes(9, 3);
  Either read;
  ArchiveReader reader(bytes);
  reader(read);
  EXPECT_FALSE(reader.ok());
}

TEST(Archive, MakesNoMoreThanThereAreBytesFor) {
  ByteWriter bytes;
  bytes.Le<std::uint32_t>(0xffffffffU);
  bytes.Zeros(8);
  std::vector<std::uint32_t> values;
  ArchiveReader archive(bytes.bytes());
  archive(values);
  EXPECT_FALSE(archive.ok());
  EXPECT_LE(values.size(), 3U);
}

}  // namespace
}  // namespace seastitch
