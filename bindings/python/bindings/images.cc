#include <thread>

#include "bindings.h"
#include "exclusive.h"
#include "oaslam/image_source.h"
#include "oaslam/latest_image.h"

namespace oaslam::python {
namespace {

// Reads a source that another object owns, too.
class SharedSource : public ImageSource {
 public:
  explicit SharedSource(std::shared_ptr<ImageSource> source) : source_(std::move(source)) {}
  std::optional<InputImage> Next() override { return source_->Next(); }
  int size() const override { return source_->size(); }
  void Stop() override { source_->Stop(); }

 private:
  std::shared_ptr<ImageSource> source_;
};

// An image source, whose Next may be called by one thread at a time, and Stop by any.
class Images {
 public:
  explicit Images(std::shared_ptr<ImageSource> source) : source_(std::move(source)) {}
  virtual ~Images() = default;

  std::optional<InputImage> Next() {
    const Turn turn(is_read_, kIsRead);
    const WithoutPythonsLock without_gil;
    return source_->Next();
  }
  int size() const { return source_->size(); }
  void Stop() {
    const WithoutPythonsLock without_gil;
    source_->Stop();
  }
  // Hands over the source to its only reader from then on.
  std::shared_ptr<ImageSource> Take() {
    Turn(is_read_, kIsRead).Keep();
    return source_;
  }

 private:
  static constexpr const char* kIsRead = "this image source is read by another thread";

  std::shared_ptr<ImageSource> source_;
  Turn::Flag is_read_;
};

class LatestImages : public Images {
 public:
  explicit LatestImages(const std::shared_ptr<ImageSource>& source)
      : LatestImages(std::make_shared<LatestImageSource>(std::make_unique<SharedSource>(source))) {}
  explicit LatestImages(std::shared_ptr<LatestImageSource> latest)
      : Images(latest), latest_(latest.get()) {}
  int dropped() const { return latest_->dropped(); }

 private:
  const LatestImageSource* latest_;
};

// Stops waiting for an image after Ctrl-C, for which Python checks on its main thread only.
std::function<bool()> StoppedBySignals() {
  return [reader = std::this_thread::get_id()] {
    if (std::this_thread::get_id() != reader) return false;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return false;
  };
}

// `Source`: Images or LatestImages.
template <typename Source, auto Opener>
std::shared_ptr<Source> Open(const PathText& source, std::optional<double> fps, int from, int to,
                             bool color, Orientation orientation,
                             std::optional<double> follow_quiet_s, bool color_if_free,
                             const std::string& topic) {
  ImageSourceOptions options{fps, from, to, color, orientation, {}, color_if_free};
  if (follow_quiet_s) options.follow = FollowOptions{*follow_quiet_s};
  options.stopped = StoppedBySignals();
  options.topic = topic;
  decltype(Opener(source, options)) opened;
  {
    const WithoutPythonsLock without_gil;
    opened = Opener(source, options);
  }
  return MakeWithoutGil<Source>(std::shared_ptr(std::move(opened)));
}

InputImage NextOrStop(Images& images) {
  std::optional<InputImage> image = images.Next();
  if (!image) throw py::stop_iteration();
  return std::move(*image);
}

std::string WithSourceOptions(const char* text) {
  return std::string(text) + "\n\nfps: " + doc::ImageSourceOptions_fps +
         "\nfrom_: " + doc::ImageSourceOptions_from + "\nto: " + doc::ImageSourceOptions_to +
         "\ncolor: " + doc::ImageSourceOptions_color +
         "\norientation: " + doc::ImageSourceOptions_orientation +
         "\nfollow_quiet_s: " + doc::FollowOptions_quiet_s +
         "\ncolor_if_free: " + doc::ImageSourceOptions_color_if_free +
         "\ntopic: " + doc::ImageSourceOptions_topic;
}

}  // namespace

void AddImages(py::module_& m) {
  py::enum_<Orientation>(m, "Orientation", doc::Orientation)
      .value("STORED", Orientation::kStored, doc::Orientation_kStored)
      .value("UPRIGHT", Orientation::kUpright, doc::Orientation_kUpright);
  Value<InputImage>(m, "InputImage", doc::InputImage)
      .def_readonly(OASLAM_FIELD(InputImage, index))
      .def_readonly(OASLAM_FIELD(InputImage, timestamp))
      .def_file_name(OASLAM_FIELD(InputImage, name))
      .keep("image", &InputImage::image)
      .def_property_readonly(
          "image", [](const InputImage& i) { return i.image; }, doc::InputImage_image)
      .def_file_name(OASLAM_FIELD(InputImage, path))
      .def_readonly(OASLAM_FIELD(InputImage, orientation))
      .def_readonly(OASLAM_FIELD(InputImage, taken_s));
  py::class_<Images, std::shared_ptr<Images>>(m, "ImageSource", doc::ImageSource)
      .def("__iter__", [](const std::shared_ptr<Images>& images) { return images; })
      .def("__next__", &NextOrStop)
      .def("next", &Images::Next, doc::ImageSource_Next)
      .def_property_readonly("size", &Images::size, doc::ImageSource_size)
      .def("stop", &Images::Stop, doc::ImageSource_Stop);
  py::class_<LatestImages, Images, std::shared_ptr<LatestImages>>(m, "LatestImageSource",
                                                                  doc::LatestImageSource)
      .def(py::init([](Images& source) { return MakeWithoutGil<LatestImages>(source.Take()); }),
           py::arg("source"), doc::LatestImageSource)
      .def_property_readonly("dropped", &LatestImages::dropped, doc::LatestImageSource_dropped);
  const ImageSourceOptions options;
  const auto def_opener = [&](const char* name, auto function, const char* text) {
    m.def(name, function, py::arg("source"), py::kw_only(), py::arg("fps") = options.fps,
          py::arg("from_") = options.from, py::arg("to") = options.to,
          py::arg("color") = options.color, py::arg("orientation") = options.orientation,
          py::arg("follow_quiet_s") = std::nullopt,
          py::arg("color_if_free") = options.color_if_free, py::arg("topic") = options.topic,
          WithSourceOptions(text).c_str());
  };
  def_opener("open_images", &Open<Images, &OpenImages>, doc::OpenImages);
  def_opener("open_camera", &Open<LatestImages, &OpenCamera>, doc::OpenCamera);
  Value<ListedImage>(m, "ListedImage", doc::ListedImage)
      .def_readonly(OASLAM_FIELD(ListedImage, timestamp))
      .def_file_name(OASLAM_FIELD(ListedImage, path));
  m.def(
      "list_images",
      [](const PathText& source, std::optional<double> fps, int from, int to) {
        return ListImages(source, {.fps = fps, .from = from, .to = to});
      },
      py::arg("source"), py::kw_only(), py::arg("fps") = options.fps,
      py::arg("from_") = options.from, py::arg("to") = options.to, WithoutGil(), doc::ListImages);
  m.def("focal_length_35mm", OfPath(&FocalLength35mm), py::arg("source"), WithoutGil(),
        doc::FocalLength35mm);
}

}  // namespace oaslam::python
