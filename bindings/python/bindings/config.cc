#include "oaslam/config.h"

#include "bindings.h"
#include "oaslam/config_file.h"

namespace oaslam::python {

template <>
SlamConfig Blank() {
  return SlamConfig::Offline();
}

namespace {

void AddEnumerations(py::module_& m) {
  auto mode = py::enum_<RunnerMode>(m, "RunnerMode", doc::RunnerMode)
                  .value("SEQUENTIAL", RunnerMode::kSequential)
                  .value("LOCKSTEP", RunnerMode::kLockstep)
                  .value("LIVE", RunnerMode::kLive);
  SayAsToString(mode);
  auto bundled = py::enum_<BundleObjects>(m, "BundleObjects", doc::BundleObjects)
                     .value("NONE", BundleObjects::kNone)
                     .value("POSES", BundleObjects::kPoses)
                     .value("FULL", BundleObjects::kFull);
  SayAsWord(bundled);
  auto method = py::enum_<ObjectMethod>(m, "ObjectMethod", doc::ObjectMethod)
                    .value("ROBUST", ObjectMethod::kRobust)
                    .value("PAPER", ObjectMethod::kPaper);
  SayAsWord(method);
  auto descriptor = py::enum_<DescriptorKind>(m, "DescriptorKind", doc::DescriptorKind)
                        .value("ORB", DescriptorKind::kOrb)
                        .value("LEARNED_AND_ORB", DescriptorKind::kLearnedAndOrb);
  SayAsWord(descriptor);
}

void AddPointSections(py::module_& m) {
  Value<FeaturesConfig>(m, "FeaturesConfig", doc::FeaturesConfig)
      .def(py::init(), doc::FeaturesConfig)
      .def_readwrite(OASLAM_FIELD(FeaturesConfig, count))
      .def_readwrite(OASLAM_FIELD(FeaturesConfig, resolution))
      .def_readwrite(OASLAM_FIELD(FeaturesConfig, descriptor));
  Value<TrackingConfig>(m, "TrackingConfig", doc::TrackingConfig)
      .def(py::init(), doc::TrackingConfig)
      .def_readwrite(OASLAM_FIELD(TrackingConfig, min_inliers))
      .def_readwrite(OASLAM_FIELD(TrackingConfig, max_object_sigma));
  Value<MappingConfig>(m, "MappingConfig", doc::MappingConfig)
      .def(py::init(), doc::MappingConfig)
      .def_readwrite(OASLAM_FIELD(MappingConfig, loop_closing));
  Value<BundleConfig>(m, "BundleConfig", doc::BundleConfig)
      .def(py::init(), doc::BundleConfig)
      .def_readwrite(OASLAM_FIELD(BundleConfig, objects));
}

void AddObjectSections(py::module_& m) {
  Value<ObjectsConfig>(m, "ObjectsConfig", doc::ObjectsConfig)
      .def(py::init(), doc::ObjectsConfig)
      .def_readwrite(OASLAM_FIELD(ObjectsConfig, model))
      .def_readwrite(OASLAM_FIELD(ObjectsConfig, min_score))
      .def_readwrite(OASLAM_FIELD(ObjectsConfig, min_parallax_deg))
      .def_readwrite(OASLAM_FIELD(ObjectsConfig, min_observations))
      .def_readwrite(OASLAM_FIELD(ObjectsConfig, min_accept_share));
  Value<RelocalizationConfig>(m, "RelocalizationConfig", doc::RelocalizationConfig)
      .def(py::init(), doc::RelocalizationConfig)
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, objects))
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, min_score))
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, accept_margin))
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, accept_evidence))
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, accept_objects))
      .def_readwrite(OASLAM_FIELD(RelocalizationConfig, accept_confidence));
  Value<RunnerConfig>(m, "RunnerConfig", doc::RunnerConfig)
      .def(py::init(), doc::RunnerConfig)
      .def_readwrite(OASLAM_FIELD(RunnerConfig, mode))
      .def_readwrite(OASLAM_FIELD(RunnerConfig, lag))
      .def_readwrite(OASLAM_FIELD(RunnerConfig, seed));
}

}  // namespace

void AddConfig(py::module_& m) {
  AddEnumerations(m);
  AddPointSections(m);
  AddObjectSections(m);
  Value<SlamConfig>(m, "SlamConfig", doc::SlamConfig)
      .def_readwrite(OASLAM_FIELD(SlamConfig, features))
      .def_readwrite(OASLAM_FIELD(SlamConfig, tracking))
      .def_readwrite(OASLAM_FIELD(SlamConfig, mapping))
      .def_readwrite(OASLAM_FIELD(SlamConfig, bundle))
      .def_readwrite(OASLAM_FIELD(SlamConfig, objects))
      .def_readwrite(OASLAM_FIELD(SlamConfig, relocalization))
      .def_readwrite(OASLAM_FIELD(SlamConfig, runner))
      .def_static("live", &SlamConfig::Live, doc::SlamConfig_Live)
      .def_static("offline", &SlamConfig::Offline, doc::SlamConfig_Offline)
      .def("validate", &SlamConfig::Validate, doc::SlamConfig_Validate);
  m.def("load_config", OfPath(&LoadConfig), py::arg("path"), py::arg("config"), WithoutGil(),
        doc::LoadConfig);
  m.def("apply_setting", &ApplySetting, py::arg("assignment"), py::arg("config"),
        doc::ApplySetting);
  m.def("config_to_yaml", &ConfigToYaml, py::arg("config"), doc::ConfigToYaml);
}

}  // namespace oaslam::python
