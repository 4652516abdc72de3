#include "oaslam/map_viewer.h"

#include "bindings.h"
#include "exclusive.h"

namespace oaslam::python {
namespace {

using ExclusiveSlam = Exclusive<Slam>;
using ExclusiveViewer = Exclusive<MapViewer>;

std::shared_ptr<ExclusiveViewer> MakeViewer(ExclusiveSlam& slam, int port,
                                            const std::string& title) {
  return slam.Use([&](Slam& s) {
    return std::shared_ptr<ExclusiveViewer>(
        new ExclusiveViewer(s, MapViewerOptions{.port = port, .title = title}), DeleteWithoutGil());
  });
}

void Show(ExclusiveViewer& viewer, ExclusiveSlam& slam, const cv::Mat& image,
          const TrackingResult& result) {
  ImageInput input;
  input.image = image;
  viewer.Use([&](MapViewer& v) { slam.UseToo([&](const Slam& s) { v.Show(s, input, result); }); });
}

void ShowMap(ExclusiveViewer& viewer, ExclusiveSlam& slam) {
  viewer.Use([&](MapViewer& v) { slam.UseToo([&](const Slam& s) { v.ShowMap(s); }); });
}

}  // namespace

void AddMapViewer(py::module_& m) {
  py::class_<ExclusiveViewer, std::shared_ptr<ExclusiveViewer>>(m, "MapViewer", doc::MapViewer)
      .def(py::init(&MakeViewer), py::arg("slam"), py::kw_only(),
           py::arg("port") = MapViewerOptions::kDefaultPort, py::arg("title") = "",
           doc::MapViewer_MapViewer)
      .def_property_readonly(
          "url",
          [](ExclusiveViewer& viewer) { return viewer.Use([](MapViewer& v) { return v.url(); }); },
          doc::MapViewer_url)
      .def("show", &Show, py::arg("slam"), py::arg("image"), py::arg("result"), doc::MapViewer_Show)
      .def("show_map", &ShowMap, py::arg("slam"), doc::MapViewer_ShowMap);
}

}  // namespace oaslam::python
