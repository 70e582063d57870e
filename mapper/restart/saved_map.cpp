#include "mapper/restart/saved_map.hpp"

#include "mapper/submaps/relative_pose.hpp"

namespace seastitch {

// A field that the journal has from a format on.
template <class Archive, class T>
void Since(std::uint32_t format, Archive& archive, T& value) {
  if constexpr (std::same_as<Archive, ArchiveReader>) {
    if (archive.format() < format) return;
  }
  archive(value);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, SoundVelocityProfile>& profile) {
  archive(profile.time, profile.depth_m, profile.speed_mps);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, Submap>& submap) {
  archive(submap.id, submap.start, submap.end, submap.frame_time, submap.T_map_submap);
  archive(submap.covariance_from_previous, submap.heading_sigma_rad, submap.heading_spread);
  archive(submap.trigger, submap.predicted_information);
  Since(6, archive, submap.dvl_yaw_rad);
  Since(6, archive, submap.drift_per_m);
  Since(6, archive, submap.T_previous_level);
  archive(submap.soundings_read, submap.soundings_used, submap.footprint);
  // The cloud is not included: it has a file of its own.
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, GraphVertex>& vertex) {
  archive(vertex.id, vertex.time, vertex.dead_reckoned, vertex.heading_sigma_rad, vertex.chain);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, GraphEdge>& edge) {
  archive(edge.kind, edge.from, edge.to, edge.T_from_to, edge.information, edge.verdict);
  archive(edge.z_offset_m, edge.rms_m, edge.overlap_m2, edge.overlap_center_m);
  Since(6, archive, edge.dvl_yaw_rad);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, MountingSigmas>& mounting) {
  archive(mounting.sonar_m, mounting.dvl_yaw_rad);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, GraphUpdate>& update) {
  archive(update.version, update.vertices, update.edges, update.mounting, update.graph_id);
  archive(update.final, update.resumed);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, GraphStep>& step) {
  archive(step.update, step.submap_time);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, RelativePose>& relative) {
  archive(relative.T_a_b, relative.covariance);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, LoopPair>& pair) {
  archive(pair.target, pair.source, pair.prior, pair.z_prior_m);
  // Not saved: target_yaw_rad, source_yaw_rad and dvl_yaw_rad, which a registration that was made
  // does not need again; the closure has its own.
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, Checkpoint>& checkpoint) {
  archive(checkpoint.number, checkpoint.time, checkpoint.graph_id, checkpoint.next_submap);
  archive(checkpoint.navigation, checkpoint.frames, checkpoint.clocks);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, ClosedSubmap>& closed) {
  if constexpr (std::same_as<Archive, ArchiveReader>) {
    const auto submap = std::make_shared<Submap>();
    archive(*submap);
    closed.submap = submap;
  } else {
    archive(*closed.submap);
  }
  // The place of a checkpoint, which earlier versions of the program repeated here.
  Checkpoint none;
  archive(closed.position_edges, closed.skip_registration, none);
}

template <class Archive>
void Fields(Archive& archive, Of<Archive, GraphGrowth>& growth) {
  archive(growth.closed, growth.pairs, growth.registered, growth.statistics, growth.steps);
}

namespace {

template <class T>
std::vector<std::uint8_t> Written(const T& value) {
  ArchiveWriter archive;
  archive(value);
  return archive.Release();
}

template <class T>
std::optional<T> ReadWhole(Bytes bytes, std::uint32_t format = kJournalFormat) {
  T value;
  ArchiveReader archive(bytes, format);
  archive(value);
  if (!archive.IsDone()) return std::nullopt;
  return value;
}

}  // namespace

std::vector<std::uint8_t> Encode(const JournalEntry& entry) { return Written(entry); }
std::vector<std::uint8_t> Encode(const Checkpoint& checkpoint) { return Written(checkpoint); }

std::optional<JournalEntry> DecodeJournalEntry(Bytes bytes, std::uint32_t format) {
  return ReadWhole<JournalEntry>(bytes, format);
}
std::optional<Checkpoint> DecodeCheckpoint(Bytes bytes) { return ReadWhole<Checkpoint>(bytes); }

}  // namespace seastitch
