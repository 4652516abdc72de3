#include "readable_images.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "oaslam/util/bad_input.h"
#include "oaslam/util/uri.h"

namespace oaslam::apps {

ReadableImages::ReadableImages(std::unique_ptr<ImageSource> images, const Options& options)
    : images_(std::move(images)), options_(options) {
  const size_t looked_at = options.is_live ? 1 : 3;
  while (first_.size() < looked_at)
    if (auto image = Read())
      first_.push_back(std::move(*image));
    else
      break;
  if (first_.empty()) return;
  const auto has_last_size = [&](const InputImage& image) {
    return image.image.size() == first_.back().image.size();
  };
  // Of three, that of two; else that of the first.
  size_ = std::ranges::count_if(first_, has_last_size) > 1 ? first_.back().image.size()
                                                           : first_.front().image.size();
}

std::optional<InputImage> ReadableImages::Next() {
  while (true) {
    std::optional<InputImage> image;
    if (first_.empty()) {
      image = Read();
    } else {
      image = std::move(first_.front());
      first_.pop_front();
    }
    if (!image || options_.any_size || image->image.size() == size_) {
      if (!image && options_.says && skipped_ > 0)
        spdlog::warn("{} of {} images were skipped", std::exchange(skipped_, 0), read_);
      return image;
    }
    Skip(*image, fmt::format("is {} x {}, the others are {} x {}", image->image.cols,
                             image->image.rows, size_.width, size_.height));
  }
}

std::optional<InputImage> ReadableImages::Read() {
  while (std::optional<InputImage> image = images_->Next()) {
    ++read_;
    if (image->image.empty()) {
      Skip(*image, "missing or unreadable");
    } else if (last_timestamp_ && !(image->timestamp > *last_timestamp_)) {
      Skip(*image, fmt::format("time stamp {:.6f} is not after {:.6f}", image->timestamp,
                               *last_timestamp_));
    } else {
      last_timestamp_ = image->timestamp;
      return image;
    }
  }
  return std::nullopt;
}

void ReadableImages::Skip(const InputImage& image, const std::string& why) {
  const std::string what = fmt::format("image {} ({}): {}", image.index, image.name, why);
  if (++skipped_ == 1) first_skipped_ = what;
  if (options_.says) spdlog::warn("{}, skipped", what);
}

InputError ReadableImages::NoneReadable(const std::string& source) const {
  return BadInput("{}: no readable image{}{}", WithoutPassword(source),
                  first_skipped_.empty() ? "" : "; ", first_skipped_);
}

}  // namespace oaslam::apps
