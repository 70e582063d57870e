#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/archive.hpp"
#include "common/core/pose.hpp"
#include "common/core/sensors.hpp"
#include "common/core/time.hpp"
#include "common/core/vehicle.hpp"
#include "common/geo/map_frame.hpp"
#include "common/parameters/parameters.hpp"
#include "mapper/navigation/fix_keeper.hpp"
#include "mapper/navigation/ins/jump_finder.hpp"
#include "mapper/navigation/nav_events.hpp"
#include "mapper/navigation/navigation.hpp"
#include "mapper/navigation/navigation_params.hpp"

namespace seastitch {

// Accuracy of an INS, from its data sheet.
struct InsNavigationParams {
  // Heading error of samples without a sigma: a constant part and a wandering part.
  double heading_rad = Deg2Rad(0.2);
  GaussMarkov<double> heading_wander_rad{Deg2Rad(0.1), 600.0};
  double distance_ratio = 1e-3;  // error of the distance travelled, over the distance
  // random walk of the position, each axis, per root of the distance
  double random_walk_m_per_rtm = 0.02;
  double position_sigma_m = 3.0;  // for samples without a sigma
  // True: GPS, USBL or beacons correct the INS all the time. Its heading error then does not bend
  // its track, and its position is known.
  bool uses_position_fixes = false;
  double min_jump_m = 0.3;  // a smaller jump of the position counts as motion
  // True: the track follows the INS's velocity, and its position counts only where it jumps.
  bool follow_velocity = false;
};
// Declares the section `given_navigation` of config/mapper.yaml.
void DeclareInsNavigation(InsNavigationParams* params, ParameterTable* table);

// Navigation that an INS (or a file) has computed: its poses, interpolated between samples.
// Position, attitude and depth may be in separate samples, each with its own rate; depth is from
// `DEPTH` if the INS gives none. Attitude and depth are not extrapolated over a gap; the position
// is extrapolated by its velocity for kHoldS, before the first sample and after the last.
//
// A jump of the position means that the INS used a fix. The jump is removed from the track, so that
// no submap is torn, and the position after it is a fix for the graph. For an INS that uses fixes
// all the time, a position is a fix whenever its error has become independent of the last one.
// These fixes, and those of each other source, are grouped by FixKeeper.
//
// Relative covariances are computed from the data sheet's accuracy, exactly for these error models
// (heading error = constant + Gauss-Markov) and for the actual track.
class InsNavigation : public Navigation {
 public:
  static constexpr double kHoldS = 2.0;

  // T_vehicle_imu of `vehicle` is the mounting of the INS.
  InsNavigation(const InsNavigationParams& params,
                const NavigationParams& navigation,
                const VehicleGeometry& vehicle);
  ~InsNavigation() override;

  void Add(const ImuSample&) override {}
  void Add(const DvlSample&) override {}
  void Add(const DepthSample& sample) override;
  void Add(const PositionFix& fix) override;
  void Add(const NavigationSample& sample) override;
  void AddSoundSpeed(Time, double) override {}
  void Finish() override;

  std::optional<Time> latest() const override;
  std::optional<NavState> StateAt(Time t) const override;
  Time AfterGap(Time t) const override;
  // The latest state, which is late by the search for jumps, carried to the newest attitude by the
  // INS's velocities; without these at a constant velocity in vehicle axes.
  std::optional<NavState> Predicted() const override;
  std::optional<Eigen::Matrix3d> RelativeCovariance(Time a, Time b) const override;
  // Identity while both times are in the track, else nothing: an INS does not correct past output.
  std::optional<Pose2> Hindsight(Time anchor, Time t) const override;
  std::vector<MapFix> WaitingFixes() const override { return fixes_.Waiting(); }
  std::vector<MapFix> TakeFixes(Time until) override { return fixes_.Take(until); }
  // About 60 bytes per second since `since`. After Restore() the results are the same, to the last
  // bit, as without a restart; only the track since `since`, with which errors grow, has a
  // resolution of a second.
  std::optional<std::vector<std::uint8_t>> Save(std::optional<Time> since) const override;
  bool Restore(Bytes saved) override;
  StartState start_state() const override;
  bool place_is_known() const override { return true; }
  // An INS monitors its own sensors.
  NavSensorHealth health(NavSensor) const override { return {}; }
  std::vector<SuspectedOffset> suspected_offsets() const override { return {}; }
  const NavTally& tally() const override { return tally_; }

