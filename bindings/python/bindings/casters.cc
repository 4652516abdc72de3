#include "casters.h"

#include <cmath>
#include <string>

namespace oaslam::python {
namespace {

// "float32 of shape (3, 4)".
std::string Described(const py::array& array) {
  return py::str("{} of shape {}").format(array.dtype(), array.attr("shape"));
}

// An array of finite numbers of this shape.
py::array_t<double> Numbers(py::handle object, const char* what,
                            const std::vector<py::ssize_t>& shape) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!array) {
    throw py::type_error(py::str("{} is an array of numbers, not {}")
                             .format(what, py::type::handle_of(object).attr("__name__")));
  }
  if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim()))
    throw py::value_error(py::str("{} is an array of shape {}, not {}")
                              .format(what, py::tuple(py::cast(shape)), array.attr("shape")));
  for (py::ssize_t i = 0; i < array.size(); ++i)
    if (!std::isfinite(array.data()[i]))
      throw py::value_error(py::str("{} has a number that is not finite").format(what));
  return array;
}

}  // namespace

cv::Mat ImageView(py::handle object) {
  if (!py::isinstance<py::array>(object))
    throw py::type_error(py::str("an image is a NumPy array of uint8, not {}")
                             .format(py::type::handle_of(object).attr("__name__")));
  const auto array = py::reinterpret_borrow<py::array>(object);
  if (!array.dtype().equal(py::dtype::of<uint8_t>()))
    throw py::type_error("an image has elements of uint8, not " + Described(array));
  const py::ssize_t channels = array.ndim() == 3 ? array.shape(2) : 1;
  const bool is_image =
      array.ndim() == 2 || (array.ndim() == 3 && (channels == 1 || channels == 3 || channels == 4));
  if (!is_image || array.size() == 0)
    throw py::value_error(
        "an image has the shape (height, width), or (height, width, 3) in the order BGR: this is " +
        Described(array));
  // An axis of one element has any stride.
  const bool pixels_are_dense = (array.shape(1) == 1 || array.strides(1) == channels) &&
                                (channels == 1 || array.strides(2) == 1);
  const py::ssize_t row = array.shape(1) * channels;
  const bool rows_follow = array.shape(0) == 1 || array.strides(0) >= row;
  if (!pixels_are_dense || !rows_follow)
    throw py::value_error(
        "the pixels of an image must follow each other in memory (numpy.ascontiguousarray copies "
        "it so): this has the strides " +
        std::string(py::str(array.attr("strides"))));
  return {static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
          CV_8UC(static_cast<int>(channels)), const_cast<void*>(array.data()),
          static_cast<size_t>(array.shape(0) == 1 ? row : array.strides(0))};
}

py::object ArrayOf(const cv::Mat& image) {
  if (image.empty()) return py::none();
  std::vector<py::ssize_t> shape{image.rows, image.cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(image.step[0]), image.channels()};
  if (image.channels() > 1) {
    shape.push_back(image.channels());
    strides.push_back(1);
  }
  const py::capsule owner(new cv::Mat(image), [](void* p) { delete static_cast<cv::Mat*>(p); });
  return py::array(py::dtype::of<uint8_t>(), shape, strides, image.data, owner);
}

Rigid3 PoseOf(py::handle object) {
  const auto array = Numbers(object, "a pose", {4, 4});
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> m(array.data());
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-6;  // enough for numbers that were written with seven digits
  if (!(r * r.transpose()).isApprox(Eigen::Matrix3d::Identity(), kTolerance) || r.determinant() < 0)
    throw py::value_error("a pose has a rotation in its first three rows and columns");
  if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw py::value_error("the last row of a pose is 0 0 0 1");
  return {Eigen::Quaterniond(r).normalized(), m.topRightCorner<3, 1>()};
}

py::array_t<double> ArrayOf(const Rigid3& pose) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRows<3>() = pose.Matrix();
  return ArrayOf(matrix);
}

PathText PathOf(py::handle object) {
  PyObject* converted = nullptr;
  if (PyUnicode_FSConverter(object.ptr(), &converted) == 0) throw py::error_already_set();
  const auto bytes = py::reinterpret_steal<py::bytes>(converted);
  return {std::string(bytes)};
}

py::str FileTextOf(const std::string& text) {
  auto decoded = py::reinterpret_steal<py::str>(
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<py::ssize_t>(text.size())));
  if (!decoded) throw py::error_already_set();
  return decoded;
}

Eigen::Vector3d VectorOf(py::handle object) {
  return Eigen::Map<const Eigen::Vector3d>(Numbers(object, "a vector", {3}).data());
}

}  // namespace oaslam::python
