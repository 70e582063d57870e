// Embeds a Mapper: maps a recorded survey without a bus or threads. Prints how its graph grows.
//
//   map_a_log LOG MAPPER_CONFIG

#include <cstdio>
#include <exception>
#include <map>

#include "common/convert/convert.hpp"
#include "common/core/channel_names.hpp"
#include "common/storage/event_log.hpp"
#include "mapper/mapper.hpp"
#include "mapper/mapper_config.hpp"

using namespace seastitch;

template <class Msg>
void Feed(const LogEvent& event, Mapper* mapper) {
  Msg msg{};
  const int size = static_cast<int>(event.data.size());
  if (msg.decode(event.data.data(), 0, size) != size) return;
  if (const auto sample = FromLcm(msg)) mapper->Add(*sample);
}

int main(int argc, char** argv) try {
  if (argc != 3) return std::fprintf(stderr, "map_a_log LOG MAPPER_CONFIG\n"), 64;
  EventLogReader log(argv[1]);
  const MapperConfig config = LoadMapperConfig(argv[2]);
  Mapper mapper(config);
  PreparedSubmaps prepared(config.loop_closer.registration);
  std::map<SubmapId, std::shared_ptr<const Submap>> submaps;  // a real store would use the disk
  const LoadSubmap load = [&](SubmapId id) { return submaps.at(id); };

  const auto work = [&] {
    for (const MapperEvent& event : mapper.TakeEvents()) {
      if (const auto* submap = std::get_if<std::shared_ptr<const Submap>>(&event))
        submaps[(*submap)->id] = *submap;
      if (const auto* step = std::get_if<GraphStep>(&event))
        std::printf("version %lld: %zu edges\n",
                    static_cast<long long>(step->update.version),
                    step->update.edges.size());
    }
    while (auto job = mapper.NextJob()) mapper.Take(Run(*job, config.loop_closer, load, &prepared));
  };
  while (const auto event = log.Next()) {
    if (event->channel == channels::kImu) Feed<imu_t>(*event, &mapper);
    if (event->channel == channels::kDvl) Feed<dvl_t>(*event, &mapper);
    if (event->channel == channels::kDepth) Feed<depth_t>(*event, &mapper);
    if (event->channel == channels::kPositionFix) Feed<position_fix_t>(*event, &mapper);
    if (event->channel == channels::kMbesPing) Feed<mbes_ping_t>(*event, &mapper);
    if (event->channel == channels::kSvp) Feed<sound_velocity_profile_t>(*event, &mapper);
    work();
  }
  mapper.Finish();
  work();
  work();  // results of the last registrations
  std::printf("%zu submaps; %s\n", submaps.size(), mapper.Summary().c_str());
} catch (const std::exception& e) {
  return std::fprintf(stderr, "map_a_log: %s\n", e.what()), 1;
}
