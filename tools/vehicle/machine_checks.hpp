#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/vehicle/finding.hpp"
#include "tools/vehicle/machine.hpp"

// What of the computer keeps a dive from succeeding. Each check gives its findings, good and bad.
namespace seastitch {

// LCM's group of a URL is routed to the loopback interface, with the source 127.0.0.1.
Findings CheckRoute(const Machine& machine, const std::string& lcm_url);

// The interface is up, its controller on the bus, its bit rate that of systemd's *.network file.
Findings CheckCan(const Machine& machine, const std::string& interface);

// net.core.rmem_max grants the largest receive buffer that a process asks for.
Findings CheckBuffers(const Machine& machine, std::int64_t wanted_bytes);

// The port of a driver that does not run is free. source: "udp:HOST:PORT...".
Findings CheckPort(const std::string& driver, const std::string& source);
// The device of a serial source.
Findings CheckSerial(const std::string& driver, const std::string& source);

// Room, write speed, and that the folder is on a disk that is mounted. Writes a file of at most
// 64 MB for at most 1.5 s there, and removes it.
Findings CheckDisk(const std::filesystem::path& dives_dir);

// Units may write to a folder outside their own, and wait for its disk.
Findings CheckDataDisk(const Machine& machine, const std::filesystem::path& dives_dir);

// Disciplined, how well, and by whom.
Findings CheckClock(const Machine& machine);

Findings CheckProcessor(const Machine& machine);
Findings CheckMemory(const Machine& machine);

// The kernel filters the IP packets of the units that listen to LCM alone.
Findings CheckFilter(const Machine& machine);

// Checks how the newest finished dive ended. now_utime: wall clock.
Findings CheckLastDive(const std::filesystem::path& dives_dir, std::int64_t now_utime);

}  // namespace seastitch
