#pragma once

namespace oaslam {

// How far a motion between keyframes by the odometry is trusted (docs/lab/odometry.md): shares of
// the way, of the depth and of the turn, and what no turn is below. That of the way is at least
// this, and as much as this film shows (OdometryUnit).
inline constexpr double kSigmaOfWay = 0.01, kSigmaOfDepth = 0.002, kSigmaOfTurn = 0.0025,
                        kLeastTurn = 0.0005;
// The share of the depth, in a young map: neither it nor the odometry knows its scale well.
inline constexpr double kSigmaOfDepthIfYoung = 1.5 * kSigmaOfDepth;

}  // namespace oaslam
