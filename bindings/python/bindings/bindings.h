#pragma once

#include <string>

#include "casters.h"
#include "docstrings.h"
#include "gil.h"
#include "value.h"

namespace oaslam::python {

// Each binds a group of public headers. The types of a function's arguments must be bound before
// it, so that its signature has their Python names.
void AddErrors(py::module_& m);
void AddTypes(py::module_& m);
void AddCameras(py::module_& m);
void AddConfig(py::module_& m);
void AddClasses(py::module_& m);
void AddDetections(py::module_& m);
void AddDetectors(py::module_& m);
void AddImages(py::module_& m);
void AddMap(py::module_& m);
void AddMapEditing(py::module_& m);
void AddResults(py::module_& m);
void AddTrajectories(py::module_& m);
void AddCameraEstimation(py::module_& m);
void AddSlam(py::module_& m);
void AddMapLocalizer(py::module_& m);
void AddMapViewer(py::module_& m);
void AddLog(py::module_& m);

// A member and its docstring, for def_readwrite and def_readonly.
#define OASLAM_FIELD(type, name) #name, &type::name, doc::type##_##name

// Of a function that takes the members of an ObjectEdit as arguments.
inline std::string ObjectEditDocs(const char* text) {
  return std::string(text) + "\n\nname: " + doc::ObjectEdit_name +
         "\nsame_as: " + doc::ObjectEdit_same_as + "\nremove: " + doc::ObjectEdit_remove;
}

// Python's name of an enumerator is that of C++ without the k, in capitals.
template <typename Enum>
void SayAsToString(py::enum_<Enum>& type) {
  type.attr("__str__") = py::cpp_function([](Enum value) { return std::string(ToString(value)); },
                                          py::name("__str__"), py::is_method(type));
}

// The same for enumerators whose words in a configuration file are their names in small letters.
template <typename Enum>
void SayAsWord(py::enum_<Enum>& type) {
  type.attr("__str__") = py::cpp_function(
      [](const py::object& value) {
        return value.attr("name").attr("lower")().attr("replace")("_and_", "+");
      },
      py::name("__str__"), py::is_method(type));
}

// A function whose first argument is a path.
template <typename Result, typename... Args>
auto OfPath(Result (*function)(const std::string&, Args...)) {
  return [function](const PathText& path, Args... args) -> Result {
    return function(path, std::forward<Args>(args)...);
  };
}

}  // namespace oaslam::python
