#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace oaslam {

// The samples of one sensor of three axes, as its file has them.
struct SensorSeries {
  std::vector<double> times;            // seconds
  std::vector<Eigen::Vector3d> values;  // in the unit of the file
  std::vector<size_t> lines;            // of the file
  std::string unit;                     // as the header has it; empty: it has none
};

// A file of a gyroscope, an accelerometer, or both.
struct ImuTable {
  SensorSeries gyroscope, accelerometer;  // empty: not in it
  // Apple's sign: a device at rest measures gravity, not the force against it.
  bool is_toward_ground = false;
  std::vector<std::string> notes;  // on what was recognised against the header, a sentence each
};

// Reads a table whose fields are separated by commas, semicolons or blanks. The names of a header
// tell the columns; without one they are a time stamp, the angular velocity and, in the fifth to
// seventh, the acceleration (in a file named by an accelerometer, that alone). A row may lack the
// three values of one sensor. The unit of time (s, ms, us, ns) is that of the header if the spacing
// of the samples can be in it, else the one in which it is 0.1 ms to 0.1 s. A last line that was
// not written to its end is left out. Throws InputError that names path and line.
ImuTable LoadImuTable(const std::string& path);

}  // namespace oaslam
