#include "oaslam/recordings/recording_reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "oaslam/formats/leftover.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/recordings/containers.h"
#include "oaslam/recordings/decompression.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadata = "metadata.yaml";
constexpr std::string_view kMetadataKey = "rosbag2_bagfile_information";

bool HasMagic(const std::string& path, std::string_view magic) {
  std::string head(magic.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  return file.read(head.data(), static_cast<std::streamsize>(head.size())) && head == magic;
}

// The extension of a file that was compressed as a whole, as rosbag2 (.zstd) or zstd (.zst) calls
// it.
std::string PackedExtension(const std::string& path) {
  const fs::path file(path);
  const bool is_packed = file.extension() == ".zstd" || file.extension() == ".zst";
  return is_packed ? file.stem().extension().string() : "";
}

bool IsPacked(const std::string& path) {
  const std::string extension = PackedExtension(path);
  return extension == ".db3" || extension == ".mcap" || extension == ".bag";
}

bool IsFile(const std::string& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) &&
         (HasMagic(path, kMcapMagic) || HasMagic(path, kBagMagic) || IsPacked(path) ||
          (path.ends_with(".db3") && HasMagic(path, kSqliteMagic)));
}

// The files of a folder without metadata, in the order in which the recorder numbered them; none
// where there is anything that neither rosbag2 nor this program writes.
std::vector<std::string> FilesIn(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string path = entry.path().string();
    if (path.ends_with(".db3-wal") || path.ends_with(".db3-shm")) continue;
    if (path.ends_with(".oaslam") || path.ends_with(".localized")) continue;
    if (!IsFile(path) || path.ends_with(".bag") || PackedExtension(path) == ".bag") return {};
    files.push_back(path);
  }
  // "drive_2.mcap" before "drive_10.mcap".
  std::ranges::sort(files, {},
                    [](const std::string& path) { return std::pair(path.size(), path); });
  return files;
}

std::vector<std::string> FilesOfMetadata(const std::string& folder) {
  const std::string path = (fs::path(folder) / kMetadata).string();
  const std::string text = ReadTextFile(path);
  const YAML::Node about = ParseYamlMapping(text, path)[std::string(kMetadataKey)];
  const YAML::Node names = about && about.IsMap() ? about["relative_file_paths"] : YAML::Node();
  if (!names || !names.IsSequence() || names.size() == 0)
    throw BadInput("{}: relative_file_paths: not there", path);
  std::vector<std::string> files;
  for (const YAML::Node& name : names) {
    if (!name.IsScalar()) throw BadInput("{}: relative_file_paths: {}", path, TextOfNode(name));
    // Before Foxy they began with the folder.
    fs::path file = fs::path(folder) / name.Scalar();
    std::error_code error;
    if (!fs::exists(file, error)) file = fs::path(folder) / fs::path(name.Scalar()).filename();
    if (!fs::exists(file, error))
      throw BadInput("{}: {} is not there, of which {} tells", folder, name.Scalar(), kMetadata);
    files.push_back(file.string());
  }
  return files;
}

std::unique_ptr<RecordingReader> OpenPlain(const RecordingFile& file, BytesWanted wanted) {
  if (HasMagic(file.path, kMcapMagic)) return OpenMcap(file, std::move(wanted));
  if (HasMagic(file.path, kBagMagic)) return OpenRosBag(file, std::move(wanted));
  if (HasMagic(file.path, kSqliteMagic)) return OpenRosbagDatabase(file, std::move(wanted));
  throw BadInput("{}: is neither an MCAP file, a ROS 1 bag (2.0), nor a database of rosbag2",
                 file.name);
}

// Of a file that is open and may have no other path.
std::string PathOf(const UniqueFd& file) { return fmt::format("/proc/self/fd/{}", file.get()); }

// Decompresses a file into the folder of temporary files. The copy has no name there, so that it is
// gone with its last descriptor.
UniqueFd PlainCopyOf(const std::string& path) {
  std::string name = TemporaryPattern();
  UniqueFd copy(mkostemp(name.data(), O_CLOEXEC));
  if (!copy)
    throw BadInput("{}: cannot be decompressed as {}: {}", path, name,
                   std::generic_category().message(errno));
  unlink(name.c_str());
  DecompressFile(path, PathOf(copy));
  return copy;
}

