#include "bench/live.hpp"

#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/runtime/bus.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/file_descriptor.hpp"

namespace seastitch::bench {
namespace {

using Clock = std::chrono::steady_clock;

FileDescriptor ConnectUdp(const std::string& target) {
  const std::size_t colon = target.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == target.size())
    throw std::runtime_error("'" + target + "': expected HOST:PORT");
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(
      target.substr(0, colon).c_str(), target.substr(colon + 1).c_str(), &hints, &found);
  if (error != 0) throw std::runtime_error(target + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> address(found, &freeaddrinfo);

  FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  // Room for a burst of the sonar.
  constexpr int kSendBuffer = 4 * 1024 * 1024;
  setsockopt(fd.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
  if (connect(fd.get(), address->ai_addr, address->ai_addrlen) != 0)
    throw std::runtime_error(target + ": " + std::strerror(errno));
  return fd;
}

Time SystemNow() {
  return Time(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

class LiveSender {
 public:
  explicit LiveSender(const LiveTargets& targets)
      : imu_(ConnectUdp(targets.imu)),
        dvl_(ConnectUdp(targets.dvl)),
        mbes_(ConnectUdp(targets.mbes)),
        lcm_url_(targets.lcm_url) {}

  void Send(const BenchEvent& event) {
    switch (event.device) {
      case Device::kImu: Send(imu_, EncodeCannelloni(event.frames, imu_seq_++)); break;
      case Device::kDvl: Send(dvl_, EncodeCannelloni(event.frames, dvl_seq_++)); break;
      case Device::kMbes: Send(mbes_, event.bytes); break;
      case Device::kFix: SendFix(event); break;
    }
  }

  LiveResult result;

 private:
  void SendFix(const BenchEvent& event) {
    if (!bus_) bus_.emplace(lcm_url_);
    // Received now, as everything else is: event.recv is by the simulation's clock.
    bus_->Publish(channels::kPositionFix, ToLcm(*event.fix, {SystemNow(), fix_seq_++}));
    ++result.packets;
  }

  void Send(const FileDescriptor& fd, const std::vector<std::uint8_t>& bytes) {
    // ECONNREFUSED is the answer to the previous packet: this packet is sent again.
    ssize_t sent = send(fd.get(), bytes.data(), bytes.size(), 0);
    if (sent < 0 && errno == ECONNREFUSED) {
      ++result.refused;
      sent = send(fd.get(), bytes.data(), bytes.size(), 0);
    }
    if (sent < 0) {
      ++result.refused;
      return;
    }
    ++result.packets;
    result.bytes += sent;
  }

  FileDescriptor imu_;
  FileDescriptor dvl_;
  FileDescriptor mbes_;
  std::uint8_t imu_seq_ = 0;
  std::uint8_t dvl_seq_ = 0;
  const std::string lcm_url_;
  std::optional<Bus> bus_;  // present if position fixes are sent
  std::int64_t fix_seq_ = 0;
};

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The first event to be sent. The sonar sends its sound-speed profile once, at the start of the
// survey. If sending starts later, the profile is sent first.
std::optional<BenchEvent> Join(SurveySimulator* simulator,
                               const LiveFrom& from,
                               LiveSender* sender) {
  while (std::optional<BenchEvent> event = simulator->Next()) {
    const double at_s = ToSeconds(event->recv - simulator->start());
    if (at_s >= from.survey_s && (!from.now || event->recv >= SystemNow())) return event;
    if (event->device == Device::kMbes && at_s == 0.0) sender->Send(*event);
  }
  return std::nullopt;
}

}  // namespace

LiveResult SendLive(SurveySimulator* simulator,
                    const LiveTargets& targets,
                    double speed,
                    const Progress& progress,
                    const LiveFrom& from) {
  if (!(speed > 0.0 && std::isfinite(speed))) throw std::invalid_argument("speed must be above 0");
  LiveSender sender(targets);
  const double total_s = ToSeconds(simulator->total());
  const auto survey_s = [&](const BenchEvent& event) {
    return ToSeconds(event.recv - simulator->start());
  };
  std::optional<BenchEvent> event = Join(simulator, from, &sender);
  const Clock::time_point joined = Clock::now();
  const double joined_s = event ? survey_s(*event) : 0.0;
  double next_progress_s = 0.0;
  for (; event; event = simulator->Next()) {
    const double at_s = survey_s(*event);
    const double wait_s = (at_s - joined_s) / speed;
    std::this_thread::sleep_until(joined + std::chrono::duration_cast<Clock::duration>(
                                               std::chrono::duration<double>(wait_s)));
    sender.result.max_lag_s = std::max(sender.result.max_lag_s, SecondsSince(joined) - wait_s);
    sender.Send(*event);
    if (progress && at_s >= next_progress_s) {
      if (!progress(at_s / total_s)) break;
      next_progress_s = at_s + 1.0;
    }
  }
  sender.result.wall_s = SecondsSince(joined);
  return sender.result;
}

}  // namespace seastitch::bench
