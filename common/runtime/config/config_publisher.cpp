#include "common/runtime/config/config_publisher.hpp"

#include <chrono>
#include <utility>

#include "common/core/channel_names.hpp"
#include "common/runtime/health.hpp"
#include "seastitch/config_request_t.hpp"

namespace seastitch {
namespace {

constexpr int kRequestQueue = 16;
constexpr std::chrono::milliseconds kSendPeriod(100);

}  // namespace

ConfigPublisher::ConfigPublisher(std::vector<config_t> parts, Bus* bus, When when)
    : parts_(std::move(parts)), bus_(bus), when_(when) {
  if (when_ == When::kByTimer) return;
  bus_->Subscribe<config_request_t>(
      channels::kConfigRequest, kRequestQueue, [this](const config_request_t& msg) {
        const bool ours =
            msg.process.empty() || (!parts_.empty() && msg.process == parts_.front().process);
        if (ours) wanted_ = true;
      });
}

void ConfigPublisher::SendBy(EventLoop* loop) {
  loop->Every(kSendPeriod, [this] { SendNext(MonotonicSeconds(), NowUtime()); });
}

void ConfigPublisher::SendNext(double now_s, std::int64_t now_utime) {
  const double pause_s = when_ == When::kByTimer ? kTimerS : kPauseS;
  if (wanted_ && waiting_.empty() && (!last_s_ || now_s - *last_s_ >= pause_s)) {
    wanted_ = when_ == When::kByTimer;
    last_s_ = now_s;
    waiting_.assign(parts_.begin(), parts_.end());
    for (config_t& part : waiting_) {  // the parts of a file have one time
      part.utime = now_utime;
      part.version = SEASTITCH_VERSION;
      part.seq = seq_++;
    }
  }
  if (waiting_.empty()) return;
  bus_->Publish(channels::kConfig, waiting_.front());
  waiting_.pop_front();
}

}  // namespace seastitch
