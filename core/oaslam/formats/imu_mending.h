#pragma once

#include <string>
#include <vector>

#include "oaslam/formats/imu_table.h"
#include "oaslam/imu.h"

namespace oaslam {

// What can be wrong with the samples of a sensor, and is mended. Each function adds a sentence to
// `notes` where it found something; `sensor` names the sensor in it.

// Leaves out samples whose time stamp is that of an earlier one, or goes back.
void LeaveOutDisorder(const std::string& sensor, SensorSeries& series,
                      std::vector<std::string>& notes);
// Leaves out stretches of half a second or longer in which all samples are the same although those
// of the other sensor, if there is one, change by `motion` (a coarse sensor at rest has one value,
// too), and all samples where most of them are in such stretches.
void LeaveOutStuck(const std::string& sensor, const SensorSeries& other, double motion,
                   SensorSeries& series, std::vector<std::string>& notes);
// Converts angular velocities in degrees to rad/s: by the header's unit, or where the camera would
// else turn so fast that no image shows anything.
void ToRadians(SensorSeries& gyroscope, std::vector<std::string>& notes);
// Converts accelerations in g to m/s^2: by the header's unit, or by their size. Leaves out all
// samples where they are without gravity, or in another unit.
void ToMetres(SensorSeries& accelerometer, std::vector<std::string>& notes);

// The samples of the gyroscope with the accelerations at their times, interpolated; those without
// accelerations within 0.1 s on both sides are left out. Nothing where that leaves less than half
// of them.
std::vector<ImuSample> Joined(const SensorSeries& gyroscope, const SensorSeries& accelerometer);

// A sentence on times of more than 0.1 s without samples; empty where there are none.
std::string GapsOf(const std::vector<ImuSample>& samples);

}  // namespace oaslam
