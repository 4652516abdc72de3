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

void PickleByName(py::handle module) {
  for (const auto& [name, type] : module.attr("__dict__").cast<py::dict>()) {
    if (!py::hasattr(type, "__members__")) continue;
    type.attr("__reduce_ex__") = py::cpp_function(
        [getattr = py::module_::import("builtins").attr("getattr")](const py::object& value, int) {
          return py::make_tuple(getattr, py::make_tuple(py::type::of(value), value.attr("name")));
        },
        py::name("__reduce_ex__"), py::is_method(type));
  }
}

}  // namespace oaslam::python
