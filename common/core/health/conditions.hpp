#pragma once

#include "common/core/health/condition_kind.hpp"

namespace seastitch {

// All types of faults, grouped by the component that detects them.
namespace conditions {

// Every process (common/runtime/process/self_watch.hpp).
inline constexpr ConditionKind kUndecodableMessages{
    "undecodable_messages",
    Severity::kDegraded,
    "messages do not have the type of their channel",
    "Another program, or another version, sends on this channel. The messages are skipped. Compare "
    "the versions of all processes in HEALTH, and check which channels other programs use.",
    kEventOfProcess};
inline constexpr ConditionKind kMessagesNotSent{
    "messages_not_sent",
    Severity::kDegraded,
    "messages cannot be sent on the LCM bus",
    "Check the interface and the multicast route that LCM uses (systemctl status lcm-loopback).",
    kEventOfProcess};
inline constexpr ConditionKind kSocketDrops{
    "socket_drops",
    Severity::kDegraded,
    "the kernel dropped datagrams because the receive buffer was full",
    "Raise net.core.rmem_max (sysctl.d/60-seastitch.conf) and restart. If it has the value of that "
    "file already, the machine is overloaded: see loop_late.",
    kEventOfProcess};
inline constexpr ConditionKind kLoopLate{
    "loop_late",
    Severity::kDegraded,
    "the event loop was busy for too long",
    "The machine is overloaded, or swaps. Messages wait and may be lost meanwhile. End other "
    "programs, or give the machine more memory.",
    kEventOfProcess};
inline constexpr ConditionKind kWorkerStalled{
    "worker_stalled",
    Severity::kDegraded,
    "a computation shows no progress",
    "Normal for some seconds on a slow machine. If the fault stays, the disk does not respond, or "
    "the process needs a restart."};
inline constexpr ConditionKind kDiskStalled{"disk_stalled",
                                            Severity::kDegraded,
                                            "writing to the disk takes too long",
                                            "Check the data disk and the kernel's log. Data wait "
                                            "in memory and are written when the disk responds."};

// Drivers.
inline constexpr ConditionKind kNoDeviceData{
    "no_device_data",
    Severity::kLost,
    "no usable data from the device",
    "Check its power, its cable and `source` in the driver's configuration. Data that come but "
    "are rejected are in the counters, by reason."};
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
    "A driver accepts datagrams only from the first sender that it heard. If the device sends "
    "from several addresses, list them in the driver's `source` (?from=10.0.0.5,10.0.0.6). Keep "
    "other senders off the sensors' network.",
    kEventOfProcess};
inline constexpr ConditionKind kCanController{
    "can_controller",
    Severity::kDegraded,
    "the CAN controller sees errors on the wire",
    "Check bit rate, termination and wiring, and that another node acknowledges."};

// NAV for others (drivers/output).
inline constexpr ConditionKind kNavNotHeard{
    "nav_not_heard",
    Severity::kLost,
    "no navigation is heard, and nothing is sent",
    "The mapper does not run, waits for its sensors, or sends the other of NAV and NAV_CORRECTED: "
    "seastitch status says which. The receiver of the sentences sees a receiver without data."};
inline constexpr ConditionKind kPositionNotSent{
    "position_not_sent",
    Severity::kDegraded,
    "the position is too uncertain to be sent",
    "Its sigma is above position_sigma_max_m of nav_output.yaml. GGA has quality 0 until a "
    "position fix, or a start stated in mapper.yaml, tells the mapper where the vehicle is."};
inline constexpr ConditionKind kOutputUnavailable{
    "output_unavailable",
    Severity::kDegraded,
    "sentences cannot be sent",
    "Check the port and its cable. Not permitted: the service may reach only this computer; allow "
    "the address in a drop-in (docs/listening.md). Fewer bytes than are sent: raise the port's "
    "rate, or lower the rates in nav_output.yaml. The process tries again every second."};

// Logger.
inline constexpr ConditionKind kLogNotWriting{
    "log_not_writing",
    Severity::kDegraded,
    "the log cannot be written",
    "Check the data disk: mounted, writable, not full. Messages wait in memory, up to "
    "max_queue_mb. "
    "Further messages are lost and counted in events_dropped."};
inline constexpr ConditionKind kLogVanished{
    "log_vanished",
    Severity::kDegraded,
    "the file that was written was deleted, or another disk hides it",
    "What it held is lost, or below the mount point. A new file was begun if the data disk is "
    "there: "
    "see log_not_writing. Mount the data disk, and delete no dive that is being recorded.",
    kEventOfProcess};
inline constexpr ConditionKind kDiveDamaged{
    "dive_damaged",
    Severity::kDegraded,
    "the record of the last dive cannot be read: it is not continued",
    "Its recordings and its map stay where they are. `seastitch replay` of both folders together "
    "makes one map. Check the data disk."};
inline constexpr ConditionKind kUnloggableMessages{
    "unloggable_messages",
    Severity::kDegraded,
    "messages came that cannot be stored in a log",
    "Another program sends on a channel whose name is empty or longer than 63 bytes. These "
    "messages "
    "are skipped; all others are recorded.",
    kEventOfProcess};
inline constexpr ConditionKind kRecordingsDeleted{
    "recordings_deleted",
    Severity::kDegraded,
    "recordings were deleted to make room",
    "A limit of logger.yaml was exceeded: dive_max_mb or disk_min_free_mb. Copy dives off the "
    "vehicle and delete them there, or change the limits.",
    kEventOfProcess};
inline constexpr ConditionKind kDiskSpaceLow{
    "disk_space_low",
    Severity::kDegraded,
    "the disk has too little free space, and no file is left that may be deleted",
    "Recording goes on until the disk is full. Copy dives off the vehicle and delete them there, "
    "or "
    "allow delete_logs in logger.yaml."};
inline constexpr ConditionKind kMessagesNotRecorded{
    "messages_not_recorded",
    Severity::kDegraded,
    "messages are missing in the log",
    "Lost before the logger: see socket_drops. Lost because the queue was full: the disk is too "
    "slow, or max_queue_mb is too small.",
    kEventOfProcess};

// Optimizer.
inline constexpr ConditionKind kGraphIncomplete{
    "graph_incomplete",
    Severity::kDegraded,
    "updates of the graph are missing",
    "The optimizer requests them from the mapper every few seconds. If the fault stays, the mapper "
    "does not answer: check its HEALTH."};
inline constexpr ConditionKind kSubmapMalformed{
    "submap_malformed",
    Severity::kDegraded,
    "submaps were malformed and are not in the graph",
    "The corrected map lacks them. Compare the versions of mapper and optimizer in HEALTH."};
inline constexpr ConditionKind kFixesContradictMap{
    "fixes_contradict_map",
    Severity::kDegraded,
    "most position fixes contradict the map and are refused",
    "Compare the stated sigma with the scatter of the fixes, check that they are WGS 84, and check "
    "the "
    "mounting of the antenna or transponder in vehicle.yaml. The place of the map rests on the "
    "others."};
inline constexpr ConditionKind kTwoMappers{"two_mappers",
                                           Severity::kDegraded,
                                           "two mappers send graphs",
                                           "End one of them. The optimizer serves the one that it "
                                           "followed first, until that is silent for "
                                           "10 s."};
inline constexpr ConditionKind kNoSolution{
    "no_solution",
    Severity::kDegraded,
    "the newest version of the graph could not be solved",
    "The previous solution stays in use. Send the log with a bug report."};
inline constexpr ConditionKind kSolutionNotConverged{
    "solution_not_converged",
    Severity::kDegraded,
    "the newest solution has not converged",
    "Raise max_iterations in optimizer.yaml. Otherwise send the log with a bug report."};
inline constexpr ConditionKind kNoCovariance{
    "no_covariance",
    Severity::kDegraded,
    "the covariance of the newest solution could not be computed",
    "Every submap has the sigma unlinked_sigma_m of optimizer.yaml instead. A part of the graph is "
    "unconstrained, or the graph is ill-conditioned: send the log with a bug report."};

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
    "The text after the fault names what is missing. When that comes, dead reckoning starts within "
    "seconds."};
