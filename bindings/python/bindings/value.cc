#include "value.h"

#include <algorithm>
#include <cmath>

namespace oaslam::python {

bool AreEqual(py::handle a, py::handle b) {
  if (py::isinstance<py::array>(a) && py::isinstance<py::array>(b)) {
    const bool has_nan = py::reinterpret_borrow<py::array>(a).dtype().kind() == 'f';
    return py::module_::import("numpy")
        .attr("array_equal")(a, b, py::arg("equal_nan") = has_nan)
        .cast<bool>();
  }
  if (py::isinstance<py::float_>(a) && py::isinstance<py::float_>(b)) {
    const auto x = a.cast<double>(), y = b.cast<double>();
    return x == y || (std::isnan(x) && std::isnan(y));
  }
  const auto is_sequence = [](py::handle h) {
    return py::isinstance<py::tuple>(h) || py::isinstance<py::list>(h);
  };
  if (!is_sequence(a) || !is_sequence(b)) return a.equal(b);
  const auto x = py::reinterpret_borrow<py::sequence>(a),
             y = py::reinterpret_borrow<py::sequence>(b);
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), &AreEqual);
}

void ExpectMembers(const py::dict& state, const std::vector<std::string>& names, py::handle type) {
  const py::list expected = py::cast(names), found(state);
  if (py::set(expected).equal(py::set(found))) return;
  throw py::value_error(
      py::str("{}.{}: pickled by another version of oaslam, with the members {}; this one has {}")
          .format(type.attr("__module__"), type.attr("__qualname__"), found, expected));
}

void RefuseMember(const std::string& name, py::handle state, py::handle type) {
  throw py::value_error(
      py::str("{}.{}: pickled by another version of oaslam: its member {} is {!r}")
          .format(type.attr("__module__"), type.attr("__qualname__"), name, state));
}

void DefinePickling(py::handle scope) {
  const auto define = [](py::handle type, auto reduce) {
    type.attr("__reduce_ex__") =
        py::cpp_function(reduce, py::name("__reduce_ex__"), py::is_method(type));
  };
  const py::handle exception = PyExc_BaseException;
  for (const auto& [name, type] : py::dict(scope.attr("__dict__"))) {
    if (!py::isinstance<py::type>(type) || PyObject_IsSubclass(type.ptr(), exception.ptr()) != 0)
      continue;
    if (py::hasattr(type, "__members__")) {
      define(type, [](const py::object& value, int) {
        return py::make_tuple(py::module_::import("builtins").attr("getattr"),
                              py::make_tuple(py::type::of(value), value.attr("name")));
      });
      continue;
    }
    if (py::hasattr(type, "__setstate__"))
      define(type, [](const py::object& value, int) {
        return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"),
                              py::make_tuple(py::type::of(value)), value.attr("__getstate__")());
      });
    else
      define(type, [](const py::object& value, int) -> py::object {
        const py::type own = py::type::of(value);
        throw py::type_error(py::str("cannot pickle '{}.{}' object")
                                 .format(own.attr("__module__"), own.attr("__qualname__")));
      });
    DefinePickling(type);
  }
}

}  // namespace oaslam::python
