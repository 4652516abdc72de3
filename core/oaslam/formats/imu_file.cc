#include "oaslam/formats/imu_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>

#include "oaslam/formats/imu_mending.h"
#include "oaslam/formats/imu_table.h"
#include "oaslam/geometry/angular_velocity_check.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

struct ImuFiles {
  std::string gyroscope, accelerometer;  // the second is empty where one file has both
};

std::string FirstIn(const fs::path& folder, std::initializer_list<const char*> names) {
  std::error_code error;
  for (const char* name : names)
    if (fs::is_regular_file(folder / name, error)) return (folder / name).string();
  return "";
}

ImuFiles FilesOf(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    const size_t comma = path.find(',');
    if (comma == std::string::npos || fs::exists(path, error)) return {path, ""};
    return {path.substr(0, comma), path.substr(comma + 1)};
  }
  const std::string both =
      FirstIn(path, {"gyro_accel.csv", "imu.csv", "imu0.csv", "imu0/data.csv", "data.csv"});
  if (!both.empty()) return {both, ""};
  const std::string gyroscope = FirstIn(path, {"Gyroscope.csv", "GyroscopeUncalibrated.csv",
                                               "gyroscope.csv", "Gyro.csv", "gyro.csv"});
  if (gyroscope.empty())
    throw BadInput(
        "{}: a folder without an IMU, expected gyro_accel.csv, imu.csv, imu0.csv, data.csv, or "
        "Gyroscope.csv beside TotalAcceleration.csv; give its file",
        path);
  // Sensor Logger's Accelerometer.csv is without gravity, others' are with it.
  return {gyroscope,
          FirstIn(path, {"TotalAcceleration.csv", "AccelerometerUncalibrated.csv",
                         "Accelerometer.csv", "accelerometer.csv", "Accel.csv", "accel.csv"})};
}

void CheckRates(const SensorSeries& gyroscope, const std::string& path) {
  for (size_t i = 0; i < gyroscope.times.size(); ++i)
    if (const std::string problem = ProblemOf({gyroscope.times[i], gyroscope.values[i]}, nullptr);
        !problem.empty())
      throw BadInput("{}:{}: {}", path, gyroscope.lines[i], problem);
}

void CheckAccelerations(const SensorSeries& accelerometer, const std::string& path) {
  for (size_t i = 0; i < accelerometer.times.size(); ++i)
    if (const std::string problem = ProblemOfAcceleration(accelerometer.values[i]);
        !problem.empty())
      throw BadInput("{}:{}: {}", path, accelerometer.lines[i], problem);
}

}  // namespace

ImuRecording LoadImu(const std::string& path) {
  ImuFiles files = FilesOf(path);
  ImuTable table = LoadImuTable(files.gyroscope);
  if (!files.accelerometer.empty()) {
    ImuTable second = LoadImuTable(files.accelerometer);
    if (table.gyroscope.times.empty()) {  // given the other way round
      std::swap(table, second);
      std::swap(files.gyroscope, files.accelerometer);
    }
    table.accelerometer = std::move(second.accelerometer);
    table.is_toward_ground = second.is_toward_ground;
    std::ranges::move(second.notes, std::back_inserter(table.notes));
  }
  if (table.gyroscope.times.empty())
    throw BadInput("{}: no gyroscope in it; give both files: GYROSCOPE.csv,ACCELEROMETER.csv",
                   path);
  return MendImu(
      std::move(table),
      {files.gyroscope, files.accelerometer.empty() ? files.gyroscope : files.accelerometer});
}

ImuRecording MendImu(ImuTable table, const ImuPaths& paths) {
  auto& [gyroscope, accelerometer, is_toward_ground, notes] = table;
  // What is wrong with the rows of one file is said once.
  const bool is_one =
      accelerometer.lines == gyroscope.lines && paths.accelerometer == paths.gyroscope;
  std::vector<std::string> said;
  LeaveOutDisorder(is_one ? "IMU" : "gyroscope", gyroscope, notes);
  LeaveOutDisorder("accelerometer", accelerometer, is_one ? said : notes);
  ToRadians(gyroscope, notes);
  CheckRates(gyroscope, paths.gyroscope);
  ToMetres(accelerometer, notes);
  CheckAccelerations(accelerometer, paths.accelerometer);
  constexpr double kTurns = 0.1, kShakes = 0.5;  // rad/s, m/s^2; far above the noise of a phone
  const SensorSeries all_rates = gyroscope;
  LeaveOutStuck("gyroscope", accelerometer, kShakes, gyroscope, notes);
  LeaveOutStuck("accelerometer", all_rates, kTurns, accelerometer, notes);
  if (is_toward_ground)
    for (Eigen::Vector3d& value : accelerometer.values) value = -value;
  ImuRecording recording;
  recording.samples = Joined(gyroscope, accelerometer);
  recording.has_acceleration = !recording.samples.empty();
  if (!recording.has_acceleration) {
    if (!accelerometer.times.empty() && !gyroscope.times.empty())
      notes.push_back("accelerometer: its times are not those of the gyroscope: not used");
    for (size_t i = 0; i < gyroscope.times.size(); ++i)
      recording.samples.push_back({gyroscope.times[i], gyroscope.values[i]});
  }
  if (std::string gaps = GapsOf(recording.samples); !gaps.empty()) notes.push_back(std::move(gaps));
  recording.notes = std::move(notes);
  return recording;
}

}  // namespace oaslam
