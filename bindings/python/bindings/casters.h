#pragma once

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/rigid3.h"

// How values pass between Python and C++: images and poses as NumPy arrays. Other types of elements
// raise TypeError, other shapes and values ValueError; both say what was expected.
namespace oaslam::python {

namespace py = pybind11;

// An 8-bit grey, BGR or BGRA image as a view of the array: nothing is copied. The array must
// outlive the view. Rows may have gaps, pixels may not.
cv::Mat ImageView(py::handle object);
// The image as an array that shares its memory and keeps it; None for an empty one.
py::object ArrayOf(const cv::Mat& image);

// A 4x4 array, whose rotation part must be orthonormal to 1e-6.
Rigid3 PoseOf(py::handle object);
py::array_t<double> ArrayOf(const Rigid3& pose);

// A path: str, bytes, or os.PathLike. Encoded as by os.fsencode, also where it is not UTF-8.
struct PathText : std::string {};
PathText PathOf(py::handle object);
// The name of a file, or a text that may contain one: as PathText, but only str.
struct FileText : std::string {};
// Decoded as by os.fsdecode.
py::str FileTextOf(const std::string& text);

// Three finite numbers.
Eigen::Vector3d VectorOf(py::handle object);

// A row-major copy of a matrix, of shape (rows, columns); (rows) for a vector.
template <typename Matrix>
py::array_t<double> ArrayOf(const Eigen::MatrixBase<Matrix>& matrix) {
  constexpr int kRows = Matrix::RowsAtCompileTime, kColumns = Matrix::ColsAtCompileTime;
  py::array_t<double> array(kColumns == 1 ? std::vector<py::ssize_t>{kRows}
                                          : std::vector<py::ssize_t>{kRows, kColumns});
  Eigen::Map<
      Eigen::Matrix<double, kRows, kColumns, kColumns == 1 ? Eigen::ColMajor : Eigen::RowMajor>>(
      array.mutable_data()) = matrix;
  return array;
}

// An array of records (PYBIND11_NUMPY_DTYPE) that takes over the elements of a vector.
template <typename Row>
py::array_t<Row> ArrayOfRows(std::vector<Row> rows) {
  auto* kept = new std::vector<Row>(std::move(rows));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Row>*>(p); });
  return py::array_t<Row>(static_cast<py::ssize_t>(kept->size()), kept->data(), owner);
}

}  // namespace oaslam::python

namespace pybind11::detail {

template <>
struct type_caster<cv::Mat> {
  PYBIND11_TYPE_CASTER(cv::Mat, const_name("numpy.ndarray[numpy.uint8]"));
  bool load(handle source, bool) {
    value = oaslam::python::ImageView(source);
    return true;
  }
  static handle cast(const cv::Mat& image, return_value_policy, handle) {
    return oaslam::python::ArrayOf(image).release();
  }
};

template <>
struct type_caster<oaslam::Rigid3> {
  PYBIND11_TYPE_CASTER(oaslam::Rigid3, const_name("numpy.ndarray[numpy.float64[4, 4]]"));
  bool load(handle source, bool) {
    value = oaslam::python::PoseOf(source);
    return true;
  }
  static handle cast(const oaslam::Rigid3& pose, return_value_policy, handle) {
    return oaslam::python::ArrayOf(pose).release();
  }
};

template <>
struct type_caster<oaslam::python::PathText> {
  PYBIND11_TYPE_CASTER(oaslam::python::PathText, const_name("os.PathLike"));
  bool load(handle source, bool) {
    value = oaslam::python::PathOf(source);
    return true;
  }
};

template <>
struct type_caster<oaslam::python::FileText> {
  PYBIND11_TYPE_CASTER(oaslam::python::FileText, const_name("str"));
  bool load(handle source, bool) {
    if (!isinstance<str>(source)) return false;
    static_cast<std::string&>(value) = oaslam::python::PathOf(source);
    return true;
  }
};

template <>
struct type_caster<Eigen::Vector3d> {
  PYBIND11_TYPE_CASTER(Eigen::Vector3d, const_name("numpy.ndarray[numpy.float64[3]]"));
  bool load(handle source, bool) {
    value = oaslam::python::VectorOf(source);
    return true;
  }
  static handle cast(const Eigen::Vector3d& vector, return_value_policy, handle) {
    return oaslam::python::ArrayOf(vector).release();
  }
};

}  // namespace pybind11::detail
