#include <cstdlib>

#include "drivers/imu/imu_can.hpp"
#include "tests/fuzz/can_input.hpp"

namespace {

using namespace seastitch;

// In the order of ImuField.
const std::vector<std::string> kSignals = {"IMU_INFO.TIME_STAMP",
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

void Check(const std::optional<ImuSample>& sample) {
  if (!sample) return;
  const bool finite = sample->angular_rate_radps.allFinite() &&
                      sample->specific_force_mps2.allFinite() &&
                      (!sample->attitude || (sample->attitude->q_ned_imu.coeffs().allFinite() &&
                                             sample->attitude->sigma_rpy_rad.allFinite()));
  if (!finite) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto device =
      ShippedParams<ImuCanParams>("sbg_ecan.dbc", kSignals, DeviceClock::kDevice);
  static const auto model =
      ShippedParams<ImuCanParams>("sbg_ecan.dbc", kSignals, DeviceClock::kModel);
  DecodeFrames<ImuCanDecoder>(Bytes(data, size), device, model, Check);
  return 0;
}
