#include "drivers/device_watch.hpp"

#include <cmath>
#include <cstdio>

namespace seastitch {

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

void FollowRefusals(const SenderRefusal& refusal,
                    DeviceWatch::Clock::time_point now,
                    Health* health) {
  health->FollowEvents(conditions::kSenderRefused,
                       refusal.count,
                       std::chrono::duration<double>(now.time_since_epoch()).count(),
                       std::to_string(refusal.count) + " so far, the last of " + refusal.last);
}

void SetAll(const Counters& counters, Health* health) {
  for (const auto& [name, value] : counters) health->Set(name, value);
}

}  // namespace seastitch
