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
// threads at once. Lengths are in map units, poses and positions in its world:
//
//   const MapSnapshot map = MapSnapshot::Load("room.map");
//   for (const MapSnapshot::Object& object : map.Objects())
//     std::cout << object.name << " " << object.ellipsoid.center.transpose() << "\n";
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
    // Index of the key point in the keyframe, and of its descriptor in Descriptors.
    int keypoint = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the image as the camera gave it
    double sigma_px = 1;                              // standard deviation of the pixel
  };
  // A box in which an object was detected.
  struct Sighting {
    // The keyframe whose image the box is in; nothing where that image is no keyframe.
    std::optional<KeyframeId> keyframe;
    std::optional<int> frame;  // of the image, as Keyframe::frame
    Rigid3 world_from_cam;     // of the image
    Box box;                   // pixels of the image without distortion
    double score = 0;          // (0, 1], of the detector
  };
  // An object of the map.
  struct Object {
    ObjectId id;
    int category_id = 0;  // the class that it was most often detected as (CategoryNames)
    std::string name;     // given by the user, else that of its class
    // In the world. Its third axis is vertical where the map knows the vertical.
    Ellipsoid ellipsoid;
    // Covariance of the centre (world), the logarithms of the half axes, and the rotation about the
    // vertical (rad; a variance of 1 means that this rotation is not known).
    Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
    int observations = 0;    // images in which it was detected; Observations has at most 60
    bool has_moved = false;  // since the map was made or loaded
  };
  // ORB's descriptor of a key point: 256 bits.
  using Descriptor = std::array<uint64_t, 4>;

  struct Content;  // known to the library alone

  // The elements of one kind in the order of their ids. The iterator makes each element when it
  // reaches it; the map is not copied. A range keeps the map alive.
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
    // The number of elements. For objects this call counts them one by one.
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
  // Loads a map from the bytes of a map file, which ToBytes returns. Throws InputError.
  static MapSnapshot FromBytes(std::string_view bytes, int submap = 0);
  // The bytes of the file that Save writes, to be sent or stored elsewhere.
  std::string ToBytes() const;

  // The keyframes of the map, in the order of their ids.
  Range<Keyframe> Keyframes() const { return Range<Keyframe>(content_); }
  // The landmarks of the map, in the order of their ids.
  Range<Landmark> Landmarks() const { return Range<Landmark>(content_); }
  // The objects of the map, without tracks that may still become objects.
  Range<Object> Objects() const { return Range<Object>(content_); }

  // The keyframe with this id; nothing where the map has none.
  std::optional<Keyframe> Find(KeyframeId id) const;
  // The landmark with this id; nothing where the map has none.
  std::optional<Landmark> Find(LandmarkId id) const;
  // The object with this id; nothing where the map has none, or only a track that may still become
  // an object.
  std::optional<Object> Find(ObjectId id) const;

  // The landmarks that a keyframe sees; empty where there is no such keyframe.
  std::vector<Observation> Observations(KeyframeId keyframe) const;
  // The keyframes that see a landmark; empty where there is no such landmark.
  std::vector<Observation> Observations(LandmarkId landmark) const;
  // The boxes of an object from which its ellipsoid is estimated: at most 60, chosen from different
  // viewpoints and times. Empty where there is no such object.
  std::vector<Sighting> Observations(ObjectId object) const;
  // The descriptors of all key points of a keyframe, in their order, with a landmark or without.
  // The span is valid as long as a copy of this snapshot exists. Empty where there is no such
  // keyframe.
  std::span<const Descriptor> Descriptors(KeyframeId keyframe) const;

  // The anchors of the map, in the order of their names.
  std::vector<AnchorPose> Anchors() const;
  // Returns what a ray meets, the nearest first, and places no anchor: each mapped object that the
  // ray crosses, the plane of the landmarks around the ray, and the landmark nearest to the ray
  // within one degree. `origin` and `direction`, of any length, are in the world. Throws InputError
  // where they are not finite or the direction is zero.
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
  // The world in whose frame all positions and poses are.
  WorldId world() const;
  // The direction opposite to gravity, world; nothing while it is unknown.
  std::optional<Eigen::Vector3d> up() const;
  // Whether `up` was measured with some of the images, by ImageInput::gravity_in_cam; else it only
  // follows from how the camera was held.
  bool is_up_measured() const;
  // Whether the unit is the metre; else it is arbitrary.
  bool is_metric() const;
  // The relative standard deviation of the metre, where the map got its metre from the usual sizes
  // of its objects. 0 where the metre was given, or the unit is arbitrary.
  double unit_sigma() const;
  // Estimates the length of the unit from the usual sizes of the objects, also for a map that is
  // metric already. It recognises the classes of objects by COCO's names. Takes some milliseconds.
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
