#pragma once

#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/command.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The steps of local mapping, in the order in which the mapper takes them for each new keyframe.
// Each is an edit of the map.

// A new map from two views: both keyframes, their landmarks, all refined together, scaled so that
// the median depth is 1. False (and the map untouched) when too little of it survives refinement.
bool InsertInitialMap(const InitialMap& initial, Map& map);

// Adds the keyframe with the landmarks it tracked (those that still exist), and its covisibility.
void InsertKeyframe(const KeyframeInsertion& insertion, const MappingConfig& config, Map& map);

// Adds the tracker's counts.
void CountLandmarkUse(std::span<const LandmarkUse> uses, Map& map);

// Erases of the `recent` landmarks those that were found in less than a quarter of the frames that
// should show them, or that too few keyframes saw since their creation; returns those that are
// still to be watched.
std::vector<LandmarkId> CullRecentLandmarks(std::span<const LandmarkId> recent, KeyframeId newest,
                                            Map& map);

// Triangulates key points of the keyframe with those of its covisible ones; returns the new
// landmarks.
std::vector<LandmarkId> TriangulateNewLandmarks(KeyframeId keyframe, const MappingConfig& config,
                                                Map& map);

// Finds the keyframe's landmarks in its neighbours and theirs in it; duplicates become one.
void FuseLandmarks(KeyframeId keyframe, const MappingConfig& config, Map& map);

// Retires covisible keyframes nearly all of whose landmarks are seen, as finely, by three others.
// Never the map's first, which fixes its frame, nor `keyframe` and the one inserted before it, to
// which the tracker may still refer. Returns how many.
int CullKeyframes(KeyframeId keyframe, const MappingConfig& config, Map& map);

}  // namespace oaslam
