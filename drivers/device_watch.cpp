#include "drivers/device_watch.hpp"

#include <cmath>
#include <cstdio>

namespace seastitch {

DeviceWatch::DeviceWatch(std::string device, double timeout_s, Health* health)
    : device_(std::move(device)), timeout_s_(timeout_s), health_(health) {}

void DeviceWatch::OnData() {
  data_since_check_ = true;
  const HealthState state = health_->state();
  if (state == HealthState::kStarting || state == HealthState::kLost)
    health_->SetState(HealthState::kOk, device_);
}

void DeviceWatch::Check(Clock::time_point now, const std::string& trouble) {
  if (data_since_check_ || !last_data_) last_data_ = now;
  data_since_check_ = false;
  const double silence_s = std::chrono::duration<double>(now - *last_data_).count();
  const std::string why = trouble.empty() ? "" : ": " + trouble;
  if (silence_s >= timeout_s_) {
    char text[80];
    std::snprintf(text, sizeof text, ": no usable data for %.0f s", std::floor(silence_s));
    health_->SetState(HealthState::kLost, device_ + text + why);
  } else if (health_->state() == HealthState::kStarting) {
    health_->SetState(HealthState::kStarting, device_ + why);
  } else if (health_->state() != HealthState::kLost) {
    health_->SetState(why.empty() ? HealthState::kOk : HealthState::kDegraded, device_ + why);
  }
}

void SetAll(const Counters& counters, Health* health) {
  for (const auto& [name, value] : counters) health->Set(name, value);
}

}  // namespace seastitch
