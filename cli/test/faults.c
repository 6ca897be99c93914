// Makes system calls on files below one directory fail, fall short, or come with a signal: preloaded by outputs_test.py.
//   FAULTS_BELOW   that directory, absolute and without links
//   FAULTS_CALLS   kinds of calls that count, separated by commas: read write sync open create name link spawn
//   FAULTS_FIRST   number of the first call that is hit, from 1
//   FAULTS_LAST    number of the last one
//   FAULTS_DO      "errno N", "short", "signal N"
//   FAULTS_LOG     file that gets a line for each call, its kind and what it concerns, for a run without FAULTS_FIRST
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum outcome { GO_ON, FAIL, SHORTEN };

static atomic_long calls;

// The path where it is below that directory, else none.
static const char* if_below(const char* path) {
  const char* below = getenv("FAULTS_BELOW");
  return below != NULL && strncmp(path, below, strlen(below)) == 0 ? path : NULL;
}

static const char* if_open_below(int descriptor) {
  static _Thread_local char path[PATH_MAX + 1];
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t size = readlink(link, path, PATH_MAX);
  path[size > 0 ? size : 0] = '\0';
  return if_below(path);
}

static int counts(const char* kind) {
  const char* kinds = getenv("FAULTS_CALLS");
  const char* found = kinds != NULL ? strstr(kinds, kind) : NULL;
  return found != NULL;
}

static long number(const char* name) {
  const char* text = getenv(name);
  return text != NULL ? atol(text) : 0;
}

static void tell(const char* kind, const char* path) {
  const char* name = getenv("FAULTS_LOG");
  FILE* file = name != NULL ? fopen(name, "a") : NULL;
  if (file != NULL) {
    fprintf(file, "%s %s\n", kind, path);
    fclose(file);
  }
}

// What is to become of a call of this kind. Without a path it does not concern us.
static enum outcome meet(const char* kind, const char* path) {
  const int saved = errno;
  if (path == NULL || !counts(kind)) {
    errno = saved;
    return GO_ON;
  }
  const long call = atomic_fetch_add(&calls, 1) + 1;
  tell(kind, path);
  const char* what = getenv("FAULTS_DO");
  errno = saved;
  if (what == NULL || call < number("FAULTS_FIRST") || call > number("FAULTS_LAST")) {
    return GO_ON;
  }
  if (strncmp(what, "errno ", 6) == 0) {
    errno = atoi(what + 6);
    return FAIL;
  }
  if (strncmp(what, "signal ", 7) == 0) {
    kill(getpid(), atoi(what + 7));
    return GO_ON;
  }
  return SHORTEN;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

#define TRANSFER(name, kind, buffer)                                    \
  ssize_t name(int descriptor, buffer bytes, size_t size) {             \
    const enum outcome is = meet(kind, if_open_below(descriptor));      \
    return is == FAIL ? -1 : NEXT(name)(descriptor, bytes, is == SHORTEN ? (size + 1) / 2 : size); \
  }
#define TRANSFER_AT(name, kind, buffer)                                 \
  ssize_t name(int descriptor, buffer bytes, size_t size, off_t at) {   \
    const enum outcome is = meet(kind, if_open_below(descriptor));      \
    return is == FAIL ? -1 : NEXT(name)(descriptor, bytes, is == SHORTEN ? (size + 1) / 2 : size, at); \
  }
TRANSFER(read, "read", void*)
TRANSFER(write, "write", const void*)
TRANSFER_AT(pread, "read", void*)
TRANSFER_AT(pread64, "read", void*)
TRANSFER_AT(pwrite, "write", const void*)
TRANSFER_AT(pwrite64, "write", const void*)

#define OF_DESCRIPTOR(name, kind)                                       \
  int name(int descriptor) {                                            \
    return meet(kind, if_open_below(descriptor)) == FAIL ? -1 : NEXT(name)(descriptor); \
  }
OF_DESCRIPTOR(fsync, "sync")
OF_DESCRIPTOR(fdatasync, "sync")

#define TRUNCATE(name)                                                  \
  int name(int descriptor, off_t size) {                                \
    return meet("write", if_open_below(descriptor)) == FAIL ? -1 : NEXT(name)(descriptor, size); \
  }
TRUNCATE(ftruncate)
TRUNCATE(ftruncate64)

#define OPEN(name)                                                      \
  int name(const char* path, int flags, ...) {                          \
    va_list rest;                                                       \
    va_start(rest, flags);                                              \
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0; \
    va_end(rest);                                                       \
    return meet((flags & O_CREAT) != 0 ? "create" : "open", if_below(path)) == FAIL ? -1 : NEXT(name)(path, flags, mode); \
  }
OPEN(open)
OPEN(open64)

#define OF_NAME(name, kind)                                             \
  int name(const char* path) { return meet(kind, if_below(path)) == FAIL ? -1 : NEXT(name)(path); }
OF_NAME(unlink, "name")
OF_NAME(rmdir, "name")
OF_NAME(remove, "name")

#define OF_TWO_NAMES(name, kind)                                        \
  int name(const char* from, const char* to) { return meet(kind, if_below(to)) == FAIL ? -1 : NEXT(name)(from, to); }
OF_TWO_NAMES(rename, "name")
OF_TWO_NAMES(link, "create")

int mkdir(const char* path, mode_t mode) { return meet("create", if_below(path)) == FAIL ? -1 : NEXT(mkdir)(path, mode); }
int unlinkat(int directory, const char* path, int flags) {
  return meet("name", if_open_below(directory) ?: if_below(path)) == FAIL ? -1 : NEXT(unlinkat)(directory, path, flags);
}
int fchmodat(int directory, const char* path, mode_t mode, int flags) {
  return meet("name", if_below(path)) == FAIL ? -1 : NEXT(fchmodat)(directory, path, mode, flags);
}
ssize_t readlink(const char* path, char* target, size_t size) {
  return meet("link", if_below(path)) == FAIL ? -1 : NEXT(readlink)(path, target, size);
}
int posix_spawn(pid_t* process, const char* path, const posix_spawn_file_actions_t* actions, const posix_spawnattr_t* attributes,
                char* const arguments[], char* const environment[]) {
  return meet("spawn", if_below(path)) == FAIL ? errno : NEXT(posix_spawn)(process, path, actions, attributes, arguments, environment);
}