 private:
  void AddFix(Time t, FixEvent fix);
  void KeepFixes();
  void KeepFix(Time t, const FixEvent& fix);
  struct AttitudeRecord {
    Time time;
    Eigen::Quaterniond q_map_vehicle;
    double heading_sigma_rad;  // 0: not stated

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.q_map_vehicle, self.heading_sigma_rad);
    }
  };
  struct DepthRecord {
    Time time;
    double depth_m;
    Eigen::Vector3d p_vehicle_sensor_m;

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.depth_m, self.p_vehicle_sensor_m);
    }
  };
  struct Place {
    Time time;
    Eigen::Vector2d p_map;      // of the vehicle, jumps removed
    Eigen::Vector2d v_map_mps;  // NaN: unknown
    double sigma_m;             // sigma of the INS's position
    double travelled_m;         // distance since the start
    double jump_variance_m2;    // of all jumps since the start, each axis

    template <class Archive, class Self>
    static void Fields(Archive& archive, Self& self) {
      archive(self.time, self.p_map, self.v_map_mps, self.sigma_m, self.travelled_m);
      archive(self.jump_variance_m2);
    }
  };
  // Heading error of an INS: autocovariance over time.
  struct HeadingError {
    double constant2;
    double wander2;
    double tau_s;
    double Covariance(Time s, Time t) const;
  };

  void Count(const std::string& name, std::int64_t n = 1) { tally_.Count(name, n); }
  void AddAttitude(const NavigationSample& sample);
  void AddDepth(Time t, double depth_m, const Eigen::Vector3d& p_vehicle_sensor_m);
  void AddPosition(const NavigationSample& sample);
  void Proceed(bool finish);
  void AddPlace(const JumpFinder::Steady& steady);
  void GiveFix(const JumpFinder::Steady& steady);
  void Trim();

  std::optional<AttitudeRecord> AttitudeAt(Time t) const;
  std::optional<double> DepthAt(Time t, const Eigen::Quaterniond& q_map_vehicle) const;
  std::optional<Place> PlaceAt(Time t) const;
  std::optional<Place> BeforeFirst(Time t) const;
  void CarryTo(Time t, const std::optional<Eigen::Vector2d>& v_map_mps, NavState* state) const;
  HeadingError HeadingErrorAt(double own_sigma_rad) const;

  // For saving and restoring over a restart.
  template <class Archive>
  static void History(Archive& archive,
                      Of<Archive, std::deque<AttitudeRecord>>& attitudes,
                      Of<Archive, std::deque<DepthRecord>>& depths,
                      Of<Archive, std::deque<Place>>& places) {
    archive(attitudes, depths, places);
  }
  // Not saved: params_, navigation_, vehicle_ and to_map_, which are configured; tally_, which
  // are of one process; attitudes_, depths_ and places_, of which History() has a part; finished_,
  // which a restart is not; ins_depth_at_, which the next depth sets.
  template <class Archive, class Self>
  static void Fields(Archive& archive, Self& self) {
    archive(
        self.positions_, self.last_position_, self.jumps_, self.first_, self.travelled_at_fix_m_);
    archive(self.early_fixes_, self.fixes_, self.ins_gives_depth_);
  }

  const InsNavigationParams params_;
  const NavigationParams navigation_;
  const VehicleGeometry vehicle_;
  const MapFrame map_frame_;
  NavTally tally_;

  std::deque<AttitudeRecord> attitudes_;
  std::deque<DepthRecord> depths_;
  std::deque<JumpFinder::Position> positions_;  // positions of the INS that wait for an attitude
  std::optional<Time> last_position_;
  JumpFinder jumps_;
  std::deque<Place> places_;
  std::optional<Place> first_;
  double travelled_at_fix_m_ = 0.0;            // travelled_m at the last fix for the graph
  std::deque<Stamped<FixEvent>> early_fixes_;  // of no known pose yet, in order of time
  FixKeeper fixes_{navigation_, &tally_};
  bool ins_gives_depth_ = false;
  std::optional<Time> ins_depth_at_;  // the last; not saved
  bool finished_ = false;
};

}  // namespace seastitch
