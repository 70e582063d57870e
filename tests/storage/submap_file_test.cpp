#include "common/storage/submap_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include "tests/support/files.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/temporary_dir.hpp"

namespace seastitch {
namespace {

using testing::HasSubstr;

PointCloud Cloud(int points) {
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    const auto f = static_cast<float>(i);
    cloud.Add({0.37f * f, -1.25f * f, 8.0f + 0.01f * f}, 1.0f + static_cast<float>(i % 5));
  }
  return cloud;
}

Eigen::Isometry3d Frame() {
  return MakePose({12345.678901234, -45.3406, 4.62839}, RotationFromRpy(0.01, -0.02, 2.3));
}

class SubmapFileTest : public testing::Test {
 protected:
  std::filesystem::path path() const { return dir_.path() / "submap_0.pcd"; }

  std::string ErrorOf(const std::string& content) const {
    dir_.Write("submap_0.pcd", content);
    try {
      ReadSubmapPcd(path());
    } catch (const std::runtime_error& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.find('\n'), std::string::npos);
      EXPECT_THAT(what, testing::StartsWith(path().string() + ": "));
      return what;
    }
    return "no error";
  }

  pcl::PointCloud<pcl::PointXYZI> PclCloud(int points) const {
    pcl::PointCloud<pcl::PointXYZI> cloud;
    const PointCloud ours = Cloud(points);
    for (std::size_t i = 0; i < ours.size(); ++i) {
      pcl::PointXYZI p;
      p.getVector3fMap() = ours.points[i];
      p.intensity = ours.soundings[i];
      cloud.push_back(p);
    }
    cloud.sensor_origin_ = Eigen::Vector4f(1.5f, -2.5f, 3.5f, 0.0f);
    cloud.sensor_orientation_ = Eigen::Quaternionf(0.5f, 0.5f, -0.5f, 0.5f);
    return cloud;
  }

  TemporaryDir dir_;
};

TEST_F(SubmapFileTest, GivesBackEveryBitOfTheCloudAndTheFrameAsDouble) {
  for (const int points : {0, 1, 1000}) {
    WriteSubmapPcd(path(), Cloud(points), Frame());
    const SubmapPcd back = ReadSubmapPcd(path());
    EXPECT_EQ(back.cloud.points, Cloud(points).points);
    EXPECT_EQ(back.cloud.soundings, Cloud(points).soundings);
    EXPECT_EQ(back.T_map_submap.translation(), Frame().translation());
    EXPECT_TRUE(back.T_map_submap.linear().isApprox(Frame().linear(), 1e-15));
  }
}

TEST_F(SubmapFileTest, ADamagedPointOrFrameIsNamed) {
  WriteSubmapPcd(path(), Cloud(100), Frame());
  const std::string whole = TextOf(path());
  for (const std::size_t at :
       {whole.find("VIEWPOINT") + 12, whole.size() - 1000, whole.size() - 1}) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    EXPECT_THAT(ErrorOf(damaged), HasSubstr("is damaged")) << at;
  }
  // One of before, without a checksum.
  const std::size_t checksum = whole.find("# CRC-32");
  dir_.Write("submap_0.pcd",
             whole.substr(0, checksum) + whole.substr(whole.find('\n', checksum) + 1));
  EXPECT_EQ(ReadSubmapPcd(path()).cloud.points, Cloud(100).points);
}

TEST_F(SubmapFileTest, LeavesNothingButTheFile) {
  WriteSubmapPcd(path(), Cloud(10), Frame());
  const auto entries = std::filesystem::directory_iterator(dir_.path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1);
}

TEST_F(SubmapFileTest, SaysWhereItCannotBeWritten) {
  EXPECT_THAT([] { WriteSubmapPcd("/nonexistent/a.pcd", Cloud(1), Frame()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("/nonexistent/a.pcd: ")));
}

TEST_F(SubmapFileTest, IsReadByPcl) {
  WriteSubmapPcd(path(), Cloud(100), Frame());
  pcl::PointCloud<pcl::PointXYZI> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(path().string(), cloud), 0);
  ASSERT_EQ(cloud.size(), 100u);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(cloud[i].getVector3fMap(), Cloud(100).points[i]);
    EXPECT_EQ(cloud[i].intensity, Cloud(100).soundings[i]);
  }
  EXPECT_FLOAT_EQ(cloud.sensor_origin_.x(), 12345.678901234f);
}

