#include "drivers/socket/can_source.hpp"

#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "drivers/socket/candump.hpp"
#include "drivers/socket/cannelloni.hpp"
#include "drivers/socket/file_descriptor.hpp"
#include "drivers/socket/socket_can.hpp"
#include "drivers/socket/source_url.hpp"
#include "drivers/socket/udp_socket.hpp"

namespace seastitch {
namespace {

constexpr std::size_t kMaxFramesPerCall = 256;

class CannelloniSource : public CanSource {
 public:
  CannelloniSource(const std::string& url, std::vector<CanFilter> filters, int buffer_bytes)
      : socket_(url, buffer_bytes), filters_(std::move(filters)) {}

  int fd() const override { return socket_.fd(); }

  std::vector<ReceivedFrame> Receive() override {
    std::vector<ReceivedFrame> frames;
    Datagram datagram;
    while (frames.size() < kMaxFramesPerCall && socket_.Receive(&datagram))
      Unpack(datagram, &frames);
    return frames;
  }

  std::string trouble() const override { return socket_.trouble(); }
  SenderRefusal refusal() const override { return socket_.refusal(); }

  Counters counters() const override {
    Counters all = socket_.counters();
    all.insert(counters_.begin(), counters_.end());
    return all;
  }

 private:
  void Unpack(const Datagram& datagram, std::vector<ReceivedFrame>* frames) {
    const std::optional<CannelloniPacket> packet = DecodeCannelloni(datagram.bytes);
    if (!packet) {
      ++counters_["cannelloni_malformed"];
      return;
    }
    socket_.Understood(datagram);
    if (next_seq_ && packet->seq != *next_seq_) ++counters_["cannelloni_gaps"];
    next_seq_ = static_cast<std::uint8_t>(packet->seq + 1);
    for (const CanFrame& frame : packet->frames)
      if (Passes(filters_, frame)) frames->push_back({frame, datagram.recv});
  }

  UdpSocket socket_;
  std::vector<CanFilter> filters_;
  std::optional<std::uint8_t> next_seq_;
  Counters counters_;
};

class CandumpSource : public CanSource {
 public:
  CandumpSource(const SourceUrl& url, std::vector<CanFilter> filters)
      : in_(url.address),
        speed_(SpeedOf(url)),
        filters_(std::move(filters)),
        timer_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {
    if (!in_ || std::filesystem::is_directory(url.address))
      throw std::runtime_error(url.text + ": not a file that can be read");
    if (!timer_) throw std::runtime_error(url.text + ": " + std::strerror(errno));
    WakeAfter(std::chrono::nanoseconds(1));
  }

  int fd() const override { return timer_.get(); }
  bool finished() const override { return finished_; }
  Counters counters() const override { return counters_; }

  // The timer is never read, only set again: it stays readable while more frames are due.
  std::vector<ReceivedFrame> Receive() override {
    std::vector<ReceivedFrame> frames;
    while (frames.size() < kMaxFramesPerCall) {
      if (!next_ && !ReadNext()) {
        finished_ = true;
        break;
      }
      if (const auto wait = TimeUntil(next_->time); wait.count() > 0) {
        WakeAfter(wait);
        break;
      }
      frames.push_back({next_->frame, next_->time});
      next_.reset();
    }
    return frames;
  }

 private:
  using Nanoseconds = std::chrono::nanoseconds;

  bool ReadNext() {
    for (std::string line; std::getline(in_, line);) {
      if (!line.starts_with('(')) continue;
      next_ = ParseCandumpLine(line);
      if (!next_)
        ++counters_["candump_malformed"];
      else if (Passes(filters_, next_->frame))
        return true;
    }
    next_.reset();
    return false;
  }

  Nanoseconds TimeUntil(Time logged) {
    if (speed_ == 0.0) return Nanoseconds(0);
    const auto now = std::chrono::steady_clock::now();
    if (!first_logged_) {
      first_logged_ = logged;
      started_ = now;
    }
    const double due_s = ToSeconds(logged - *first_logged_) / speed_;
    const double wait_s = due_s - std::chrono::duration<double>(now - started_).count();
    // At most a day: after a step of the log's clock by years the wait stays finite.
    return Nanoseconds(static_cast<std::int64_t>(std::min(wait_s, 86'400.0) * 1e9));
  }

  void WakeAfter(Nanoseconds wait) {
    itimerspec spec{};
    spec.it_value.tv_sec = wait.count() / 1'000'000'000;
    spec.it_value.tv_nsec = wait.count() % 1'000'000'000;
    timerfd_settime(timer_.get(), 0, &spec, nullptr);
  }

  std::ifstream in_;
  double speed_;
  std::vector<CanFilter> filters_;
  FileDescriptor timer_;
  std::optional<CandumpLine> next_;
  std::optional<Time> first_logged_;
  std::chrono::steady_clock::time_point started_;
  bool finished_ = false;
  Counters counters_;
};

}  // namespace

std::unique_ptr<CanSource> OpenCanSource(const std::string& url,
                                         const std::vector<CanFilter>& filters,
                                         int receive_buffer_bytes) {
  const SourceUrl parsed = ParseSourceUrl(url, {"speed", "interface", "from"});
  if (parsed.scheme == "can") {
    ParseSourceUrl(url, {});
    return std::make_unique<SocketCanSource>(parsed.address, filters, receive_buffer_bytes);
  }
  if (parsed.scheme == "candump")
    return std::make_unique<CandumpSource>(ParseSourceUrl(url, {"speed"}), filters);
  if (parsed.scheme == "udp")
    return std::make_unique<CannelloniSource>(url, filters, receive_buffer_bytes);
  throw std::runtime_error(url + ": expected can:INTERFACE, candump:FILE or udp:HOST:PORT");
}

}  // namespace seastitch
