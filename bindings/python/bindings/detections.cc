#include "bindings.h"
#include "oaslam/class_names.h"
#include "oaslam/class_relations.h"
#include "oaslam/detection_file.h"

namespace oaslam::python {

// Members that are containers are read-only: Python gets a copy, and changes of that would silently
// be lost.
void AddClasses(py::module_& m) {
  Value<ClassRelations>(m, "ClassRelations", doc::ClassRelations)
      .def(py::init([](const std::map<int, int>& whole_of, const std::set<int>& movable) {
             return ClassRelations{whole_of, movable};
           }),
           py::kw_only(), py::arg("whole_of") = py::dict(), py::arg("movable") = py::set(),
           doc::ClassRelations)
      .keep("whole_of", &ClassRelations::whole_of)
      .keep("movable", &ClassRelations::movable)
      .def_property_readonly(
          "whole_of",
          [](const ClassRelations& r) {
            return py::module_::import("types").attr("MappingProxyType")(py::cast(r.whole_of));
          },
          doc::ClassRelations_whole_of)
      .def_property_readonly(
          "movable", [](const ClassRelations& r) { return py::frozenset(py::cast(r.movable)); },
          doc::ClassRelations_movable)
      .def("empty", &ClassRelations::Empty, doc::ClassRelations_Empty)
      .def("is_part_of", &ClassRelations::IsPartOf, py::arg("part"), py::arg("whole"),
           doc::ClassRelations_IsPartOf)
      .def("is_movable", &ClassRelations::IsMovable, py::arg("category"),
           doc::ClassRelations_IsMovable)
      .def(
          "__eq__", [](const ClassRelations& a, const ClassRelations& b) { return a == b; },
          py::is_operator());
  Value<Classes>(m, "Classes", doc::Classes)
      .def_readonly(OASLAM_FIELD(Classes, names))
      .def_readonly(OASLAM_FIELD(Classes, relations));
  m.def("coco_class_names", &CocoClassNames, doc::CocoClassNames);
  m.def("load_classes", OfPath(&LoadClasses), py::arg("path"), WithoutGil(), doc::LoadClasses);
  m.def("part_of_itself", &PartOfItself, py::arg("whole_of"), doc::PartOfItself);
  m.def("name_of", &NameOf, py::arg("names"), py::arg("category_id"), doc::NameOf);
}

void AddDetections(py::module_& m) {
  Value<ImageDetections>(m, "ImageDetections", doc::ImageDetections)
      .def(py::init([](const FileText& file_name, const std::vector<Detection>& detections) {
             return ImageDetections{file_name, detections};
           }),
           py::arg("file_name"), py::arg("detections"), doc::ImageDetections)
      .def_file_name(OASLAM_FIELD(ImageDetections, file_name))
      .def_tuple(OASLAM_FIELD(ImageDetections, detections));
  Value<DetectionTable>(m, "DetectionTable", doc::DetectionTable)
      .def(py::init<std::vector<ImageDetections>>(), py::arg("images") = py::tuple(),
           doc::DetectionTable)
      .keep(
          "images", [](const DetectionTable& table) { return py::cast(table.images()); },
          [](DetectionTable& table, py::handle state) {
            table = DetectionTable(state.cast<std::vector<ImageDetections>>());
          })
      .def(
          "find", [](const DetectionTable& table, const FileText& image_name) -> const auto& {
            return table.Find(image_name);
          },
          py::arg("image_name"), py::return_value_policy::copy, doc::DetectionTable_Find)
      .def_property_readonly("images", &DetectionTable::images, py::return_value_policy::copy,
                             doc::DetectionTable_images);
  m.def("load_detections", OfPath(&LoadDetections), py::arg("path"), WithoutGil(),
        doc::LoadDetections);
  m.def("save_detections", OfPath(&SaveDetections), py::arg("path"), py::arg("images"),
        WithoutGil(), doc::SaveDetections);
}

}  // namespace oaslam::python
