#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/camera.h"
#include "oaslam/export.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/scale_estimate.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/types.h"

namespace oaslam {

// A map at one moment, as data. It is a handle: copies share one map, which never changes. So a
// snapshot costs next to nothing, may be kept as long as one likes, and may be read by several
// threads at once. Lengths are in map units, poses and positions in its world.
class OASLAM_API MapSnapshot {
 public:
  // An image whose key points are in the map.
  struct Keyframe {
    KeyframeId id;
    // TrackingResult::frame of its image; nothing for keyframes of a loaded file
    std::optional<int> frame;
    double timestamp = 0;  // seconds
    int camera = 0;        // index into Cameras()
    Rigid3 world_from_cam;
  };
  // A point of the map.
  struct Landmark {
    LandmarkId id;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world
    int observations = 0;                                // number of keyframes that see it
  };
  // A landmark seen in a keyframe.
  struct Observation {
    KeyframeId keyframe;
    LandmarkId landmark;
    int keypoint = 0;  // index of the key point in the keyframe: of its descriptor
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the image as the camera gave it
    double sigma_px = 1;                              // standard deviation of the pixel
  };
  // A box in which an object was detected.
  struct Sighting {
    std::optional<KeyframeId> keyframe;  // whose image it is; nothing for another image
    std::optional<int> frame;            // of the image, as Keyframe::frame
    Rigid3 world_from_cam;               // of the image
    Box box;                             // pixels of the image without distortion
    double score = 0;                    // (0, 1], of the detector
  };
  // An object of the map.
  struct Object {
    ObjectId id;
    int category_id = 0;  // the class that it was most often detected as (CategoryNames)
    std::string name;     // given by the user, else that of its class
    // In the world. Its third axis is vertical where the map knows the vertical.
    Ellipsoid ellipsoid;
    // Covariance of the centre (world), the logarithms of the half axes, and the rotation about the
    // vertical (rad; 1: that is not known).
    Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
    int observations = 0;    // images in which it was detected; Observations has at most 60
    bool has_moved = false;  // since the map was made or loaded
  };
  // ORB's descriptor of a key point: 256 bits.
  using Descriptor = std::array<uint64_t, 4>;

  struct Content;  // known to the library alone

  // The elements of one kind in the order of their ids. Each is made as it is looked at; the whole
  // is not copied. Keeps the map alive.
  template <typename Element>
  class Range {
   public:
    // An input iterator: goes forward only; its element is replaced as it moves.
    class Iterator {
     public:
      using iterator_category = std::input_iterator_tag;
      using value_type = Element;
      using difference_type = std::ptrdiff_t;
      using pointer = const Element*;
      using reference = const Element&;

      Iterator() = default;  // the end
      explicit Iterator(const Content* content)
          : content_(content), element_(Next(*content, static_cast<const Element*>(nullptr))) {}
      const Element& operator*() const { return *element_; }
      const Element* operator->() const { return &*element_; }
      Iterator& operator++() {
        element_ = Next(*content_, &*element_);
        return *this;
      }
      void operator++(int) { ++*this; }
      bool operator==(const Iterator& other) const {
        return element_.has_value() == other.element_.has_value() &&
               (!element_ || element_->id == other.element_->id);
      }

     private:
      const Content* content_ = nullptr;
      std::optional<Element> element_{};
    };

    // Of all elements of a map.
    explicit Range(std::shared_ptr<const Content> content) : content_(std::move(content)) {}
    // The first element.
    Iterator begin() const { return Iterator(content_.get()); }
    // Behind the last element.
    Iterator end() const { return {}; }
    // Whether there are none.
    bool empty() const { return begin() == end(); }
    // Their number. Of objects they are counted, one by one.
    size_t size() const { return Count(*content_, static_cast<const Element*>(nullptr)); }
    // All of them, to be indexed or sorted.
    std::vector<Element> ToVector() const { return {begin(), end()}; }

   private:
    std::shared_ptr<const Content> content_;
  };

