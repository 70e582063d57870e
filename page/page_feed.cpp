#include "page/page_feed.hpp"

#include <utility>

namespace seastitch {

void PageFeed::SetState(std::string json) {
  auto state = std::make_shared<const std::string>(std::move(json));
  const std::lock_guard lock(mutex_);
  state_ = std::move(state);
  ++number_;
  changed_.notify_all();
}

void PageFeed::SetMap(std::string json) {
  auto map = std::make_shared<const std::string>(std::move(json));
  const std::lock_guard lock(mutex_);
  map_ = std::move(map);
}

void PageFeed::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

PageFeed::Text PageFeed::WaitForState(std::uint64_t* seen, std::chrono::milliseconds at_most) {
  std::unique_lock lock(mutex_);
  const bool is_newer =
      changed_.wait_for(lock, at_most, [&] { return closed_ || number_ > *seen; });
  if (!is_newer || closed_) return nullptr;
  *seen = number_;
  return state_;
}

PageFeed::Text PageFeed::map() const {
  const std::lock_guard lock(mutex_);
  return map_;
}

bool PageFeed::is_closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace seastitch
