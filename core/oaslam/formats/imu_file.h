#pragma once

#include <string>
#include <vector>

#include "oaslam/formats/imu_table.h"
#include "oaslam/imu.h"

namespace oaslam {

// The samples of an IMU along its own axes.
struct ImuRecording {
  std::vector<ImuSample> samples;  // ascending in time; empty: the gyroscope cannot be used
  bool has_acceleration = false;   // else only angular velocities are known
  std::vector<std::string> notes;  // what was wrong, and what was done, a sentence each
};

// Reads a recording of an IMU or of a gyroscope (docs/imu.md): one file, two with a comma between
// them ("gyro.csv,accel.csv"), or a folder in which a recorder's files have their own names. Of two
// sensors, the accelerations are interpolated at the gyroscope's times. What is wrong and can be
// mended is mended. Throws InputError, with path, line, value and bound, where nothing can be done:
// a number is missing, the spacing of the samples is in no unit 0.1 ms to 0.1 s, a value is beyond
// what any sensor measures, or there is no gyroscope.
ImuRecording LoadImu(const std::string& path);

// The same of samples that were read already; `path` is where they were, of the gyroscope and the
// accelerometer, for messages.
struct ImuPaths {
  std::string gyroscope, accelerometer;
};
ImuRecording MendImu(ImuTable table, const ImuPaths& paths);

}  // namespace oaslam
