#pragma once

#include <cstdint>
#include <string>

namespace seastitch {

// Values as health_t's STATE_DEGRADED and STATE_LOST.
enum class Severity : std::int8_t { kDegraded = 2, kLost = 3 };

// A fault that a process can report in HEALTH. docs/health.md lists all of them: every kind stands
// in conditions::kAll below.
struct ConditionKind {
  const char* name;  // unique, such as "no_bottom_lock"
  Severity severity;
  const char* sentence;  // one line for people, without a full stop
  const char* remedy;    // what to do about it
};

// A fault that holds now.
struct Condition {
  const ConditionKind* kind;
  std::string detail;  // figures of this occurrence, appended to the sentence; may be empty
};

// Every fault that any process reports, by the part that finds it.
namespace conditions {

// Every process (common/runtime/self_watch.hpp).
inline constexpr ConditionKind kUndecodableMessages{
    "undecodable_messages",
    Severity::kDegraded,
    "messages are not of their channel's type",
    "Another program, or another version, sends on this channel. They are skipped. Compare the "
    "versions in HEALTH and the channel names of the sender."};
inline constexpr ConditionKind kMessagesNotSent{
    "messages_not_sent",
    Severity::kDegraded,
    "messages cannot be sent on the LCM bus",
    "Check the interface and the multicast route that LCM uses (systemctl status lcm-loopback)."};
inline constexpr ConditionKind kSocketDrops{
    "socket_drops",
    Severity::kDegraded,
    "the kernel dropped datagrams for want of receive buffer",
    "Raise net.core.rmem_max (sysctl.d/60-seastitch.conf) and restart. Where the buffer is large "
    "enough, look for a machine that is overloaded."};
inline constexpr ConditionKind kLoopLate{
    "loop_late",
    Severity::kDegraded,
    "the event loop was busy for too long",
    "The machine is overloaded, or swaps. Messages wait and may be lost meanwhile."};
inline constexpr ConditionKind kWorkerStalled{
    "worker_stalled",
    Severity::kDegraded,
    "a computation shows no progress",
    "Normal for some seconds on a slow machine. If it stays, the disk that it reads hangs, or the "
    "process needs a restart."};
inline constexpr ConditionKind kDiskStalled{"disk_stalled",
                                            Severity::kDegraded,
                                            "the disk does not take what is to be written",
                                            "Check the data disk and the kernel's log. Data wait "
                                            "in memory and are written when it answers."};

// Drivers.
inline constexpr ConditionKind kNoDeviceData{
    "no_device_data",
    Severity::kLost,
    "no usable data from the device",
    "Check its power, its cable and the source in the driver's configuration. Bytes that are "
    "refused are in the counters, by cause."};
inline constexpr ConditionKind kSourceUnavailable{
    "source_unavailable",
    Severity::kDegraded,
    "the device's interface or port cannot be used",
    "Bring the interface up, or end the program that holds the port. The driver tries again every "
    "second."};
inline constexpr ConditionKind kSenderRefused{
    "sender_refused",
    Severity::kDegraded,
    "datagrams come from another sender, and are refused",
    "A driver takes those of one sender, the first that it heard. Name the senders of a device "
    "that "
    "has several in the driver's source (?from=10.0.0.5,10.0.0.6); keep others off the sensors' "
    "network."};
inline constexpr ConditionKind kCanController{
    "can_controller",
    Severity::kDegraded,
    "the CAN controller sees errors on the wire",
    "Check bit rate, termination and wiring, and that another node acknowledges."};

// Logger.
inline constexpr ConditionKind kLogNotWriting{
    "log_not_writing",
    Severity::kDegraded,
    "the log cannot be written",
    "Check the data disk: mounted, writable, not full. Messages wait in memory until then; what "
    "finds no room is counted in events_dropped."};
inline constexpr ConditionKind kUnloggableMessages{
    "unloggable_messages",
    Severity::kDegraded,
    "messages came that no log can hold",
    "Another program sends on a channel without a name, or with one of more than 63 bytes. They "
    "are "
    "skipped; the rest is recorded."};
inline constexpr ConditionKind kRecordingsDeleted{
    "recordings_deleted",
    Severity::kDegraded,
    "recordings were deleted to make room",
    "The limits dive_max_mb and disk_min_free_mb of logger.yaml asked for it. Fetch dives and "
    "remove them, or raise the limits."};
inline constexpr ConditionKind kDiskSpaceLow{
    "disk_space_low",
    Severity::kDegraded,
    "the disk has too little room, and nothing is left that may be deleted",
    "Recording goes on until the disk is full. Fetch dives and remove them, or allow delete_logs "
    "in logger.yaml."};
inline constexpr ConditionKind kMessagesNotRecorded{
    "messages_not_recorded",
    Severity::kDegraded,
    "messages are lost from the record",
    "Lost on the way: see socket_drops. For want of room: the disk is too slow, or max_queue_mb "
    "too small."};

// Optimizer.
inline constexpr ConditionKind kGraphIncomplete{
    "graph_incomplete",
    Severity::kDegraded,
    "versions of the graph are missing",
    "They are asked for every few seconds. If it stays, the mapper does not answer."};
inline constexpr ConditionKind kSubmapMalformed{
    "submap_malformed",
    Severity::kDegraded,
    "submaps came malformed and are not in the graph",
    "The map lacks them. Compare the versions of mapper and optimizer."};
inline constexpr ConditionKind kNoSolution{
    "no_solution",
    Severity::kDegraded,
    "the newest version of the graph has no solution",
    "The last solution stands. Send the log with a bug report."};
inline constexpr ConditionKind kSolutionNotConverged{
    "solution_not_converged",
    Severity::kDegraded,
    "the newest solution has not converged",
    "Raise max_iterations in optimizer.yaml. Otherwise send the log with a bug report."};
inline constexpr ConditionKind kNoCovariance{
    "no_covariance",
    Severity::kDegraded,
    "the newest solution does not say how well it is known",
    "Every submap counts as known to unlinked_sigma_m of optimizer.yaml. Something of the graph is "
    "tied to nothing, or sigmas of it are too far apart: send the log with a bug report."};

// Mapper.
inline constexpr ConditionKind kNoBottomLock{
    "no_bottom_lock",
    Severity::kDegraded,
    "the Doppler log has no bottom lock",
    "Normal above its range or over fish. Otherwise check the transducer and the altitude."};
inline constexpr ConditionKind kNavigationNotStarted{
    "navigation_not_started",
    Severity::kDegraded,
    "dead reckoning has not started, so there is no map",
    "The figures name what is missing. Once it comes, the start is a matter of seconds."};
inline constexpr ConditionKind kPlaceUnknown{
    "place_unknown",
    Severity::kDegraded,
    "the map's place is unknown: it is laid out from the datum",
    "One position fix, at any time of the dive, places the whole map. Or state the place of the "
    "start in mapper.yaml: navigation.start_north_m, start_east_m and start_sigma_m, with "
    "start_at_first_fix false."};
inline constexpr ConditionKind kAttitudeRefused{
    "attitude_refused",
    Severity::kDegraded,
    "the attitude disagrees with the rest and is refused",
    "Look at its stamps (a suspected time offset), its alignment, and what magnets or motors are "
    "near a compass."};
inline constexpr ConditionKind kDvlRefused{
    "dvl_refused",
    Severity::kDegraded,
    "the Doppler log has bottom lock, but its velocities are refused",
    "Look at its mounting in vehicle.yaml, its stamps, fish and mud. Counters nav_dvl_ have the "
    "causes. Dead reckoning drifts meanwhile, and its sigma holds that."};
inline constexpr ConditionKind kDepthRefused{"depth_refused",
                                             Severity::kDegraded,
                                             "the depth disagrees with the rest and is refused",
                                             "Check the pressure sensor, its port and its zero."};
inline constexpr ConditionKind kFixesRefused{
    "fixes_refused",
    Severity::kDegraded,
    "position fixes disagree with dead reckoning and are refused",
    "Compare the stated sigma with what the fixes scatter by, and the datum with that of the "
    "fixes."};
inline constexpr ConditionKind kNavigationReset{
    "navigation_reset",
    Severity::kDegraded,
    "dead reckoning was reset to a sensor within the last minute",
    "Its sigma holds the error that was made. Counters nav_..._reset name the sensor, and the "
    "refusals before say since when it disagreed."};
inline constexpr ConditionKind kHeadingStep{"heading_step",
                                            Severity::kDegraded,
                                            "the device's heading stepped within the last minute",
                                            "Dead reckoning weighs both headings until one wins; "
                                            "its sigma holds both. Look at the device's "
                                            "alignment and for magnets or motors near a compass."};
inline constexpr ConditionKind kTimeOffsetSuspected{
    "time_offset_suspected",
    Severity::kDegraded,
    "a sensor's stamps are off",
    "It is corrected for meanwhile. Put the offset into the configuration, or mend the clock; a "
    "recorded log can be replayed with it."};
inline constexpr ConditionKind kInsNotUsable{
    "ins_not_usable",
    Severity::kDegraded,
    "the INS whose navigation is taken as given is not usable",
    "There is no map while it lasts. Look at its alignment, its outputs (position and attitude are "
    "needed, and depth on DEPTH or from it) and the cable."};
inline constexpr ConditionKind kInsJumps{
    "ins_jumps",
    Severity::kDegraded,
    "the position of the INS jumps again and again",
    "Each jump is taken for a fix that it took. Where it takes none, raise "
    "given_navigation.min_jump_m above its noise; where it takes them all the time, set "
    "given_navigation.uses_position_fixes."};
inline constexpr ConditionKind kClockStep{
    "clock_step",
    Severity::kDegraded,
    "a clock stepped within the last minute",
    "The dive goes on by the time before the step, and so do the stamps of what the mapper sends. "
    "Discipline the clock before the dive, and let it run under water."};
inline constexpr ConditionKind kClockDrift{
    "clock_drift",
    Severity::kDegraded,
    "the clock of a sensor drifts away from the others",
    "It is not corrected for beyond what navigation finds as a time offset. Discipline the "
    "sensor's clock (NTP, PTP), or set clock: model in its driver's configuration."};
inline constexpr ConditionKind kSamplesLate{
    "samples_late",
    Severity::kDegraded,
    "samples of a sensor come too late to be used",
    "They come after navigation.reorder_window_s has passed, or their stamps lag. Look for a "
    "machine that is overloaded and at the latency in seastitch doctor; else raise the window."};
inline constexpr ConditionKind kSensorSilent{
    "sensor_silent",
    Severity::kDegraded,
    "a sensor that was there is silent",
    "Normal where it was switched off. Otherwise look at its driver's HEALTH, its power and its "
    "cable."};
inline constexpr ConditionKind kNoNavigation{
    "no_navigation",
    Severity::kLost,
    "there has been no NAV for two seconds",
    "Nothing moves without the inertial unit (or INS). When it comes back the gap is bridged, with "
    "its sigma."};
inline constexpr ConditionKind kNoWaterLevel{
    "no_water_level",
    Severity::kDegraded,
    "the water line is not known within an hour",
    "The nearest entry of the table, or the last height, is used, so that depths are off by what "
    "the tide has changed since; before the first height there is none. Give a table (water_level) "
    "that covers the dive, or an INS whose heights do (ellipsoid_heights)."};
inline constexpr ConditionKind kNoSoundSpeedProfile{
    "no_sound_speed_profile",
    Severity::kDegraded,
    "no sound-speed profile is known",
    "Send one on SVP, or set sound_velocity_profile in mapper.yaml. Outer beams bend without it."};
inline constexpr ConditionKind kRegistrationFailed{
    "registration_failed",
    Severity::kDegraded,
    "registrations of the last submap ended in an error",
    "The survey goes on without these loop closures. Check the memory limit of the mapper's unit."};
inline constexpr ConditionKind kNoOptimizer{
    "no_optimizer",
    Severity::kDegraded,
    "the optimizer is silent and the newest graph is not solved",
    "Start it (systemctl status seastitch-optimizer). It asks for what it lacks; until then the "
    "map "
    "stays as dead reckoning laid it out."};
inline constexpr ConditionKind kSolutionWithheld{
    "solution_withheld",
    Severity::kDegraded,
    "the newest solution is withheld",
    "The map follows the last solution that did no harm. Look at the report's rejected closures."};
inline constexpr ConditionKind kStoreNotWriting{
    "store_not_writing",
    Severity::kDegraded,
    "the survey folder cannot be written",
    "Check the data disk: mounted, writable, not full. Submaps that were not written stay in "
    "memory, up to max_unsaved_mb."};
inline constexpr ConditionKind kMapBegunAnew{
    "map_begun_anew",
    Severity::kDegraded,
    "the dive's map cannot be gone on with: another begins beside it",
    "Both maps stay. Expected after a change of the configuration, where a log is played again, or "
    "after a pause longer than map_resume_within_s. Replay of the dive's log makes one map."};
inline constexpr ConditionKind kJournalDamaged{
    "journal_damaged",
    Severity::kDegraded,
    "a part of the map's journal cannot be read",
    "After a power cut the last entry may be. If more is lost, check the data disk. The map goes "
    "on from what could be read."};

inline constexpr const ConditionKind* kAll[] = {
    &kUndecodableMessages,  &kMessagesNotSent,     &kSocketDrops,          &kLoopLate,
    &kWorkerStalled,        &kDiskStalled,         &kNoDeviceData,         &kSourceUnavailable,
    &kSenderRefused,        &kCanController,       &kLogNotWriting,        &kMessagesNotRecorded,
    &kUnloggableMessages,   &kRecordingsDeleted,   &kDiskSpaceLow,         &kGraphIncomplete,
    &kSubmapMalformed,      &kNoSolution,          &kSolutionNotConverged, &kNoCovariance,
    &kNoBottomLock,         &kDvlRefused,          &kAttitudeRefused,      &kDepthRefused,
    &kFixesRefused,         &kNavigationReset,     &kHeadingStep,          &kTimeOffsetSuspected,
    &kNavigationNotStarted, &kPlaceUnknown,        &kInsNotUsable,         &kInsJumps,
    &kNoWaterLevel,         &kNoSoundSpeedProfile, &kSolutionWithheld,     &kStoreNotWriting,
    &kRegistrationFailed,   &kMapBegunAnew,        &kJournalDamaged,       &kClockStep,
    &kClockDrift,           &kSamplesLate,         &kSensorSilent,         &kNoNavigation,
    &kNoOptimizer,
};

}  // namespace conditions
}  // namespace seastitch