inline constexpr ConditionKind kPlaceUnknown{
    "place_unknown",
    Severity::kDegraded,
    "the map's position is unknown: it starts at the datum",
    "One position fix, at any time of the dive, positions the whole map and NAV_CORRECTED. NAV "
    "keeps its sigma of 1 km. Or state the position of the start in mapper.yaml: "
    "navigation.start_north_m, start_east_m and start_sigma_m, with start_at_first_fix false."};
inline constexpr ConditionKind kAttitudeRefused{
    "attitude_refused",
    Severity::kDegraded,
    "the attitude disagrees with the other sensors and is refused",
    "Look at its stamps (a suspected time offset), its alignment, and what magnets or motors are "
    "near a compass."};
inline constexpr ConditionKind kImuTooSlow{
    "imu_too_slow",
    Severity::kDegraded,
    "inertial samples come too seldom, or with holes",
    "Dead reckoning is less accurate: it integrates a slow unit with the Doppler log's help, and "
    "bridges each hole without it. Raise the unit's output rate (50 Hz or more), and look for lost "
    "messages: counters imu_lost and can_frames_dropped."};
inline constexpr ConditionKind kDvlRefused{
    "dvl_refused",
    Severity::kDegraded,
    "the Doppler log has bottom lock, but its velocities are refused",
    "Check its mounting in vehicle.yaml and its stamps; fish and mud cause it, too. Counters "
    "nav_dvl_ have the reasons. Dead reckoning drifts meanwhile, and its sigma grows accordingly."};
