#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

namespace seastitch {

// What the page of a vehicle shows, handed from the thread of the bus to those of the browsers. One
// state and one map are kept, however slow a browser is.
class PageFeed {
 public:
  using Text = std::shared_ptr<const std::string>;

  void SetState(std::string json);
  void SetMap(std::string json);
  // Ends every wait.
  void Close();

  // The newest state, once there is a newer one than number *seen; null after a while without one.
  Text WaitForState(std::uint64_t* seen, std::chrono::milliseconds at_most);
  Text map() const;  // null: none yet
  bool is_closed() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Text state_, map_;
  std::uint64_t number_ = 0;  // of state_
  bool closed_ = false;
};

}  // namespace seastitch
