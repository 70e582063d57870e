// Prints where the vehicle is and which faults its processes report, as they come on the bus. It
// needs LCM and the messages alone: find_package(Seastitch), then link
// Seastitch::seastitch_lcmtypes.
//
//   listen [LCM_URL]

#include <cstdio>
#include <lcm/lcm-cpp.hpp>

#include "seastitch/health_t.hpp"
#include "seastitch/nav_corrected_t.hpp"

namespace {

struct Listener {
  void OnNav(const lcm::ReceiveBuffer*, const std::string&, const seastitch::nav_corrected_t* nav) {
    const double* const p = nav->p_map_vehicle_m;
    std::printf("%lld us: north %.2f m, east %.2f m, depth %.2f m\n",
                static_cast<long long>(nav->utime),
                p[0],
                p[1],
                p[2]);
    std::fflush(stdout);
  }
  void OnHealth(const lcm::ReceiveBuffer*, const std::string&, const seastitch::health_t* health) {
    for (const seastitch::condition_t& fault : health->conditions)
      std::printf("%s: %s\n", health->process.c_str(), fault.sentence.c_str());
    std::fflush(stdout);
  }
};

}  // namespace

int main(int argc, char** argv) {
  lcm::LCM bus(argc > 1 ? argv[1] : "");  // empty: LCM_DEFAULT_URL, or LCM's own default
  if (!bus.good()) return 1;
  Listener listener;
  bus.subscribe("NAV_CORRECTED", &Listener::OnNav, &listener);
  bus.subscribe("HEALTH", &Listener::OnHealth, &listener);
  while (bus.handle() == 0) {
  }
  return 1;
}
