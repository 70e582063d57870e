#include "drivers/device_watch.hpp"

#include <cmath>
#include <cstdio>

namespace seastitch {
namespace {

constexpr std::chrono::seconds kRefusalHolds(10);

}  // namespace

DeviceWatch::DeviceWatch(const std::string& device, double timeout_s, Health* health)
    : timeout_s_(timeout_s), health_(health) {
  health_->SetStarting("waiting for " + device);
  health_->SetText(device);
}

void DeviceWatch::OnData() {
  data_since_check_ = true;
  health_->Release(conditions::kNoDeviceData);
  health_->SetRunning();
}

void DeviceWatch::Check(Clock::time_point now, const std::string& trouble) {
  health_->HoldIf(!trouble.empty(), conditions::kSourceUnavailable, trouble);
  if (data_since_check_ || !last_data_) last_data_ = now;
  data_since_check_ = false;
  const double silence_s = std::chrono::duration<double>(now - *last_data_).count();
  if (silence_s < timeout_s_) return;
  char text[40];
  std::snprintf(text, sizeof text, "for %.0f s", std::floor(silence_s));
  health_->Hold(conditions::kNoDeviceData, text);
  health_->SetRunning();
}

void SenderWatch::Check(std::chrono::steady_clock::time_point now,
                        const SenderRefusal& refusal,
                        Health* health) {
  if (refusal.count > refused_) refused_at_ = now;
  refused_ = refusal.count;
  health->HoldIf(refused_ > 0 && now - refused_at_ < kRefusalHolds,
                 conditions::kSenderRefused,
                 std::to_string(refused_) + " so far, the last of " + refusal.last);
}

void SetAll(const Counters& counters, Health* health) {
  for (const auto& [name, value] : counters) health->Set(name, value);
}

}  // namespace seastitch
