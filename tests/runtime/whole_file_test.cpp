#include "common/runtime/files/whole_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

TEST(WholeFile, HasEveryByte) {
  const TemporaryDir dir;
  std::string bytes("a\0b\r\n", 5);
  bytes.append(100'000, '\xff');
  std::ofstream(dir.path() / "file", std::ios::binary) << bytes;
  std::ofstream(dir.path() / "empty").flush();
  EXPECT_TRUE(ReadWholeFile(dir.path() / "file") == bytes);
  EXPECT_EQ(ReadWholeFile(dir.path() / "empty"), "");
}

TEST(WholeFile, IsNothingWhereItCannotBeRead) {
  const TemporaryDir dir;
  EXPECT_FALSE(ReadWholeFile(dir.path()));
  EXPECT_FALSE(ReadWholeFile(dir.path() / "missing"));
  // It can be opened, and its first bytes give an error of the device, as on a bad sector.
  EXPECT_FALSE(ReadWholeFile("/proc/self/mem"));
}

}  // namespace
}  // namespace seastitch
