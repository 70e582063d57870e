#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/vehicle/finding.hpp"
#include "tools/vehicle/machine.hpp"

// Checks of the computer before a dive. Each check returns its findings, good and bad.
namespace seastitch {

// LCM's multicast group of the URL must be routed to the loopback interface, with the source
// 127.0.0.1.
Findings CheckRoute(const Machine& machine, const std::string& lcm_url);

// The interface must be up, its controller not bus-off, and its bit rate that of the *.network file
// by which systemd-networkd manages it, if it does.
Findings CheckCan(const Machine& machine, const std::string& interface);

// net.core.rmem_max must permit the largest receive buffer that a process requests.
Findings CheckBuffers(const Machine& machine, std::int64_t wanted_bytes);

// The port of a driver that does not run must be free. source: "udp:HOST:PORT...".
Findings CheckPort(const std::string& driver, const std::string& source);
// The device of a serial source must exist.
// udp: the URL to which the nav-output sends. Its unit's filter has to let it.
Findings CheckOutputFilter(const Machine& machine, const std::string& udp);
// listen: address of the page.
Findings CheckPage(const std::string& listen);
Findings CheckSerial(const std::string& driver, const std::string& source);

// Free space and write speed. Writes at most 64 MB for at most 1.5 s to a file without a name.
Findings CheckDisk(const std::filesystem::path& dives_dir);

// For a folder outside the units' own: logger and mapper must be allowed to write to it and wait
// for its disk, the logger alone may require the disk, and the disk must be mounted.
Findings CheckDataDisk(const Machine& machine, const std::filesystem::path& dives_dir);

// Whether the clock is disciplined, how well, and by which program.
Findings CheckClock(const Machine& machine);

Findings CheckProcessor(const Machine& machine);
Findings CheckMemory(const Machine& machine);

// The kernel must filter the IP packets of the units that receive LCM messages only, and let in
// nothing but what this computer sends and LCM's group.
Findings CheckFilter(const Machine& machine, const std::string& lcm_url);

// Checks how the newest finished dive ended. now_utime: wall clock.
Findings CheckLastDive(const std::filesystem::path& dives_dir, std::int64_t now_utime);

}  // namespace seastitch
