#pragma once

namespace oaslam {

// The standard deviations of a motion between keyframes by the odometry (docs/lab/odometry.md): as
// shares of the way, of the depth and of the turn; a turn's is at least kLeastTurn rad. The share
// of the way is larger in a film that holds its scale badly (OdometryLink::spread).
inline constexpr double kSigmaOfWay = 0.01, kSigmaOfDepth = 0.002, kSigmaOfTurn = 0.0025,
                        kLeastTurn = 0.0005;
// The share of the depth, in a young map: neither it nor the odometry knows its scale well.
inline constexpr double kSigmaOfDepthIfYoung = 1.5 * kSigmaOfDepth;

}  // namespace oaslam
