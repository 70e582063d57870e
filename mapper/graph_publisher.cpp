#include "mapper/graph_publisher.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/convert/channels.hpp"

namespace seastitch {
namespace {

// Updates sent at once in answer to a request: about 20 kB. A receiver that needs more requests
// again.
constexpr int kUpdatesAtOnce = 16;

}  // namespace

void GraphPublisher::Announce(const Submap& submap) {
  // An announcement ends the previous submap, so that the rest of its points goes first.
  while (SendNextChunk()) {
  }
  SubmapMessages messages = ToLcm(submap, submap_seq_++, points_seq_);
  points_seq_ += static_cast<std::int64_t>(messages.chunks.size());
  bus_->Publish(channels::kSubmap, messages.announcement);
  chunks_.assign(std::make_move_iterator(messages.chunks.begin()),
                 std::make_move_iterator(messages.chunks.end()));
}

void GraphPublisher::AddNew() {
  ++new_;
  SendNew();
}

void GraphPublisher::SendNew() {
  while (new_ > 0 && SendNextUpdate()) --new_;
}

bool GraphPublisher::SendNextChunk() {
  if (chunks_.empty()) return false;
  bus_->Publish(channels::kSubmapPoints, chunks_.front());
  chunks_.pop_front();
  return true;
}

bool GraphPublisher::SendNextUpdate() {
  const GraphStep* const step = graph_->After(version_sent_);
  if (step == nullptr || step->update.version > version_allowed_) return false;
  bus_->Publish(channels::kGraphUpdate, ToLcm(step->update, step->submap_time, update_seq_++));
  version_sent_ = step->update.version;
  return true;
}

void GraphPublisher::SendAfter(std::int64_t have_version) {
  version_sent_ = std::min(version_sent_, have_version);
  for (int i = 0; i < kUpdatesAtOnce && SendNextUpdate(); ++i) {
  }
}

void GraphPublisher::Resume() {
  version_allowed_ = graph_->version();
  version_sent_ = std::max<std::int64_t>(0, version_allowed_ - 1);
}

bool GraphPublisher::IsNewestOld() {
  const std::int64_t newest = graph_->version();
  return std::exchange(version_looked_at_, newest) == newest && version_sent_ >= newest;
}

bool GraphPublisher::SendNewestAgain() {
  version_sent_ = graph_->version() - 1;
  return SendNextUpdate();
}

}  // namespace seastitch
