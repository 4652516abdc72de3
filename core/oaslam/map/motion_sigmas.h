#pragma once

namespace oaslam {

// The standard deviations of a motion between keyframes by the odometry (docs/lab/odometry.md), as
// shares of the translation, of the depth and of the rotation; that of the rotation is at least
// kLeastTurn rad. The share of the translation is larger in a recording in which the odometry's
// scale varies (OdometryLink::spread).
inline constexpr double kSigmaOfWay = 0.01, kSigmaOfDepth = 0.002, kSigmaOfTurn = 0.0025,
                        kLeastTurn = 0.0005;
// The share of the depth in a young map: the scales of the map and of the odometry are still
// uncertain.
inline constexpr double kSigmaOfDepthIfYoung = 1.5 * kSigmaOfDepth;

}  // namespace oaslam