TEST_F(SubmapFileTest, ReadsEveryKindThatPclWrites) {
  const auto cloud = PclCloud(500);
  pcl::PCDWriter writer;
  const std::function<int()> kinds[] = {
      [&] { return writer.writeASCII(path().string(), cloud); },
      [&] { return writer.writeBinary(path().string(), cloud); },
      [&] { return writer.writeBinaryCompressed(path().string(), cloud); }};
  for (const auto& write : kinds) {
    ASSERT_EQ(write(), 0);
    const SubmapPcd back = ReadSubmapPcd(path());
    ASSERT_EQ(back.cloud.size(), 500u);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      EXPECT_TRUE(back.cloud.points[i].isApprox(cloud[i].getVector3fMap(), 1e-6f));
      EXPECT_EQ(back.cloud.soundings[i], cloud[i].intensity);
    }
    EXPECT_EQ(back.T_map_submap.translation(), Eigen::Vector3d(1.5, -2.5, 3.5));
    EXPECT_TRUE(back.T_map_submap.linear().isApprox(
        Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5).toRotationMatrix()));
  }
}

TEST_F(SubmapFileTest, ReadsTheFilesOfTheReferenceImplementation) {
  const std::filesystem::path file = Shared("data/submaps/map_small/submap_0_frame.pdc");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file << " on this machine";
  const SubmapPcd pcd = ReadSubmapPcd(file);
  EXPECT_EQ(pcd.cloud.size(), 4154u);
  EXPECT_EQ(pcd.T_map_submap.translation(), Eigen::Vector3d(11.5652, -45.3406, 4.62839));
  EXPECT_FLOAT_EQ(pcd.cloud.points[0].x(), -2.1886084f);
  EXPECT_EQ(pcd.cloud.soundings[0], 1.0f);
}

// The parts of a small ascii file, to be changed one at a time.
struct Pcd {
  std::string fields = "x y z";
  std::string sizes = "4 4 4";
  std::string types = "F F F";
  std::string counts = "1 1 1";
  std::string width = "2";
  std::string height = "1";
  std::string viewpoint = "0 0 0 1 0 0 0";
  std::string points = "2";
  std::string data = "ascii";
  std::string body = "1 2 3\n4 5 6\n";

  std::string Text() const {
    return "# comment\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types +
           "\nCOUNT " + counts + "\nWIDTH " + width + "\nHEIGHT " + height + "\nVIEWPOINT " +
           viewpoint + "\nPOINTS " + points + "\nDATA " + data + "\n" + body;
  }
};

