#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/live.hpp"
#include "bench/simulator.hpp"
#include "mapper/mapper_config.hpp"

namespace seastitch {

struct BenchOptions {
  std::filesystem::path survey;   // survey YAML
  std::filesystem::path terrain;  // GDAL raster; empty: the survey's own seabed
  std::filesystem::path
      config_dir;             // vehicle.yaml and the drivers' files: both sides agree on these
  std::filesystem::path log;  // empty: device bytes are sent live
  bool overwrite =
      false;  // also a log that this command did not make: one without a truth beside it
  // With log: also writes the survey as a .kmall, .all or .s7k file with the navigation of an INS;
  // empty: none.
  std::filesystem::path survey_file;
  double speed = 1.0;
  // Live: UTC of the survey's start by the devices' clocks: "2026-01-01T00:00:00Z", or "now". The
  // part of the survey in the past is not sent. Empty: a fixed day, and all of it is sent.
  std::string epoch;
  double from_s = 0.0;              // live: second of the survey at which to begin
  std::vector<std::string> faults;  // in addition to the survey's own: see bench/fault.hpp
  bench::LiveTargets targets{"127.0.0.1:20001", "127.0.0.1:20002", "127.0.0.1:6020"};
};

// Mapper configuration for a survey: mapper_CLASS.yaml of a folder, with the data sheet of the
// survey's class of sensor errors. Without such a file, or if the survey sets errors itself:
// mapper.yaml.
std::filesystem::path MapperConfigFor(const bench::SurveyConfig& survey,
                                      const std::filesystem::path& config_dir);

// The file of MapperConfigFor(), with the survey's start: at the first fix if the vehicle starts at
// the surface, else where its track begins.
MapperConfig LoadMapperConfigFor(const bench::SurveyConfig& survey,
                                 const std::filesystem::path& config_dir);
// Writes the same to a file; returns its path.
std::filesystem::path WriteMapperConfigFor(const bench::SurveyConfig& survey,
                                           const std::filesystem::path& config_dir,
                                           const std::filesystem::path& folder);

// The simulator for these options. Throws std::runtime_error or std::invalid_argument with one
// line.
bench::SurveySimulator MakeSimulator(const BenchOptions& options);

// `seastitch bench`: a simulated survey as device bytes over UDP, or as an LCM log with the truth
// beside it. Throws as MakeSimulator.
int RunBench(const BenchOptions& options);

}  // namespace seastitch
