#include "oaslam/formats/imu_file.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/geometry/degree.h"

namespace oaslam {
namespace {

constexpr double kGravity = 9.80665;

Eigen::Vector3d RateAt(double time) {
  return {0.3 * std::sin(3 * time), 0.5 * std::cos(2 * time), 0.2 * std::sin(time + 1)};
}
// Of a phone that is held upright (its y axis is up) and moved.
Eigen::Vector3d AccelerationAt(double time) {
  return {0.8 * std::sin(4 * time), kGravity + std::cos(5 * time), 0.5 * std::sin(2 * time)};
}

// Rows of four seconds of samples. `row` makes the text of a time.
std::string Rows(const std::function<std::string(double)>& row, double rate = 100,
                 double begin = 1) {
  std::string text;
  for (int i = 0; i < 4 * rate; ++i) text += row(begin + i / rate) + "\n";
  return text;
}
std::string Numbers(const Eigen::Vector3d& v) {
  return fmt::format("{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
}
std::string BothAt(double time, double unit_s = 1e-9) {
  return fmt::format("{:.9g},", std::round(time / 1e-6) * (1e-6 / unit_s)) + Numbers(RateAt(time)) +
         "," + Numbers(AccelerationAt(time));
}

struct ImuFile : FolderTest {
  ImuRecording Load(const std::string& text) { return LoadImu(folder.Write("imu.csv", text)); }
  // What is said of it.
  std::string NotesOf(const std::string& text) {
    return fmt::format("{}", fmt::join(Load(text).notes, "\n"));
  }
  std::string ProblemOf(const std::string& text) {
    return InputErrorOf([&] { Load(text); });
  }
};

// The recording is what was written; `with`: has accelerations.
void ExpectWritten(const ImuRecording& recording, double clock_s = 0, bool with = true) {
  EXPECT_EQ(recording.has_acceleration, with);
  EXPECT_GT(recording.samples.size(), 350U);
  for (const ImuSample& sample : recording.samples) {
    const double time = sample.timestamp - clock_s;
    EXPECT_LT((sample.angular_velocity - RateAt(time)).norm(), 1e-5) << time;
    // Interpolated by half a percent of the second derivative.
    const Eigen::Vector3d error = sample.acceleration - AccelerationAt(time);
    EXPECT_LT(with ? error.norm() : 0, 2e-2) << time;
  }
}

TEST_F(ImuFile, ReadsEuroc) {
  const auto recording = Load(
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m "
      "s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n"
      "1403636579758555392,-0.1,0.2,0.3,8.1,-0.3,-3.2\r\n1403636579763555584, "
      "1e-1,0,-2,8,0,-4\r\n");
  ASSERT_THAT(recording.samples, SizeIs(2));
  EXPECT_THAT(recording.notes, SizeIs(0));
  EXPECT_TRUE(recording.has_acceleration);
  EXPECT_EQ(recording.samples[0].timestamp, 1e-9 * 1403636579758555392.0);
  EXPECT_EQ(recording.samples[0].angular_velocity, Eigen::Vector3d(-0.1, 0.2, 0.3));
  EXPECT_EQ(recording.samples[0].acceleration, Eigen::Vector3d(8.1, -0.3, -3.2));
  EXPECT_EQ(recording.samples[1].angular_velocity, Eigen::Vector3d(0.1, 0, -2));
  const auto turned = Load("# time ax ay az gx gy gz\n0.01 0 9.8 0 1 2 3\n0.02 0 9.8 0 1 2 3\n");
  EXPECT_EQ(turned.samples[1].angular_velocity, Eigen::Vector3d(1, 2, 3));
  const auto gyroscope = Load("# any comment\n1000000000,0,1,2\n1005000000,0,1,3\n");
  EXPECT_FALSE(gyroscope.has_acceleration);
  EXPECT_EQ(gyroscope.samples[1].angular_velocity, Eigen::Vector3d(0, 1, 3));
}

TEST_F(ImuFile, ErrorsNameTheLineAndTheBound) {
  EXPECT_THAT(ProblemOf("# nothing\n"), HasSubstrs("imu.csv", "EuRoC"));
  EXPECT_THAT(ProblemOf("10,0,0,0\n20,0,x,0\n"), HasSubstr("imu.csv:2: column 3"));
  EXPECT_THAT(ProblemOf("10,0,0\n"), HasSubstr("imu.csv:1: column 4"));
  EXPECT_THAT(ProblemOf("10,0,180,0\n"), HasSubstrs("imu.csv:1", "180 rad/s", "0 to 100"));
  EXPECT_THAT(ProblemOf("10,0,0,0,0,1e4,0\n20,0,0,0,9.8,0,0\n30,0,0,0,9.8,0,0\n"),
              HasSubstrs("imu.csv:1", "acceleration: 10000 m/s^2", "0 to 1000"));
  EXPECT_THAT(ProblemOf("name,size,age,x\n1,2,3,4\n"), HasSubstrs("imu.csv:1: columns", "gx, gy"));
  EXPECT_THAT(ProblemOf("timestamp,ax,ay,az\n1,2,3,4\n"), HasSubstr("no gyroscope"));
  EXPECT_INPUT_ERROR(LoadImu(folder / "none.csv"), HasSubstr("none.csv"));
  EXPECT_INPUT_ERROR(LoadImu(TempFolder().path()), HasSubstr("folder without an IMU"));
  EXPECT_THAT(ProblemOf("1000000000,0,0,0\n2000000000,0,0,0\n"),
              HasSubstrs("imu.csv:1: ", "median spacing 1e+09", "0.0001 to 0.1 s"));
}

TEST_F(ImuFile, ReadsMarsLogger) {
  const std::string header =
      "Timestamp[nanosec],gx[rad/s],gy[rad/s],gz[rad/s],ax[m/s^2],ay[m/s^2],az[m/s^2],Unix "
      "time[nanosec]\n";
  folder.Write("gyro_accel.csv",
               header + Rows([](double time) { return BothAt(time) + ",17e17"; }));
  const auto recording = LoadImu(folder.path());
  ExpectWritten(recording);
  EXPECT_THAT(recording.notes, SizeIs(0));
}

TEST_F(ImuFile, ReadsStrayScanner) {
  // Core Motion measures gravity instead of the force against it; once in m/s^2, once in g.
  for (const double unit : {1.0, kGravity}) {
    const auto recording =
        Load("timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n" + Rows([&](double time) {
               return fmt::format("{:.6f},", time + 3000) + Numbers(-AccelerationAt(time) / unit) +
                      "," + Numbers(RateAt(time));
             }));
    ExpectWritten(recording, 3000);
    EXPECT_THAT(recording.notes, SizeIs(unit == 1 ? 0 : 1));
  }
}

TEST_F(ImuFile, ReadsCoreMotionWithGravityApart) {
  const Eigen::Vector3d gravity(0, -1, 0);
  ExpectWritten(
      Load("motion_timestamp_s,unix_timestamp_s,user_acceleration_x_g,"
           "user_acceleration_y_g,user_acceleration_z_g,rotation_rate_x_rad_s,"
           "rotation_rate_y_rad_s,rotation_rate_z_rad_s,gravity_x_g,gravity_y_g,"
           "gravity_z_g\n" +
           Rows([&](double time) {
             return fmt::format("{:.6f},0,", time) +
                    Numbers(-AccelerationAt(time) / kGravity - gravity) + "," +
                    Numbers(RateAt(time)) + "," + Numbers(gravity);
           })));
}

TEST_F(ImuFile, JoinsTheFilesOfSensorLogger) {
  const auto file = [](auto value, double rate, double begin) {
    return "time,seconds_elapsed,z,y,x\n" +
           Rows(
               [&](double time) {
                 const Eigen::Vector3d v = value(time);
                 return fmt::format("{:.0f},{},", 1e9 * time, time) + Numbers(v.reverse());
               },
               rate, begin);
  };
  const std::string gyroscope = folder.Write("Gyroscope.csv", file(RateAt, 100, 1));
  const std::string total = folder.Write("TotalAcceleration.csv", file(AccelerationAt, 63, 0.995));
  folder.Write("Accelerometer.csv", "not read\n");
  ExpectWritten(LoadImu(folder.path()));
  ExpectWritten(LoadImu(gyroscope + "," + total));
  ExpectWritten(LoadImu(total + "," + gyroscope));
  ExpectWritten(LoadImu(gyroscope), 0, false);
  // An accelerometer that stopped for half a second: its samples are not made up.
  folder.Write("Accelerometer.csv", "time,seconds_elapsed,z,y,x\n" + Rows([](double time) {
                                      return time > 2 && time < 2.5
                                                 ? std::string()
                                                 : fmt::format("{:.0f},0,", 1e9 * time) +
                                                       Numbers(AccelerationAt(time).reverse());
                                    }));
  const auto recording = LoadImu(gyroscope + "," + (folder / "Accelerometer.csv"));
  ExpectWritten(recording);
  ASSERT_THAT(recording.notes, SizeIs(1));
  EXPECT_THAT(recording.notes[0],
              HasSubstrs("1 stretch of more than 0.1 s", "longest 0.5", "at 2.0"));
  // One by another clock.
  folder.Write("Accelerometer.csv", file(AccelerationAt, 100, 100));
  const auto apart = LoadImu(gyroscope + "," + (folder / "Accelerometer.csv"));
  ExpectWritten(apart, 0, false);
  EXPECT_THAT(apart.notes[0], HasSubstr("its times are not those of the gyroscope"));
}

TEST_F(ImuFile, OneTableMayHaveRowsOfOneSensorEach) {
  ExpectWritten(Load("t;gyroX;gyroY;gyroZ;accX;accY;accZ\n" + Rows([](double time) {
                       std::string gyroscope = Numbers(RateAt(time)),
                                   accelerometer = Numbers(AccelerationAt(time - 0.003));
                       std::ranges::replace(gyroscope, ',', ';');
                       std::ranges::replace(accelerometer, ',', ';');
                       return fmt::format("{:.6f};;;;{}\n{:.6f};{};nan;nan;nan", time - 0.003,
                                          accelerometer, time, gyroscope);
                     })));
}

TEST_F(ImuFile, TheSpacingTellsTheUnitOfTime) {
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    const std::string rows = Rows([&](double time) { return BothAt(time, unit_s); });
    const auto recording = Load("# timestamp\n" + rows);
    ExpectWritten(recording);
    EXPECT_THAT(recording.notes, SizeIs(0));
    // A header of another unit.
    const std::string notes = NotesOf("timestamp [ns],gx,gy,gz,ax,ay,az\n" + rows);
    EXPECT_EQ(notes.empty(), unit_s == 1e-9) << notes;
    if (unit_s != 1e-3) continue;
    EXPECT_THAT(notes, HasSubstrs("header has times in ns", "of 10 ", "in ms"));
  }
}

TEST_F(ImuFile, UnitsOfSensorsAreFound) {
  const auto file = [](double rate_unit, double acceleration_unit, const char* header = "") {
    return header + Rows([&](double time) {
             return fmt::format("{:.0f},", 1e9 * time) + Numbers(RateAt(time) / rate_unit) + "," +
                    Numbers(AccelerationAt(time) / acceleration_unit);
           });
  };
  auto recording = Load(file(kDegree, 1));
  ExpectWritten(recording);
  ASSERT_THAT(recording.notes, SizeIs(1));
  EXPECT_THAT(recording.notes[0], HasSubstrs("rad/s in a tenth of the time", "taken as deg/s"));
  recording = Load(file(1, kGravity));
  ExpectWritten(recording);
  ASSERT_THAT(recording.notes, SizeIs(1));
  EXPECT_THAT(recording.notes[0], HasSubstrs("accelerometer: its median is ", "taken as g"));
  recording = Load(file(10 * kDegree, kGravity, "t,gx(dps),gy(dps),gz(dps),ax(g),ay(g),az(g)\n"));
  EXPECT_THAT(fmt::format("{}", fmt::join(recording.notes, "|")),
              HasSubstrs("gyroscope: deg/s by its header", "accelerometer: g by its header"));
  EXPECT_LT((recording.samples[9].angular_velocity - 0.1 * RateAt(1.09)).norm(), 1e-5);
}

TEST_F(ImuFile, WithoutGravityOnlyTheGyroscopeIsUsed) {
  // A calm hand, and a walk, whose accelerations are of the size of gravity in g.
  for (const double strength : {0.1, 1.0}) {
    const auto recording = Load(Rows([&](double time) {
      const Eigen::Vector3d moved(std::sin(7 * time), std::cos(9 * time), std::sin(11 * time));
      return fmt::format("{:.0f},", 1e9 * time) + Numbers(RateAt(time)) + "," +
             Numbers(strength * moved);
    }));
    ExpectWritten(recording, 0, false);
    ASSERT_THAT(recording.notes, SizeIs(1));
    EXPECT_THAT(recording.notes[0],
                HasSubstrs("gravity is not in it", "linear acceleration", "only the gyroscope"));
  }
  EXPECT_THAT(NotesOf(Rows([](double time) {
                return fmt::format("{:.0f},", 1e9 * time) + Numbers(RateAt(time)) + "," +
                       Numbers(1671 * AccelerationAt(time));  // counts of a sensor
              })),
              HasSubstrs("expected is that of gravity", "only the gyroscope"));
}

TEST_F(ImuFile, TimesThatStandStillOrGoBackAreLeftOut) {
  int i = 0;
  const auto recording = Load(Rows([&](double time) {
    ++i;
    if (i % 50 == 0) return BothAt(time) + "\n" + BothAt(time);
    return BothAt(i == 210 ? time - 0.5 : time);
  }));
  ExpectWritten(recording);
  ASSERT_THAT(recording.notes, SizeIs(2));
  EXPECT_THAT(recording.notes[0], HasSubstrs("IMU: 8 of 408 samples", "left out"));
  EXPECT_THAT(recording.notes[1],
              HasSubstrs("of 1 of 408 samples go back, by up to 0.49 s", "line 214"));
}

TEST_F(ImuFile, ATimeFarAheadIsLeftOutAlone) {
  int i = 0;
  const auto recording =
      Load(Rows([&](double time) { return BothAt(++i == 100 ? time + 1e6 : time); }));
  EXPECT_THAT(recording.samples, SizeIs(399));
  ASSERT_THAT(recording.notes, SizeIs(1));
  EXPECT_THAT(recording.notes[0], HasSubstrs("1 of 400 samples go back", "line 100"));
}

TEST_F(ImuFile, GapsAreSaid) {
  const std::string notes = NotesOf(Rows([](double time) {
    const bool is_lost = (time > 2 && time < 2.3) || (time > 3 && time < 3.6);
    return is_lost ? std::string() : BothAt(time);
  }));
  EXPECT_THAT(notes, HasSubstrs("2 stretches of more than 0.1 s", "longest 0.6", "at 3.000 s"));
}

TEST_F(ImuFile, AStuckSensorIsNotUsed) {
  const auto file = [](double rate_until, double acceleration_until) {
    return Rows([&](double time) {
      return fmt::format("{:.0f},", 1e9 * time) + Numbers(RateAt(std::min(time, rate_until))) +
             "," + Numbers(AccelerationAt(std::min(time, acceleration_until)));
    });
  };
  auto recording = Load(file(1.5, 9));
  EXPECT_THAT(recording.samples, SizeIs(0));
  EXPECT_THAT(recording.notes[0], HasSubstrs("gyroscope: stuck", "3.5 of 4.0 s", "not used"));
  recording = Load(file(9, 1.5));
  ExpectWritten(recording, 0, false);
  EXPECT_THAT(recording.notes[0], HasSubstrs("accelerometer: stuck", "not used"));
  recording = Load(file(4, 9));
  EXPECT_THAT(recording.samples, SizeIs(300));
  EXPECT_THAT(recording.notes[0], HasSubstrs("gyroscope: stuck", "1.0 s in all, first at 4.000 s"));
  // A second on a table: coarse sensors have one value there.
  recording = Load(Rows([&](double time) {
    const double still = time > 2 && time < 3 ? 2 : time;
    return fmt::format("{:.0f},", 1e9 * time) + Numbers(RateAt(still)) + "," +
           Numbers(AccelerationAt(still));
  }));
  EXPECT_THAT(recording.samples, SizeIs(400));
  EXPECT_THAT(recording.notes, SizeIs(0));
}

TEST_F(ImuFile, ALastLineThatBreaksOffIsLeftOut) {
  const std::string rows = Rows([](double time) { return BothAt(time); });
  const auto recording = Load(rows + "5000000000,0.1,0.");
  ExpectWritten(recording);
  ASSERT_THAT(recording.notes, SizeIs(1));
  EXPECT_THAT(recording.notes[0], HasSubstr("line 401, the last, breaks off"));
  EXPECT_THAT(ProblemOf(rows + "5000000000,0.1,0.\n"), HasSubstr("imu.csv:401: column 4"));
}

}  // namespace
}  // namespace oaslam
