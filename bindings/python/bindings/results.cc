#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "bindings.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/slam.h"
#include "oaslam/slam_state.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::python {
namespace {

using HeldPose = std::optional<Rigid3>;

void AddTrackingResult(py::module_& m) {
  Value<PoseElsewhere>(m, "PoseElsewhere", doc::PoseElsewhere)
      .def_readonly(OASLAM_FIELD(PoseElsewhere, world))
      .def_readonly(OASLAM_FIELD(PoseElsewhere, world_from_cam))
      .def_array(OASLAM_FIELD(PoseElsewhere, covariance))
      .def_readonly(OASLAM_FIELD(PoseElsewhere, is_uncertain))
      .def_readonly(OASLAM_FIELD(PoseElsewhere, state))
      .def_readonly(OASLAM_FIELD(PoseElsewhere, depth))
      .def_readonly(OASLAM_FIELD(PoseElsewhere, confidence));
  Value<TrackingResult>(m, "TrackingResult", doc::TrackingResult)
      .def_readonly(OASLAM_FIELD(TrackingResult, frame))
      .def_readonly(OASLAM_FIELD(TrackingResult, timestamp))
      .def_readonly(OASLAM_FIELD(TrackingResult, state))
      .def_readonly(OASLAM_FIELD(TrackingResult, world))
      .keep(
          "world_from_cam",
          [](const TrackingResult& r) { return StateOf<HeldPose>::Get(r.PoseIn(r.world)); },
          [](TrackingResult& r, py::handle state) { r.SetPose(StateOf<HeldPose>::From(state)); })
      .def("pose_in", &TrackingResult::PoseIn, py::arg("world"), doc::TrackingResult_PoseIn)
      .def_tuple(OASLAM_FIELD(TrackingResult, elsewhere))
      .def_property_readonly("has_pose", &TrackingResult::HasPose, doc::TrackingResult_HasPose)
      .def_readonly(OASLAM_FIELD(TrackingResult, source))
      .def_readonly(OASLAM_FIELD(TrackingResult, keypoints))
      .def_readonly(OASLAM_FIELD(TrackingResult, matched))
      .def_readonly(OASLAM_FIELD(TrackingResult, inliers))
      .def_readonly(OASLAM_FIELD(TrackingResult, detections))
      .def_readonly(OASLAM_FIELD(TrackingResult, objects))
      .def_readonly(OASLAM_FIELD(TrackingResult, confidence))
      .def_array(OASLAM_FIELD(TrackingResult, covariance))
      .def_readonly(OASLAM_FIELD(TrackingResult, is_uncertain))
      .def_readonly(OASLAM_FIELD(TrackingResult, seconds_without_map))
      .def_readonly(OASLAM_FIELD(TrackingResult, focal_ratio))
      .def_readonly(OASLAM_FIELD(TrackingResult, depth))
      .def_readonly(OASLAM_FIELD(TrackingResult, motion_unit))
      .def_readonly(OASLAM_FIELD(TrackingResult, ms_total))
      .def_readonly(OASLAM_FIELD(TrackingResult, ms_features))
      .def_readonly(OASLAM_FIELD(TrackingResult, ms_track))
      .def_readonly(OASLAM_FIELD(TrackingResult, ms_objects))
      .def_readonly(OASLAM_FIELD(TrackingResult, cpu_ms))
      .def("__repr__", [](const TrackingResult& r) {
        return py::str("<oaslam.TrackingResult of frame {}: {}>").format(r.frame, r.state);
      });
  Value<GyroscopeCalibration>(m, "GyroscopeCalibration", doc::GyroscopeCalibration)
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, bias))
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, sigma_bias))
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, offset_s))
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, sigma_offset_s))
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, sigma))
      .def_readonly(OASLAM_FIELD(GyroscopeCalibration, state));
  Value<ImuCalibration>(m, "ImuCalibration", doc::ImuCalibration)
      .def_readonly(OASLAM_FIELD(ImuCalibration, gyroscope))
      .def_readonly(OASLAM_FIELD(ImuCalibration, accelerometer))
      .def_readonly(OASLAM_FIELD(ImuCalibration, acceleration_bias))
      .def_readonly(OASLAM_FIELD(ImuCalibration, sigma_acceleration_bias))
      .def_readonly(OASLAM_FIELD(ImuCalibration, sigma_metre))
      .def_readonly(OASLAM_FIELD(ImuCalibration, problem));
  Value<ObjectPresence>(m, "ObjectPresence", doc::ObjectPresence)
      .def_readonly(OASLAM_FIELD(ObjectPresence, id))
      .def_readonly(OASLAM_FIELD(ObjectPresence, category_id))
      .def_readonly(OASLAM_FIELD(ObjectPresence, expected))
      .def_readonly(OASLAM_FIELD(ObjectPresence, seen))
      .def_readonly(OASLAM_FIELD(ObjectPresence, is_missing));
  Value<FormerWorld>(m, "FormerWorld", doc::FormerWorld)
      .def_readonly(OASLAM_FIELD(FormerWorld, world))
      .def_readonly(OASLAM_FIELD(FormerWorld, scale));
}

void AddRelocalizationResult(py::module_& m) {
  using Candidate = RelocalizationResult::Candidate;
  Value<RelocalizationResult> result(m, "RelocalizationResult", doc::RelocalizationResult);
  Value<Candidate>(result, "Candidate", doc::RelocalizationResult_Candidate)
      .def_readonly(OASLAM_FIELD(Candidate, world_from_cam))
      .def_readonly(OASLAM_FIELD(Candidate, score));
  result.def_readonly(OASLAM_FIELD(RelocalizationResult, evidence))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, world))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, world_from_cam))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, confidence))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, object_score))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, object_margin))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, inlier_points))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, matched_objects))
      .def_array(OASLAM_FIELD(RelocalizationResult, covariance))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, sigma_position))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, candidates))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, candidates_are_by))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, why_not))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, camera))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, focal_sigma_px))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, ms_features))
      .def_readonly(OASLAM_FIELD(RelocalizationResult, ms));
}

