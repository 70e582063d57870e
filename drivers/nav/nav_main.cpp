#include "common/runtime/process/process.hpp"
#include "drivers/nav/nav_driver.hpp"
#include "drivers/run_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-nav-driver",
      "INS to INS, GPS and USBL to POSITION_FIX, pressure sensor to DEPTH, over UDP, serial ports "
      "or CAN; with RAW_NAV",
      [](const ProcessArgs& args) { return RunDriver<NavDriver>(args, LoadNavDriverConfig); });
}
