#include "survey/read/raw_replay.hpp"

#include <algorithm>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "drivers/dvl/dvl_driver.hpp"
#include "drivers/dvl/pd0_driver.hpp"
#include "drivers/imu/imu_driver.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/socket/cannelloni.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMostOpen = 64;                 // limit of sources with incomplete datagrams
constexpr std::size_t kMostBytes = 16 * 1024 * 1024;  // limit of a datagram

// True if a driver of this name recorded the source; see CanDriver.
bool IsOf(const std::string& source, const std::string& driver) {
  return source.ends_with("#" + driver);
}

std::vector<std::string> DvlDevices() {
  std::vector<std::string> devices = DvlCanDevices();
  devices.push_back(Pd0DriverConfig{}.device);
  return devices;
}

}  // namespace

RawSources::RawSources(const std::set<std::string>& senders) {
  for (const std::string& sender : senders) {
    const bool is_can = sender.starts_with(std::string(channels::kRawCan) + "/");
    imu |= is_can && IsOf(sender, "imu-driver");
    dvl |= is_can && IsOf(sender, "dvl-driver");
    dvl |= sender.starts_with(std::string(channels::kRawDvl) + "/");
    mbes |= sender.starts_with(std::string(channels::kRawMbes) + "/");
    nav |= sender.starts_with(std::string(channels::kRawNav) + "/");
  }
}

RawReplay::RawReplay(const RawSources& sources, const DriverFiles& files) {
  if (sources.imu) {
    imu_ = std::make_unique<ImuDriver>(LoadImuDriverConfig(files.imu.string()), &output_);
  }
  if (sources.dvl) {
    const std::string file = files.dvl.string();
    if (DeviceIn(file, DvlDevices()) == Pd0DriverConfig{}.device) {
      const Pd0DriverConfig config = LoadPd0DriverConfig(file);
      dvl_channels_ = config.output_channels();
      dvl_datagrams_ = std::make_unique<Pd0Driver>(config, &output_);
    } else {
      dvl_ = std::make_unique<DvlDriver>(LoadDvlDriverConfig(file), &output_);
    }
  }
  if (sources.mbes) {
    mbes_ = std::make_unique<MbesDriver>(LoadMbesDriverConfig(files.mbes.string()), &output_);
  }
  if (sources.nav) {
    const NavDriverConfig config = LoadNavDriverConfig(files.nav.string());
    nav_channels_ = config.output_channels();
    nav_ = std::make_unique<NavDriver>(config, &output_);
  }
}

void RawReplay::Add(const LogEvent& event) {
  raw_bytes_t msg{};
  const int size = static_cast<int>(event.data.size());
  if (msg.decode(event.data.data(), 0, size) != size) {
    ++malformed_;
    return;
  }
  const std::string key = event.channel + "/" + msg.source;
  if (!open_.contains(key) && open_.size() >= kMostOpen) open_.clear();
  Packet& packet = open_[key];
  if (msg.part == 0) packet = Packet{{}, msg.recv_utime, 0};
  const bool continues = msg.part == packet.next_part && msg.recv_utime == packet.recv_utime &&
                         packet.bytes.size() + msg.data.size() <= kMostBytes;
  if (!continues) {
    ++malformed_;
    open_.erase(key);
    return;
  }
  packet.bytes.insert(packet.bytes.end(), msg.data.begin(), msg.data.end());
  if (++packet.next_part < msg.num_parts) return;
  Feed(event.channel, msg.source, packet);
  open_.erase(key);
}

void RawReplay::Feed(const std::string& channel, const std::string& source, const Packet& packet) {
  const Datagram datagram{packet.bytes, FromUtime(packet.recv_utime), 0};
  if (channel == channels::kRawMbes && mbes_) {
    made_.insert({channels::kMbesPing, channels::kSvp});
    mbes_->Feed(datagram);
  } else if (channel == channels::kRawNav && nav_) {
    made_.insert(nav_channels_.begin(), nav_channels_.end());
    nav_->Feed(source, datagram);
  } else if (channel == channels::kRawDvl && dvl_datagrams_) {
    made_.insert(dvl_channels_.begin(), dvl_channels_.end());
    dvl_datagrams_->Feed(datagram);
  } else if (IsOf(source, "imu-driver") && imu_) {
    made_.insert(channels::kImu);
    FeedCan(imu_.get(), packet);
  } else if (IsOf(source, "dvl-driver") && dvl_) {
    made_.insert({channels::kDvl, channels::kDepth});
    FeedCan(dvl_.get(), packet);
  } else {
    ++malformed_;
  }
}

void RawReplay::FeedCan(CanDriver* driver, const Packet& packet) {
  const auto decoded = DecodeCannelloni(packet.bytes);
  if (!decoded) {
    ++malformed_;
    return;
  }
  std::vector<ReceivedFrame> frames;
  for (const CanFrame& frame : decoded->frames)
    frames.push_back({frame, FromUtime(packet.recv_utime)});
  driver->Feed(frames);
}

void RawReplay::Finish() {
  for (CanDriver* const driver : {imu_.get(), dvl_.get()})
    if (driver != nullptr) driver->Finish();
}

std::map<std::string, std::int64_t> RawReplay::counters() const {
  std::map<std::string, std::int64_t> all{{"raw_malformed", malformed_}};
  if (nav_)
    for (const auto& [name, value] : nav_->decoder_counters()) all[name] += value;
  for (const DeviceDriver* const driver : {static_cast<const DeviceDriver*>(imu_.get()),
                                           static_cast<const DeviceDriver*>(dvl_.get()),
                                           static_cast<const DeviceDriver*>(dvl_datagrams_.get()),
                                           static_cast<const DeviceDriver*>(mbes_.get())})
    if (driver != nullptr)
      for (const auto& [name, value] : driver->decoder_counters()) all[name] += value;
  for (const auto& [name, value] : output_.samples.counters()) all[name] += value;
  std::erase_if(all, [](const auto& counter) { return counter.second == 0; });
  return all;
}

}  // namespace seastitch
