#include "page/status_listener.hpp"

#include "common/convert/channels.hpp"
#include "common/runtime/health.hpp"
#include "seastitch/dvl_t.hpp"

namespace seastitch {

StatusListener::StatusListener(Bus* bus) {
  bus->Subscribe<health_t>(channels::kHealth,
                           QueueOf(channels::kHealth),
                           [this](const health_t& msg) { roll_.Add(msg, MonotonicSeconds()); });
  bus->Subscribe<nav_corrected_t>(channels::kNavCorrected,
                                  QueueOf(channels::kNavCorrected),
                                  [this](const nav_corrected_t& msg) {
                                    nav_ = msg;
                                    nav_s_ = MonotonicSeconds();
                                  });
  bus->Subscribe<dvl_t>(channels::kDvl, QueueOf(channels::kDvl), [this](const dvl_t& msg) {
    if (!msg.has_altitude) return;
    altitude_m_ = msg.altitude_m;
    altitude_s_ = MonotonicSeconds();
  });
}

StatusView StatusListener::View() const {
  StatusView view{roll_, std::nullopt, MonotonicSeconds(), NowUtime()};
  if (nav_ && view.now_s - nav_s_ < kSilentS)
    view.vehicle = PlaceOf(*nav_, view.now_s - altitude_s_ < kSilentS ? altitude_m_ : std::nullopt);
  return view;
}

}  // namespace seastitch