inline constexpr ConditionKind kAttitudeFrozen{
    "attitude_frozen",
    Severity::kDegraded,
    "the attitude repeats its value while the vehicle turns, and is not used",
    "Dead reckoning goes on with the gyros, and its sigma of heading grows. Check the attitude "
    "output of the inertial unit, or restart the unit."};
inline constexpr ConditionKind kAttitudeSilent{
    "attitude_silent",
    Severity::kDegraded,
    "the inertial unit sends rates, but no attitude any more",
    "Dead reckoning goes on with the gyros, and its sigma of heading grows. Check the attitude "
    "output of the inertial unit."};
inline constexpr ConditionKind kGyroDoubted{
    "gyro_doubted",
    Severity::kDegraded,
    "the gyros contradict the attitude and are not used",
    "Dead reckoning follows the attitude instead. The gyros are stuck or damaged, or the stamps of "
    "the attitude are wrong (a suspected time offset)."};
inline constexpr ConditionKind kAccelerometerDoubted{
    "accelerometer_doubted",
    Severity::kDegraded,
    "the accelerometers contradict the other sensors and are not used",
    "Velocity is that of the Doppler log, and without bottom lock the last one. The accelerometers "
    "are stuck or damaged, or roll, pitch or the stamps of the Doppler log are wrong."};
inline constexpr ConditionKind kDepthRefused{
    "depth_refused",
    Severity::kDegraded,
    "the depth disagrees with the other sensors and is refused",
    "Check the pressure sensor, its port and its zero."};
inline constexpr ConditionKind kFixesRefused{
    "fixes_refused",
    Severity::kDegraded,
    "position fixes disagree with dead reckoning and are refused",
    "Compare the stated sigma with the scatter of the fixes, and check that the fixes are WGS 84."};
inline constexpr ConditionKind kPlaceFromOneFix{
    "place_from_one_fix",
    Severity::kDegraded,
    "the place of the map rests on a single position fix",
    "Nothing shows whether that fix is right. Give the vehicle another fix, at the surface or by "
    "USBL: "
    "the map is moved as a whole then."};
inline constexpr ConditionKind kNavigationReset{
    "navigation_reset",
    Severity::kDegraded,
    "dead reckoning was reset to a sensor within the last minute",
    "Its sigma includes the error before the reset. Counters nav_..._reset name the sensor; the "
    "counts of refusals before show since when it disagreed.",
    kEventOfDive};
inline constexpr ConditionKind kHeadingStep{"heading_step",
                                            Severity::kDegraded,
                                            "the device's heading stepped within the last minute",
                                            "Dead reckoning keeps both headings until the data "
                                            "decide; its sigma covers both. Check the device's "
                                            "alignment, and magnets or motors near a compass.",
                                            kEventOfDive};
inline constexpr ConditionKind kTimeOffsetSuspected{
    "time_offset_suspected",
    Severity::kDegraded,
    "a sensor's time stamps are wrong",
    "Write the offset into the configuration, or correct the clock. Dead reckoning corrects stamps "
    "that are late meanwhile, but not early ones. A recorded log can be replayed with the offset "
    "configured."};
inline constexpr ConditionKind kInsNotUsable{
    "ins_not_usable",
    Severity::kDegraded,
    "the INS whose navigation is taken as given is not usable",
    "There is no map meanwhile. Check its alignment, its cable and its outputs: position and "
    "attitude are required, and depth from it or on DEPTH."};
inline constexpr ConditionKind kInsJumps{
    "ins_jumps",
    Severity::kDegraded,
    "the position of the INS jumps again and again",
    "Each jump is taken for a position fix that the INS used. If it uses none, raise "
    "given_navigation.min_jump_m above its noise. If it uses fixes all the time, set "
    "given_navigation.uses_position_fixes.",
    {.holds_s = 60.0, .fewest = 5}};  // an INS that takes a fix now and then has fewer
