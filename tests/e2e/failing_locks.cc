// For LD_PRELOAD: a file system without locks, as some network drives are.

#include <dlfcn.h>
#include <fcntl.h>

#include <cerrno>

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

// By other names, since <fcntl.h> has a type and functions of theirs.
int FailingFlock(int file, int operation) __asm__("flock");
int FailingFcntl(int file, int command, void* argument) __asm__("fcntl");
int FailingFcntl64(int file, int command, void* argument) __asm__("fcntl64");

int FailingFlock(int, int) {
  errno = ENOLCK;
  return -1;
}
int FailingFcntl(int file, int command, void* argument) {
  return FcntlWithoutLocks("fcntl", file, command, argument);
}
int FailingFcntl64(int file, int command, void* argument) {
  return FcntlWithoutLocks("fcntl64", file, command, argument);
}
}
