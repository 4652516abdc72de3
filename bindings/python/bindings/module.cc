#include "bindings.h"

PYBIND11_MODULE(_oaslam, m) {
  using namespace oaslam::python;
  m.doc() = "Object-aided monocular visual SLAM.";
  // Types and functions show the name of the package, not of the extension module.
  const py::object own_name = m.attr("__name__");
  m.attr("__name__") = "oaslam";
  m.attr("__version__") = OASLAM_VERSION;
  AddErrors(m);
  AddTypes(m);
  AddCameras(m);
  AddConfig(m);
  AddClasses(m);
  AddDetections(m);
  AddDetectors(m);
  AddImages(m);
  AddTrajectories(m);
  AddMap(m);
  AddResults(m);
  AddMapEditing(m);
  AddCameraEstimation(m);
  AddSlam(m);
  AddMapLocalizer(m);
  AddMapViewer(m);
  AddLog(m);
  DefinePickling(m);
  m.attr("__name__") = own_name;
}
