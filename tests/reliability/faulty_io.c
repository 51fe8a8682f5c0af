/* Loaded before the C library (LD_PRELOAD): fails one call of its own choosing that changes or opens a file.

   arm(n): the n-th such call from now on, on files whose path has the wanted part, fails with the error given;
   fired(): whether it did, and of which kind it was. Counting ends with the first failure, so what follows works again. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static long left = 0;
static int error_given = EIO;
static const char *kind = "";
static char wanted[4096];

void arm(long n, int error, const char *part) {
    strncpy(wanted, part, sizeof wanted - 1);
    kind = "";
    error_given = error;
    left = n;
}
void disarm(void) { left = 0; }
const char *fired(void) { return kind; }

static int fails(const char *path, const char *what) {
    if (left <= 0 || !strstr(path, wanted) || --left) return 0;
    kind = what;
    errno = error_given;
    return 1;
}
static int fails_fd(int fd, const char *what) {
    char link[64], path[4096];
    if (left <= 0) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return fails(path, what);
}
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t pwrite(int fd, const void *data, size_t size, off_t at) {
    return fails_fd(fd, "pwrite") ? -1 : REAL(pwrite)(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t at) {
    return fails_fd(fd, "pwrite") ? -1 : REAL(pwrite64)(fd, data, size, at);
}
ssize_t write(int fd, const void *data, size_t size) { return fails_fd(fd, "write") ? -1 : REAL(write)(fd, data, size); }
int fsync(int fd) { return fails_fd(fd, "fsync") ? -1 : REAL(fsync)(fd); }
int fdatasync(int fd) { return fails_fd(fd, "fsync") ? -1 : REAL(fdatasync)(fd); }
int ftruncate(int fd, off_t size) { return fails_fd(fd, "ftruncate") ? -1 : REAL(ftruncate)(fd, size); }
int ftruncate64(int fd, off64_t size) { return fails_fd(fd, "ftruncate") ? -1 : REAL(ftruncate64)(fd, size); }
int unlink(const char *path) { return fails(path, "unlink") ? -1 : REAL(unlink)(path); }
ssize_t pread(int fd, void *data, size_t size, off_t at) {
    return fails_fd(fd, "pread") ? -1 : REAL(pread)(fd, data, size, at);
}
ssize_t pread64(int fd, void *data, size_t size, off64_t at) {
    return fails_fd(fd, "pread") ? -1 : REAL(pread64)(fd, data, size, at);
}
int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = va_arg(rest, mode_t);
    va_end(rest);
    return fails(path, "open") ? -1 : REAL(open)(path, flags, mode);
}
int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = va_arg(rest, mode_t);
    va_end(rest);
    return fails(path, "open") ? -1 : REAL(open64)(path, flags, mode);
}
