#include "oaslam/detection/network.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "oaslam/detection/network_backends.h"
#include "oaslam/util/named.h"

namespace oaslam {
namespace {

constexpr Named<NetworkBackend> kBackends[] = {{NetworkBackend::kAuto, "auto"},
                                               {NetworkBackend::kOnnxRuntime, "onnxruntime"},
                                               {NetworkBackend::kOpenCv, "opencv"}};

struct Library {
  NetworkBackend backend;
  std::unique_ptr<Network> (*load)(const std::string& path);
  std::string (*name)();
};

// Those that are built in, the preferred one first.
constexpr Library kLibraries[] = {
#ifdef OASLAM_HAS_ONNXRUNTIME
    {NetworkBackend::kOnnxRuntime, LoadByOnnxRuntime, OnnxRuntimeName},
#endif
    {NetworkBackend::kOpenCv, LoadByOpenCv, OpenCvName},
};

const Library* Find(NetworkBackend backend) {
  for (const Library& library : kLibraries)
    if (backend == NetworkBackend::kAuto || backend == library.backend) return &library;
  return nullptr;
}

}  // namespace

const char* ToString(NetworkBackend backend) { return NameIn(kBackends, backend); }

std::optional<NetworkBackend> NetworkBackendFromString(const std::string& name) {
  return ValueIn(kBackends, name);
}

std::unique_ptr<Network> LoadNetwork(const std::string& path, NetworkBackend backend) {
  const Library* library = Find(backend);
  if (library == nullptr)
    throw NetworkError(fmt::format("{} is not built in, only {}", ToString(backend),
                                   fmt::join(NetworkBackends(), ", ")));
  return library->load(path);
}

bool IsBuiltIn(NetworkBackend backend) { return Find(backend) != nullptr; }

std::vector<std::string> NetworkBackends() {
  std::vector<std::string> names;
  for (const Library& library : kLibraries) names.push_back(library.name());
  return names;
}

}  // namespace oaslam
