#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/core/time.hpp"
#include "common/storage/event_log.hpp"
#include "drivers/can/can_driver.hpp"
#include "drivers/datagram_driver.hpp"
#include "drivers/nav/nav_driver.hpp"
#include "survey/read/sample_queue.hpp"

namespace seastitch {

// Configuration files of the drivers; empty for a driver that recorded nothing.
struct DriverFiles {
  std::filesystem::path imu;
  std::filesystem::path dvl;
  std::filesystem::path mbes;
  std::filesystem::path nav;
};

// Drivers that recorded raw bytes, by "CHANNEL/source".
struct RawSources {
  explicit RawSources(const std::set<std::string>& senders);
  bool imu = false;
  bool dvl = false;
  bool mbes = false;
  bool nav = false;
};

// Decodes recorded raw bytes with the present drivers.
class RawReplay {
 public:
  // Throws ConfigError.
  RawReplay(const RawSources& sources, const DriverFiles& files);

  // True if a driver publishes this channel: its recorded messages are then left out from the
  // driver's first raw bytes on. (The oldest raw bytes may have been deleted to make room.)
  bool MakesAnew(const std::string& channel) const { return made_.contains(channel); }
  // Decodes a message of RAW_*; unusable ones are counted.
  void Add(const LogEvent& event);
  // Call it at the end of the log: gives or counts what the drivers still hold.
  void Finish();
  // The next sample that the drivers made.
  std::optional<Received> Take() { return output_.samples.Take(); }
  // Samples that are malformed.
  std::vector<Condition> Faults() const { return output_.samples.Faults(); }
  // Counters that are not zero: those of the drivers, of malformed samples, and of incomplete
  // messages.
  std::map<std::string, std::int64_t> counters() const;

 private:
  struct Packet {
    std::vector<std::uint8_t> bytes;
    std::int64_t recv_utime = 0;
    int next_part = 0;
  };

  struct Output : DriverOutput {
    SampleQueue samples;
    void Put(Sample sample, Time recv) override { samples.Put(std::move(sample), recv); }
    void Put(const RawBytes&) override {}
  };

  void Feed(const std::string& channel, const std::string& source, const Packet& packet);
  void FeedCan(CanDriver* driver, const Packet& packet);

  Output output_;
  std::unique_ptr<CanDriver> imu_;
  std::unique_ptr<CanDriver> dvl_;
  std::unique_ptr<DatagramDriver> dvl_datagrams_;
  std::unique_ptr<DatagramDriver> mbes_;
  std::unique_ptr<NavDriver> nav_;
  std::set<std::string> dvl_channels_;  // of dvl_datagrams_
  std::set<std::string> nav_channels_;
  std::set<std::string> made_;
  std::map<std::string, Packet> open_;  // by channel and source
  std::int64_t malformed_ = 0;
};

}  // namespace seastitch