bool IsMostlyFull(const fs::path& file) {
  std::error_code error;
  const fs::space_info space = fs::space(file.parent_path(), error);
  return !error && space.available < space.capacity / 2;
}

// A run opens a recording several times. Copies are kept, the oldest ones as long as half of the
// disk is free. The result is a descriptor of the caller's.
UniqueFd KeptCopyOf(const std::string& path) {
  struct Copy {
    std::string state;
    UniqueFd file;
  };
  static std::mutex mutex;
  static std::deque<Copy> copies;
  const std::string state = StateOfRecording(path);
  const std::lock_guard lock(mutex);
  auto found = std::ranges::find(copies, state, &Copy::state);
  if (found == copies.end()) {
    while (!copies.empty() && IsMostlyFull(TemporaryPattern())) copies.pop_front();
    try {
      copies.push_back({state, PlainCopyOf(path)});
    } catch (const InputError&) {
      if (copies.empty()) throw;
      copies.clear();  // there may be room then
      copies.push_back({state, PlainCopyOf(path)});
    }
    found = std::prev(copies.end());
  }
  return UniqueFd(fcntl(found->file.get(), F_DUPFD_CLOEXEC, 0));
}

std::unique_ptr<RecordingReader> OpenFile(const std::string& path, BytesWanted wanted) {
  std::error_code error;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
    throw BadInput("{}: is empty", path);
  if (!IsPacked(path)) return OpenPlain({path, path}, std::move(wanted));
  const UniqueFd copy = KeptCopyOf(path);
  return OpenPlain({PathOf(copy), path}, std::move(wanted));
}

// The files of a folder one after another.
class FolderReader : public RecordingReader {
 public:
  FolderReader(std::vector<std::string> files, BytesWanted wanted)
      : files_(std::move(files)), wanted_(std::move(wanted)), file_(OpenFile(files_[0], wanted_)) {}

  std::optional<RecordedMessage> Next() override {
    while (true) {
      if (auto message = file_->Next()) return message;
      if (!file_->problem().empty()) problem_ += (problem_.empty() ? "" : "; ") + file_->problem();
      if (next_ == files_.size()) return std::nullopt;
      file_ = OpenFile(files_[next_++], wanted_);
    }
  }

  std::string Place() const override { return file_->Place(); }

 private:
  std::vector<std::string> files_;
  BytesWanted wanted_;
  std::unique_ptr<RecordingReader> file_;
  size_t next_ = 1;
};

bool HasMetadata(const std::string& folder) {
  std::error_code error;
  const std::string path = (fs::path(folder) / kMetadata).string();
  return fs::is_regular_file(path, error) &&
         ReadTextFile(path).find(kMetadataKey) != std::string::npos;
}

// The recording that is meant: of its metadata, their folder.
std::string Meant(const std::string& path) {
  const fs::path file(path);
  const std::string folder = file.has_parent_path() ? file.parent_path().string() : ".";
  return file.filename() == kMetadata && HasMetadata(folder) ? folder : path;
}

}  // namespace

std::string PlainType(std::string type) {
  if (const size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  return type;
}

bool IsRecording(const std::string& given) {
  const std::string path = Meant(given);
  std::error_code error;
  if (!fs::is_directory(path, error)) return IsFile(path);
  return HasMetadata(path) || !FilesIn(path).empty();
}

std::string StateOfRecording(const std::string& given) {
  const std::string path = Meant(given);
  std::error_code error;
  std::string state = fs::absolute(path, error).string();
  const auto add = [&](const fs::path& file) {
    state += fmt::format("|{}|{}|{}", file.string(), fs::file_size(file, error),
                         fs::last_write_time(file, error).time_since_epoch().count());
  };
  add(path);
  if (fs::is_directory(path, error))
    for (const auto& entry : fs::directory_iterator(path, error)) add(entry.path());
  return state;
}

std::unique_ptr<RecordingReader> OpenRecording(const std::string& given, BytesWanted wanted) {
  const std::string path = Meant(given);
  std::error_code error;
  if (!fs::is_directory(path, error)) return OpenFile(path, std::move(wanted));
  std::vector<std::string> files = HasMetadata(path) ? FilesOfMetadata(path) : FilesIn(path);
  if (files.empty()) throw BadInput("{}: no recording is in it", path);
  return std::make_unique<FolderReader>(std::move(files), std::move(wanted));
}

}  // namespace oaslam