  // An empty map.
  MapSnapshot();
  // For the library.
  explicit MapSnapshot(std::shared_ptr<const Content> content) : content_(std::move(content)) {}
  // The map of a file, with all that is in it; `submap` as for Slam::Load. Throws InputError.
  static MapSnapshot Load(const std::string& path, int submap = 0);
  // Writes the map to a file, which is replaced as a whole, or not at all. A snapshot of a running
  // Slam has no trajectory and one submap only: Slam::Save writes all. Throws InputError.
  void Save(const std::string& path) const;
  // The same as bytes, to be sent or kept elsewhere: those of the file. Throws InputError.
  static MapSnapshot FromBytes(std::string_view bytes, int submap = 0);
  std::string ToBytes() const;  // what Save writes

  // In the order of ids.
  Range<Keyframe> Keyframes() const { return Range<Keyframe>(content_); }
  // In the order of ids.
  Range<Landmark> Landmarks() const { return Range<Landmark>(content_); }
  // The objects of the map, without tracks that may still become objects.
  Range<Object> Objects() const { return Range<Object>(content_); }

  // The element with this id; nothing where the map has none.
  std::optional<Keyframe> Find(KeyframeId id) const;
  // The same.
  std::optional<Landmark> Find(LandmarkId id) const;
  // The same; also nothing for a track that may still become an object.
  std::optional<Object> Find(ObjectId id) const;

  // The landmarks that a keyframe sees; empty where there is no such keyframe.
  std::vector<Observation> Observations(KeyframeId keyframe) const;
  // The keyframes that see a landmark; empty where there is no such landmark.
  std::vector<Observation> Observations(LandmarkId landmark) const;
  // The boxes of an object from which its ellipsoid is estimated: of many images those that tell
  // most, at most 60. Empty where there is no such object.
  std::vector<Sighting> Observations(ObjectId object) const;
  // Of all key points of a keyframe, in their order, with a landmark or without. They live as long
  // as a copy of this snapshot. Empty where there is no such keyframe.
  std::span<const Descriptor> Descriptors(KeyframeId keyframe) const;

  // In the order of names.
  std::vector<AnchorPose> Anchors() const;
  // What a ray meets, the nearest first, without placing anything: each mapped object on its way,
  // the plane of the landmarks about it, and the landmark within a degree that is nearest to it.
  // `origin` and `direction`, of any length, are in the world. Throws InputError where they are not
  // finite or the direction is zero.
  std::vector<RayHit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // The cameras of the keyframes.
  const std::vector<Camera>& Cameras() const;
  // The names of the detector's categories.
  const std::map<int, std::string>& CategoryNames() const;
  // The poses of the images that the map was made of, by time stamp; of a snapshot of a running
  // Slam those of the keyframes alone.
  std::vector<StampedPose> Trajectory() const;

  // The number of submaps, this one included: of a snapshot of a running Slam, 1.
  int submaps() const;
  // Whose coordinates all positions and poses are in.
  WorldId world() const;
  // The direction opposite to gravity, world; nothing while it is unknown.
  std::optional<Eigen::Vector3d> up() const;
  // Whether `up` was measured with some of the images, by ImageInput::gravity_in_cam; else it only
  // follows from how the camera was held.
  bool is_up_measured() const;
  // Whether the unit is the metre; else it is arbitrary.
  bool is_metric() const;
  // Of a metric map whose metre follows from the usual sizes of its objects: its standard
  // deviation, divided by it. 0 where the metre was given, or the unit is arbitrary.
  double unit_sigma() const;
  // The length of the unit by the usual sizes of the objects, also of a map that is metric already:
  // their classes are known by their names, those of COCO. Takes some milliseconds.
  ScaleEstimate EstimateScale() const;
  // Grows with every change of the map or of the class names; Reset and Load do not set it back.
  // Two snapshots of one Slam with the same version are equal.
  uint64_t version() const;

  // For the library.
  const std::shared_ptr<const Content>& content() const { return content_; }

 private:
  // The element with the next larger id, the first after null; nothing at the end.
  static std::optional<Keyframe> Next(const Content& content, const Keyframe* last);
  static std::optional<Landmark> Next(const Content& content, const Landmark* last);
  static std::optional<Object> Next(const Content& content, const Object* last);
  // The pointers only tell what to count.
  static size_t Count(const Content& content, const Keyframe* kind);
  static size_t Count(const Content& content, const Landmark* kind);
  static size_t Count(const Content& content, const Object* kind);

  std::shared_ptr<const Content> content_;
};

}  // namespace oaslam
