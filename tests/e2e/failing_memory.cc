// Loaded before a program (LD_PRELOAD). Counts the calls of operator new on the mapper's thread,
// and writes the number to the file OASLAM_ALLOCATIONS_TOLD when the program ends. After
// OASLAM_ALLOCATIONS calls, all further ones fail.

#include <pthread.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

std::atomic<long> g_count = 0;

bool IsMapper() {
  char name[16] = "";
  return pthread_getname_np(pthread_self(), name, sizeof(name)) == 0 &&
         std::strcmp(name, "oaslam-mapper") == 0;
}

bool IsMemoryLeft() {
  static const char* const text = std::getenv("OASLAM_ALLOCATIONS");
  static const long enough = text ? std::atol(text) : 0;
  return !IsMapper() || g_count.fetch_add(1) < enough || !text;
}

__attribute__((destructor)) void Tell() {
  const char* const path = std::getenv("OASLAM_ALLOCATIONS_TOLD");
  std::FILE* const file = path ? std::fopen(path, "w") : nullptr;
  if (!file) return;
  std::fprintf(file, "%ld\n", g_count.load());
  std::fclose(file);
}

}  // namespace

void* operator new(size_t size) {
  void* memory = IsMemoryLeft() ? std::malloc(size > 0 ? size : 1) : nullptr;
  if (!memory) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
