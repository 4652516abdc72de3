// For LD_PRELOAD: a file system without locks, as some network drives are.

#include <dlfcn.h>
#include <fcntl.h>

#include <cerrno>
#include <cstdarg>

namespace {

using Fcntl = int(int, int, ...);

int FcntlWithoutLocks(const char* name, int file, int command, void* argument) {
  if (command == F_SETLK || command == F_SETLKW || command == F_GETLK) {
    errno = ENOLCK;
    return -1;
  }
  return reinterpret_cast<Fcntl*>(dlsym(RTLD_NEXT, name))(file, command, argument);
}

}  // namespace

extern "C" {

int flock(int, int) {
  errno = ENOLCK;
  return -1;
}

int fcntl(int file, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  return FcntlWithoutLocks("fcntl", file, command, argument);
}

int fcntl64(int file, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  return FcntlWithoutLocks("fcntl64", file, command, argument);
}
}