inline constexpr ConditionKind kClockStep{
    "clock_step",
    Severity::kDegraded,
    "a clock stepped within the last minute",
    "Unless the text says that the clock came right, the dive continues with the time before the "
    "step, also in the stamps of the mapper's messages. Synchronise the clock before the dive, and "
    "do not step it under water.",
    kEventOfDive};
inline constexpr ConditionKind kDvlTurned{
    "dvl_turned",
    Severity::kDegraded,
    "the Doppler log is turned about the vertical",
    "Against the inertial unit its angle is more than 4 sigma beyond dvl_mounting_deg. The stated "
    "position sigma does not cover it. Correct the yaw of dvl in vehicle.yaml before the next "
    "dive; a replay with it makes this map right."};
inline constexpr ConditionKind kFixClock{
    "fix_clock",
    Severity::kDegraded,
    "position fixes have the time of another clock than the other sensors",
    "GPS time in place of UTC is 18 s ahead; a receiver whose week count overflowed is 1024 weeks "
    "back. Such fixes are refused, or move the map. Set clock: model or receive for their source "
    "in "
    "nav_driver.yaml, or correct the receiver."};
inline constexpr ConditionKind kClockDrift{
    "clock_drift",
    Severity::kDegraded,
    "the clock of a sensor drifts away from the others",
    "Only the time offset that navigation estimates is corrected. Synchronise the sensor's clock "
    "(NTP, PTP), or set clock: model in its driver's configuration."};
inline constexpr ConditionKind kSamplesLate{
    "samples_late",
    Severity::kDegraded,
    "samples of a sensor come too late to be used",
    "They come later than navigation.reorder_window_s, or their stamps are too old. Check whether "
    "the machine is overloaded, and the latency in seastitch doctor; else raise the window.",
    {.holds_s = 60.0, .fewest = 10}};  // a few are no fault
inline constexpr ConditionKind kTwoSenders{
    "two_senders",
    Severity::kDegraded,
    "two senders send the same kind of message",
    "A second driver, another vehicle or a player of logs is on this bus. The mapper uses the one "
    "that "
    "it heard first, and the other one when that is silent. End the other one.",
    {.holds_s = 10.0, .fewest = 10, .within_s = 30.0}};  // one that is restarted has fewer
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
    "Dead reckoning stops without the inertial unit (or INS): check its driver. When its data come "
    "back, the gap is bridged, and the sigma grows accordingly."};
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
    "Send one on SVP, or set sound_velocity_profile in mapper.yaml. Without it the depths of outer "
    "beams are wrong."};
inline constexpr ConditionKind kRegistrationFailed{
    "registration_failed",
    Severity::kDegraded,
    "registrations of the last submap ended in an error",
    "The survey goes on without these loop closures. Check the memory limit of the mapper's unit."};
inline constexpr ConditionKind kPingsRefused{
    "pings_refused",
    Severity::kDegraded,
    "pings are refused, so that no submap has them",
    "The text after the fault has the commonest reason. Stamped ahead of navigation, or out of "
    "order: check the sonar's clock, and its latency in seastitch doctor. Without a pose: "
    "navigation had a gap, or the sonar's clock is wrong."};
inline constexpr ConditionKind kMessagesMalformed{
    "messages_malformed",
    Severity::kDegraded,
    "messages hold values that cannot be used",
    "Such as a number that is not finite. The messages are skipped. Check the sensor, and compare "
    "the versions of its driver and the mapper in HEALTH.",
    kEventOfProcess};
inline constexpr ConditionKind kProcessSilent{
    "process_silent",
    Severity::kDegraded,
    "a process that was there is silent",
    "Normal where it was stopped. Otherwise it has crashed or hangs, and systemd restarts it: look "
    "at systemctl status seastitch-NAME."};
inline constexpr ConditionKind kNoOptimizer{
    "no_optimizer",
    Severity::kDegraded,
    "the newest graph is not solved",
    "Start the optimizer (systemctl status seastitch-optimizer). It requests the whole graph from "
    "the "
    "mapper. If it runs, it solves another mapper's graph, or takes very long: see its HEALTH. "
    "Until "
    "then new submaps stay dead reckoned."};
