#include <cstdlib>

#include "drivers/imu/imu_can.hpp"
#include "tests/fuzz/can_input.hpp"

namespace {

using namespace seastitch;

ImuCanParams Shipped(DeviceClock clock) {
  const Dbc dbc = Dbc::Load(SEASTITCH_SOURCE_DIR "/config/sbg_ecan.dbc");
  // In the order of ImuField.
  const std::vector<std::string> signals = {"IMU_INFO.TIME_STAMP",
                                            "EKF_INFO.TIME_STAMP",
                                            "IMU_GYRO.GYRO_X",
                                            "IMU_GYRO.GYRO_Y",
                                            "IMU_GYRO.GYRO_Z",
                                            "IMU_ACCEL.ACCEL_X",
                                            "IMU_ACCEL.ACCEL_Y",
                                            "IMU_ACCEL.ACCEL_Z",
                                            "EKF_EULER.ROLL",
                                            "EKF_EULER.PITCH",
                                            "EKF_EULER.YAW",
                                            "EKF_ORIENTATION_ACC.ROLL_ACC",
                                            "EKF_ORIENTATION_ACC.PITCH_ACC",
                                            "EKF_ORIENTATION_ACC.YAW_ACC",
                                            "UTC_0.TIME_STAMP",
                                            "UTC_0.GPS_TOW",
                                            "UTC_1.YEAR",
                                            "UTC_1.MONTH",
                                            "UTC_1.DAY",
                                            "UTC_1.HOUR",
                                            "UTC_1.MIN",
                                            "UTC_1.SEC",
                                            "UTC_1.MICRO_SEC"};
  ImuCanParams params;
  for (std::size_t field = 0; field < signals.size(); ++field)
    params.signals.Assign(dbc, field, signals[field]);
  params.clock.clock = clock;
  return params;
}

void Check(const std::optional<ImuSample>& sample) {
  if (!sample) return;
  const bool finite = sample->angular_rate_radps.allFinite() &&
                      sample->specific_force_mps2.allFinite() &&
                      (!sample->attitude || (sample->attitude->q_ned_imu.coeffs().allFinite() &&
                                             sample->attitude->sigma_rpy_rad.allFinite()));
  if (!finite) std::abort();
}

}  // namespace

// The first byte chooses the clock, the others are frames.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ImuCanParams params[] = {Shipped(DeviceClock::kDevice),
                                        Shipped(DeviceClock::kModel)};
  static const std::vector<CanFilter> ids = params[0].signals.Filters();
  if (size == 0) return 0;
  ImuCanDecoder decoder(params[data[0] % 2]);
  for (const ReceivedFrame& received : FramesOf(Bytes(data + 1, size - 1), ids))
    Check(decoder.Add(received.frame, received.recv));
  Check(decoder.Finish());
  return 0;
}
