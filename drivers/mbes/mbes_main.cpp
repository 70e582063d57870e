#include "common/runtime/process/process.hpp"
#include "drivers/mbes/mbes_driver.hpp"
#include "drivers/run_driver.hpp"

int main(int argc, char** argv) {
  using namespace seastitch;
  return RunProcess(
      argc,
      argv,
      "seastitch-mbes-driver",
      "Multibeam sonar over UDP or TCP to MBES_PING, SVP and RAW_MBES",
      [](const ProcessArgs& args) { return RunDriver<MbesDriver>(args, LoadMbesDriverConfig); });
}
