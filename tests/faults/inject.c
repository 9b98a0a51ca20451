/* Preloaded into duet by tests/faults: makes one call of the C library fail, or kills the program there.
 *
 * Calls count if they concern files below FAULT_ROOT, and are of a kind that FAULT_CALLS lists ("write,rename").
 * Environment:
 *   FAULT_ROOT    absolute path of a folder; without it nothing is changed
 *   FAULT_CALLS   kinds: open read write close sync rename link remove folder truncate stat list thread
 *   FAULT_NUMBER  number of the call that fails, from 1 on; 0: none
 *   FAULT_ERROR   errno value of the failure
 *   FAULT_MODE    "once": call FAULT_NUMBER fails; "stay": it and all later ones fail; "kill": SIGKILL instead of the
 *                 call; "half": a write writes half of its bytes, and SIGKILL follows
 *   FAULT_LOG     file to which a line "NUMBER KIND PATH" is appended for every call that counts
 * Programs that duet starts are not touched: the constructor removes LD_PRELOAD from the environment.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static char root[4096], kinds[256], mode[16];
static int number, failure, log_file = -1;
static atomic_int count;

__attribute__((constructor)) static void begin(void) {
  const char* text = getenv("FAULT_ROOT");
  if (text) snprintf(root, sizeof root, "%s", text);
  if ((text = getenv("FAULT_CALLS"))) snprintf(kinds, sizeof kinds, ",%s,", text);
  if ((text = getenv("FAULT_MODE"))) snprintf(mode, sizeof mode, "%s", text);
  if ((text = getenv("FAULT_NUMBER"))) number = atoi(text);
  if ((text = getenv("FAULT_ERROR"))) failure = atoi(text);
  if ((text = getenv("FAULT_LOG")))
    log_file = (int)syscall(SYS_openat, AT_FDCWD, text, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
  unsetenv("LD_PRELOAD");
}

/* Returns whether the call on the file is to fail. Does not return if the program is to be killed, unless
 * `half` is not null: then it is set, and the caller writes half of the bytes before it kills the program. */
static int fails(const char* kind, const char* path, int* half) {
  char wanted[32];
  snprintf(wanted, sizeof wanted, ",%s,", kind);
  if (root[0] == 0 || !path || strncmp(path, root, strlen(root)) != 0 || !strstr(kinds, wanted)) return 0;
  const int now = ++count;
  if (log_file >= 0) {
    char line[4400];
    const int size = snprintf(line, sizeof line, "%d %s %s\n", now, kind, path);
    syscall(SYS_write, log_file, line, size);
  }
  if (number == 0 || now < number || (now > number && strcmp(mode, "stay") != 0)) return 0;
  if (strcmp(mode, "half") == 0 && half) {
    *half = 1;
    return 0;
  }
  if (strcmp(mode, "kill") == 0 || strcmp(mode, "half") == 0) syscall(SYS_kill, getpid(), SIGKILL);
  errno = failure;
  return 1;
}

static int fails_on(const char* kind, int file, int* half) {
  char name[64], path[4096];
  snprintf(name, sizeof name, "/proc/self/fd/%d", file);
  const long size = syscall(SYS_readlinkat, AT_FDCWD, name, path, sizeof path - 1);
  if (size <= 0) return 0;
  path[size] = 0;
  return fails(kind, path, half);
}

#define REAL(type, name, ...)                         \
  static type (*real)(__VA_ARGS__);                   \
  if (!real) real = (type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name)