TEST_F(SubmapFileTest, ReadsOtherFieldsTypesAndOrders) {
  Pcd pcd;
  pcd.fields = "rgb z y x intensity";
  pcd.sizes = "4 8 8 8 2";
  pcd.types = "U F F F U";
  pcd.counts = "3 1 1 1 1";
  pcd.body = "9 9 9 3 2 1 7\r\n\n9 9 9 nan 5 4 1\r\n";
  dir_.Write("submap_0.pcd", pcd.Text());
  const SubmapPcd back = ReadSubmapPcd(path());
  ASSERT_EQ(back.cloud.size(), 1u) << "the point that is not finite is left out";
  EXPECT_EQ(back.cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(back.cloud.soundings[0], 7.0f);
}

TEST_F(SubmapFileTest, RefusesEachDamageWithOneLine) {
  ASSERT_EQ(ErrorOf(Pcd{}.Text()), "no error");
  const auto error = [this](const auto& change) {
    Pcd pcd;
    change(pcd);
    return ErrorOf(pcd.Text());
  };
  EXPECT_THAT(error([](Pcd& p) { p.fields = "x y w"; }), HasSubstr("no field z"));
  EXPECT_THAT(error([](Pcd& p) { p.sizes = "4 4"; }), HasSubstr("SIZE has 2 values, expected 3"));
  EXPECT_THAT(error([](Pcd& p) { p.sizes = "4 4 3"; }), HasSubstr("no known type"));
  EXPECT_THAT(error([](Pcd& p) { p.types = "F F Q"; }), HasSubstr("no known type"));
  EXPECT_THAT(error([](Pcd& p) { p.counts = "1 1 0"; }), HasSubstr("no field z"));
  EXPECT_THAT(error([](Pcd& p) { p.counts = "1 1 99999999"; }), HasSubstr("COUNT"));
  EXPECT_THAT(error([](Pcd& p) { p.width = "99999999999999999999"; }), HasSubstr("WIDTH"));
  EXPECT_THAT(error([](Pcd& p) { p.width = "-2"; }), HasSubstr("WIDTH"));
  EXPECT_THAT(error([](Pcd& p) { p.width = p.height = "20000000"; }), HasSubstr("20 million"));
  EXPECT_THAT(error([](Pcd& p) { p.width = p.points = "20000000"; }), HasSubstr("ends before"));
  EXPECT_THAT(error([](Pcd& p) { p.width = p.points = "3"; }), HasSubstr("ends before"));
  EXPECT_THAT(error([](Pcd& p) { p.points = "5"; }), HasSubstr("WIDTH x HEIGHT"));
  EXPECT_THAT(error([](Pcd& p) { p.viewpoint = "0 0 0 1 0 0"; }), HasSubstr("VIEWPOINT"));
  EXPECT_THAT(error([](Pcd& p) { p.viewpoint = "0 0 nan 1 0 0 0"; }), HasSubstr("VIEWPOINT"));
  EXPECT_THAT(error([](Pcd& p) { p.viewpoint = "0 0 0 0 0 0 0"; }), HasSubstr("not a rotation"));
  EXPECT_THAT(error([](Pcd& p) { p.data = "zip"; }), HasSubstr("DATA 'zip'"));
  EXPECT_THAT(error([](Pcd& p) { p.data = "binary"; }), HasSubstr("ends before"));
  EXPECT_THAT(error([](Pcd& p) { p.data = "binary_compressed"; }), HasSubstr("ends before"));
  EXPECT_THAT(error([](Pcd& p) { p.body = "1 2\n4 5 6\n"; }), HasSubstr("point 0 has 2 values"));
  EXPECT_THAT(error([](Pcd& p) { p.body = "1 2 x3\n4 5 6\n"; }), HasSubstr("point 0"));
  EXPECT_THAT(ErrorOf(""), HasSubstr("not a PCD file"));
  EXPECT_THAT(ErrorOf(std::string(100'000, '\xff')), HasSubstr("not a PCD file"));
  EXPECT_THAT([this] { ReadSubmapPcd(dir_.path()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no such file")));
}

TEST_F(SubmapFileTest, NeverCrashesOnAnyTruncationOrFlippedBit) {
  pcl::PCDWriter writer;
  const auto cloud = PclCloud(200);
  std::mt19937 random(5);
  for (int kind = 0; kind < 3; ++kind) {
    const int error = kind == 0   ? writer.writeASCII(path().string(), cloud)
                      : kind == 1 ? writer.writeBinary(path().string(), cloud)
                                  : writer.writeBinaryCompressed(path().string(), cloud);
    ASSERT_EQ(error, 0);
    const std::string whole = TextOf(path());
    for (std::size_t size = 0; size + 2 < whole.size(); size += 97)
      EXPECT_NE(ErrorOf(whole.substr(0, size)), "no error")
          << "kind " << kind << " cut at " << size;
    for (int i = 0; i < 60; ++i) {
      std::string bad = whole;
      bad[random() % 400] ^= static_cast<char>(1 << (random() % 8));
      ErrorOf(bad);
    }
  }
}

}  // namespace
}  // namespace seastitch