inline constexpr ConditionKind kSolutionWithheld{
    "solution_withheld",
    Severity::kDegraded,
    "the newest solution is withheld",
    "Overlapping submaps would agree less with it. The map stays at the last solution that was not "
    "withheld. Look at the rejected closures in the report of a replay."};
inline constexpr ConditionKind kSolutionsRefused{
    "solutions_refused",
    Severity::kDegraded,
    "the newest solution cannot be used",
    "The map stays at the last solution that could be used. Check that only one mapper and one "
    "optimizer run, and compare their versions in HEALTH."};
inline constexpr ConditionKind kStoreNotWriting{
    "store_not_writing",
    Severity::kDegraded,
    "the survey folder cannot be written",
    "Check the data disk: mounted, writable, not full. Submaps that were not written stay in "
    "memory, up to max_unsaved_mb."};
inline constexpr ConditionKind kTimeWentBack{
    "time_went_back",
    Severity::kLost,
    "the time of the sensors went back",
    "A log is played again, from an earlier place, or after a later one. Once all sensors agree on "
    "it, the mapper ends its map and begins a new one in the same dive. With real sensors: the "
    "clock that they are all set by was set back."};
inline constexpr ConditionKind kMapInMemory{
    "map_in_memory",
    Severity::kDegraded,
    "the data disk cannot be used, and the map is kept in memory",
    "Navigation and the live map work; what the logger does not record is lost when the computer "
    "stops. Mount the data disk, or mend dives_dir, and restart the mapper: it begins a map "
    "there."};
inline constexpr ConditionKind kMapBegunAnew{
    "map_begun_anew",
    Severity::kDegraded,
    "the dive's map cannot be continued: another map begins beside it",
    "Both maps are kept. Expected after a change of the configuration, when a log is played again, "
    "or after a pause longer than map_resume_within_s. A replay of the dive's log makes one map."};
inline constexpr ConditionKind kJournalDamaged{"journal_damaged",
                                               Severity::kDegraded,
                                               "a part of the map's journal cannot be read",
                                               "After a power cut the last entry may be damaged. "
                                               "If more is lost, check the data disk. The map "
                                               "continues from what could be read."};

inline constexpr ConditionKind kPointsLost{
    "points_lost",
    Severity::kDegraded,
    "points of closed submaps are lost",
    "The poses of these submaps stay in the graph. Check the data disk. A replay of the dive's log "
    "makes the points again."};

inline constexpr const ConditionKind* kAll[] = {
    &kUndecodableMessages,
    &kMessagesNotSent,
    &kSocketDrops,
    &kLoopLate,
    &kWorkerStalled,
    &kDiskStalled,
    &kNoDeviceData,
    &kSourceUnavailable,
    &kSenderRefused,
    &kCanController,
    &kNavNotHeard,
    &kPositionNotSent,
    &kOutputUnavailable,
    &kLogNotWriting,
    &kMessagesNotRecorded,
    &kLogVanished,
    &kUnloggableMessages,
    &kRecordingsDeleted,
    &kDiskSpaceLow,
    &kGraphIncomplete,
    &kSubmapMalformed,
    &kTwoMappers,
    &kFixesContradictMap,
    &kNoSolution,
    &kSolutionNotConverged,
    &kNoCovariance,
    &kNoBottomLock,
    &kImuTooSlow,
    &kDvlRefused,
    &kAccelerometerDoubted,
    &kAttitudeRefused,
    &kAttitudeFrozen,
    &kAttitudeSilent,
    &kGyroDoubted,
    &kDepthRefused,
    &kFixesRefused,
    &kPlaceFromOneFix,
    &kNavigationReset,
    &kHeadingStep,
    &kTimeOffsetSuspected,
    &kNavigationNotStarted,
    &kPlaceUnknown,
    &kInsNotUsable,
    &kInsJumps,
    &kNoWaterLevel,
    &kNoSoundSpeedProfile,
    &kSolutionWithheld,
    &kSolutionsRefused,
    &kStoreNotWriting,
    &kRegistrationFailed,
    &kTimeWentBack,
    &kMapInMemory,
    &kMapBegunAnew,
    &kJournalDamaged,
    &kPointsLost,
    &kClockStep,
    &kDiveDamaged,
    &kDvlTurned,
    &kFixClock,
    &kClockDrift,
    &kSamplesLate,
    &kPingsRefused,
    &kMessagesMalformed,
    &kTwoSenders,
    &kSensorSilent,
    &kNoNavigation,
    &kProcessSilent,
    &kNoOptimizer,
};

}  // namespace conditions
}  // namespace seastitch
