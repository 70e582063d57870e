// Prints the position of the vehicle as the mapper sends it.
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <seastitch/nav_t.hpp>

void Print(const lcm::ReceiveBuffer*, const std::string&, const seastitch::nav_t* nav, int) {
  const double* const p = nav->p_map_vehicle_m;
  std::printf("%.2f m north, %.2f m east, %.2f m down\n", p[0], p[1], p[2]);
}

int main() {
  lcm::LCM bus;
  bus.subscribeFunction("NAV", Print, 0);
  while (bus.handle() == 0) {
  }
}
