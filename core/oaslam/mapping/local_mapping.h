#pragma once

#include <span>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/mapping/map_command.h"

namespace oaslam {

// Edits of the map that the mapper makes (insertion.cc, culling.cc, triangulation.cc, fusion.cc):
// one begins a map, the others are the steps for each new keyframe.

// Makes a map from two views: both keyframes and their landmarks, refined together. `initial` gives
// the frame and the unit. Returns false and leaves the map as it was when too few landmarks remain
// after refinement.
bool InsertInitialMap(const InitialMap& initial, Map& map);

// Moves the keyframes after `right_until` to the poses that follow from `motions`. Erases the
// landmarks that were made since, and triangulates new ones from the moved keyframes. Returns the
// new landmarks.
std::vector<LandmarkId> CorrectMotions(
    KeyframeId right_until, std::span<const std::pair<KeyframeId, KeyframeMotion>> motions,
    Map& map);

// Adds a keyframe with observations of the landmarks it tracked, those that still exist,
// and its covisibility.
void InsertKeyframe(const KeyframeInsertion& insertion, Map& map);

// Adds the tracker's counts of how often each landmark was expected and found.
void CountLandmarkUse(std::span<const LandmarkUse> uses, Map& map);

// Erases those of the `recent` landmarks that were found in less than a quarter of the frames that
// should show them, or that too few keyframes observe. Returns those that are still on trial.
std::vector<LandmarkId> CullRecentLandmarks(std::span<const LandmarkId> recent, KeyframeId newest,
                                            Map& map);

// Keyframes that a new one is triangulated and fused with; the time grows with their number.
inline constexpr int kFusedKeyframes = 20;

// Triangulates matches between free key points of the keyframe and of covisible ones; returns the
// new landmarks.
std::vector<LandmarkId> TriangulateNewLandmarks(KeyframeId keyframe, Map& map);

// Searches the keyframe's landmarks in its neighbours and the neighbours' landmarks in it, and
// merges duplicates.
void FuseLandmarks(KeyframeId keyframe, Map& map);

// Retires covisible keyframes whose landmarks nearly all are seen by three other keyframes at
// the same scale or finer. Keeps the first keyframe of the map, which fixes its frame, and
// `keyframe` and the one inserted before it, to which the tracker may still refer.
void CullKeyframes(KeyframeId keyframe, Map& map);

// Points of a keyframe by which its place is to be recognised.
struct PointsToDescribe {
  std::vector<uint16_t> keypoints;  // ascending
  std::vector<float> depths;        // Keyframe::learned_depths
};

// The key points of a keyframe that show landmarks of which no described keyframe has a similar
// view (within 20 degrees, at up to 1.5 times the distance), and those without a landmark that a
// covisible keyframe sees, too.
PointsToDescribe FindPointsToDescribe(KeyframeId keyframe, const Map& map);

// Drops the key points without a landmark from all but the newest 500 of the `unsettled` keyframes
// (ascending), since their neighbours could not triangulate them; in a large map they take half of
// the memory. Returns the keyframes that are still unsettled.
std::vector<KeyframeId> PackSettledKeyframes(std::vector<KeyframeId> unsettled, Map& map);

}  // namespace oaslam