// The const is cast away, since pybind11 has no holder for const objects; all bound functions only
// read.
using HeldState = std::optional<std::shared_ptr<SlamState>>;

HeldState Held(const std::shared_ptr<const SlamState>& state) {
  return state ? HeldState(std::const_pointer_cast<SlamState>(state)) : std::nullopt;
}

HeldState WaitForNext(const SlamStates& states, const HeldState& last, double timeout_s) {
  constexpr double kMostSeconds = 1e9;
  if (!(timeout_s >= 0)) throw py::value_error("timeout_s is not negative");
  using std::chrono::milliseconds;
  constexpr milliseconds kBetweenSignals(100);
  milliseconds left(std::lround(1000 * std::min(timeout_s, kMostSeconds)));
  while (true) {
    const milliseconds slice = std::min(left, kBetweenSignals);
    const bool has_ended = states.HasEnded();
    std::shared_ptr<const SlamState> next;
    {
      const WithoutPythonsLock without_gil;
      next = states.WaitForNext(last.value_or(nullptr), slice);
    }
    left -= slice;
    if (next || has_ended || left <= milliseconds(0)) return Held(next);
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

}  // namespace

void AddResults(py::module_& m) {
  AddTrackingResult(m);
  AddRelocalizationResult(m);
  py::class_<SlamState, std::shared_ptr<SlamState>>(m, "SlamState", doc::SlamState)
      .def_readonly(OASLAM_FIELD(SlamState, result))
      .def_readonly(OASLAM_FIELD(SlamState, map));
  auto kind = py::enum_<SlamEventKind>(m, "SlamEventKind", doc::SlamEventKind)
                  .value("STATE", SlamEventKind::kState)
                  .value("WORLD", SlamEventKind::kWorld)
                  .value("SUBMAP_BEGAN", SlamEventKind::kSubmapBegan)
                  .value("SUBMAP_JOINED", SlamEventKind::kSubmapJoined)
                  .value("LOOP_CLOSED", SlamEventKind::kLoopClosed)
                  .value("METRIC", SlamEventKind::kMetric)
                  .value("ANCHOR_PLACED", SlamEventKind::kAnchorPlaced)
                  .value("ANCHOR_EDITED", SlamEventKind::kAnchorEdited)
                  .value("ANCHOR_MOVED", SlamEventKind::kAnchorMoved)
                  .value("ANCHOR_LOST", SlamEventKind::kAnchorLost)
                  .value("ANCHOR_REMOVED", SlamEventKind::kAnchorRemoved);
  SayAsToString(kind);
  Value<SlamEvent>(m, "SlamEvent", doc::SlamEvent)
      .def_readonly(OASLAM_FIELD(SlamEvent, number))
      .def_readonly(OASLAM_FIELD(SlamEvent, kind))
      .def_readonly(OASLAM_FIELD(SlamEvent, frame))
      .def_readonly(OASLAM_FIELD(SlamEvent, timestamp))
      .def_readonly(OASLAM_FIELD(SlamEvent, state))
      .def_readonly(OASLAM_FIELD(SlamEvent, world))
      .def_readonly(OASLAM_FIELD(SlamEvent, submap))
      .def_readonly(OASLAM_FIELD(SlamEvent, anchor));
  py::class_<SlamStates>(m, "SlamStates", doc::SlamStates)
      .def(
          "newest",
          [](const SlamStates& states) {
            return std::const_pointer_cast<SlamState>(states.Newest());
          },
          doc::SlamStates_Newest)
      .def_property_readonly("has_ended", &SlamStates::HasEnded, doc::SlamStates_HasEnded)
      .def("wait_for_next", &WaitForNext, py::arg("last"), py::arg("timeout_s"),
           doc::SlamStates_WaitForNext)
      .def("events_after", &SlamStates::EventsAfter, py::arg("number"),
           doc::SlamStates_EventsAfter);
}

void AddTrajectories(py::module_& m) {
  Value<StampedPose>(m, "StampedPose", doc::StampedPose)
      .def(py::init([](double timestamp, const Rigid3& world_from_cam) {
             return StampedPose{timestamp, world_from_cam};
           }),
           py::arg("timestamp"), py::arg("world_from_cam"), doc::StampedPose)
      .def_readonly(OASLAM_FIELD(StampedPose, timestamp))
      .def_readonly(OASLAM_FIELD(StampedPose, world_from_cam));
  Value<ScoredPose>(m, "ScoredPose", doc::ScoredPose)
      .def(py::init([](const StampedPose& pose, double score) {
             return ScoredPose{pose, score};
           }),
           py::arg("pose"), py::arg("score"), doc::ScoredPose)
      .def_readonly(OASLAM_FIELD(ScoredPose, pose))
      .def_readonly(OASLAM_FIELD(ScoredPose, score));
  m.def("load_trajectory", OfPath(&LoadTrajectory), py::arg("path"), WithoutGil(),
        doc::LoadTrajectory);
  m.def("save_trajectory", OfPath(&SaveTrajectory), py::arg("path"), py::arg("poses"), WithoutGil(),
        doc::SaveTrajectory);
  m.def("load_scored_poses", OfPath(&LoadScoredPoses), py::arg("path"), WithoutGil(),
        doc::LoadScoredPoses);
  m.def("save_scored_poses", OfPath(&SaveScoredPoses), py::arg("path"), py::arg("poses"),
        WithoutGil(), doc::SaveScoredPoses);
}

}  // namespace oaslam::python