/* A function whose failure is `bad`, and whose file is given by its path or its descriptor. */
#define BY_PATH(type, name, kind, bad, path, parameters, ...) \
  type name parameters {                                      \
    static type(*real) parameters;                            \
    if (!real) real = (type(*) parameters)dlsym(RTLD_NEXT, #name); \
    if (fails(kind, path, NULL)) return bad;                  \
    return real(__VA_ARGS__);                                 \
  }
#define BY_FILE(type, name, kind, bad, file, parameters, ...) \
  type name parameters {                                      \
    static type(*real) parameters;                            \
    if (!real) real = (type(*) parameters)dlsym(RTLD_NEXT, #name); \
    if (fails_on(kind, file, NULL)) return bad;               \
    return real(__VA_ARGS__);                                 \
  }
#define OPEN(name)                                            \
  int name(const char* path, int flags, ...) {                \
    REAL(int, name, const char*, int, ...);                   \
    va_list rest;                                             \
    va_start(rest, flags);                                    \
    const unsigned access = va_arg(rest, unsigned);           \
    va_end(rest);                                             \
    if (fails("open", path, NULL)) return -1;                 \
    return real(path, flags, access);                         \
  }
OPEN(open)
OPEN(open64)
BY_PATH(FILE*, fopen, "open", NULL, path, (const char* path, const char* how), path, how)
BY_PATH(FILE*, fopen64, "open", NULL, path, (const char* path, const char* how), path, how)
BY_FILE(ssize_t, read, "read", -1, file, (int file, void* bytes, size_t size), file, bytes, size)
BY_FILE(ssize_t, readv, "read", -1, file, (int file, const struct iovec* parts, int n), file, parts, n)
BY_FILE(ssize_t, writev, "write", -1, file, (int file, const struct iovec* parts, int n), file, parts, n)
BY_FILE(int, fsync, "sync", -1, file, (int file), file)
BY_FILE(int, fdatasync, "sync", -1, file, (int file), file)
BY_FILE(int, ftruncate, "truncate", -1, file, (int file, off_t size), file, size)
BY_FILE(int, ftruncate64, "truncate", -1, file, (int file, off64_t size), file, size)
BY_PATH(int, truncate, "truncate", -1, path, (const char* path, off_t size), path, size)
BY_PATH(int, truncate64, "truncate", -1, path, (const char* path, off64_t size), path, size)
BY_PATH(int, rename, "rename", -1, from, (const char* from, const char* to), from, to)
BY_PATH(int, link, "link", -1, from, (const char* from, const char* to), from, to)
BY_PATH(int, unlink, "remove", -1, path, (const char* path), path)
BY_PATH(int, remove, "remove", -1, path, (const char* path), path)
BY_PATH(int, rmdir, "remove", -1, path, (const char* path), path)
BY_PATH(int, mkdir, "folder", -1, path, (const char* path, mode_t access), path, access)
BY_PATH(int, stat, "stat", -1, path, (const char* path, struct stat* found), path, found)
BY_PATH(int, stat64, "stat", -1, path, (const char* path, struct stat64* found), path, found)
BY_PATH(int, lstat, "stat", -1, path, (const char* path, struct stat* found), path, found)
BY_PATH(int, lstat64, "stat", -1, path, (const char* path, struct stat64* found), path, found)
BY_FILE(int, fstat, "stat", -1, file, (int file, struct stat* found), file, found)
BY_FILE(int, fstat64, "stat", -1, file, (int file, struct stat64* found), file, found)
BY_PATH(DIR*, opendir, "list", NULL, path, (const char* path), path)
BY_FILE(struct dirent*, readdir, "list", NULL, dirfd(folder), (DIR* folder), folder)
BY_FILE(struct dirent64*, readdir64, "list", NULL, dirfd(folder), (DIR* folder), folder)

ssize_t write(int file, const void* bytes, size_t size) {
  REAL(ssize_t, write, int, const void*, size_t);
  int half = 0;
  if (fails_on("write", file, &half)) return -1;
  if (!half) return real(file, bytes, size);
  real(file, bytes, size / 2);
  syscall(SYS_kill, getpid(), SIGKILL);
  return -1;
}

/* The descriptor is closed in any case, as Linux does it when close() reports an error. */
int close(int file) {
  REAL(int, close, int);
  const int failing = fails_on("close", file, NULL), reason = errno, done = real(file);
  if (!failing) return done;
  errno = reason;
  return -1;
}

/* A start of a thread returns its error, and concerns no file. */
int pthread_create(pthread_t* thread, const pthread_attr_t* how, void* (*work)(void*), void* state) {
  REAL(int, pthread_create, pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  return fails("thread", root, NULL) ? errno : real(thread, how, work, state);
}
