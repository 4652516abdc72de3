#include "oaslam/map_editing.h"

#include "bindings.h"
#include "oaslam/export_map.h"

namespace oaslam::python {
namespace {

// A change to an object as keyword arguments.
MapSnapshot Edited(const MapSnapshot& map, ObjectId object, const std::optional<std::string>& name,
                   std::optional<ObjectId> same_as, bool remove, const SlamConfig& config) {
  return EditObject(map, object, {name, same_as, remove}, config);
}

}  // namespace

void AddMapEditing(py::module_& m) {
  m.def("edit_object", &Edited, py::arg("map"), py::arg("object"), py::kw_only(),
        py::arg("name") = std::nullopt, py::arg("same_as") = std::nullopt,
        py::arg("remove") = false, py::arg("config") = SlamConfig::Offline(), WithoutGil(),
        ObjectEditDocs(doc::EditObject).c_str());
  py::class_<MergedMaps>(m, "MergedMaps", doc::MergedMaps)
      .def_readonly(OASLAM_FIELD(MergedMaps, map))
      .def_readonly(OASLAM_FIELD(MergedMaps, evidence));
  m.def("merge_maps", &MergeMaps, py::arg("first"), py::arg("second"), py::kw_only(),
        py::arg("mode") = RelocalizationMode::kPointsAndObjects,
        py::arg("config") = SlamConfig::Offline(), WithoutGil(), doc::MergeMaps);
  auto format = py::enum_<MapFormat>(m, "MapFormat", doc::MapFormat)
                    .value("PLY", MapFormat::kPly)
                    .value("GLTF", MapFormat::kGltf)
                    .value("TUM", MapFormat::kTum)
                    .value("COLMAP", MapFormat::kColmap)
                    .value("NERFSTUDIO", MapFormat::kNerfstudio)
                    .value("MCAP", MapFormat::kMcap);
  SayAsToString(format);
  m.def(
      "export_map",
      [](const MapSnapshot& map, MapFormat to, const PathText& path, bool with_ellipsoids,
         const std::vector<std::string>& images) {
        ExportMap(map, to, path, {with_ellipsoids, images});
      },
      py::arg("map"), py::arg("format"), py::arg("path"), py::kw_only(),
      py::arg("with_ellipsoids") = false, py::arg("images") = std::vector<std::string>(),
      WithoutGil(),
      (std::string(doc::ExportMap) + "\n\nwith_ellipsoids: " + doc::ExportOptions_with_ellipsoids +
       "\nimages: " + doc::ExportOptions_images)
          .c_str());
}

}  // namespace oaslam::python
