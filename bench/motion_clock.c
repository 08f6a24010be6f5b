// Loaded before a program (LD_PRELOAD), lets its clock run CLOCK_TIMES times as fast: what it reads of the
// time is multiplied, what it sleeps is divided. bench/motion runs LinuxCNC so.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/select.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SYSTEM(name)                    \
    static __typeof__(&name) of_system; \
    if (!of_system) of_system = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static long times(void) {
    static long known;
    if (!known) {
        const char* told = getenv("CLOCK_TIMES");
        known = told && atol(told) > 0 ? atol(told) : 1;
    }
    return known;
}

static struct timespec from_ns(__int128 ns) {
    return (struct timespec){(time_t)(ns / 1000000000), (long)(ns % 1000000000)};
}

static __int128 ns_of(const struct timespec* t) { return (__int128)t->tv_sec * 1000000000 + t->tv_nsec; }

int clock_gettime(clockid_t clock, struct timespec* t) {
    SYSTEM(clock_gettime);
    const int result = of_system(clock, t);
    const int runs = clock == CLOCK_MONOTONIC || clock == CLOCK_REALTIME || clock == CLOCK_MONOTONIC_RAW ||
                     clock == CLOCK_BOOTTIME;
    if (!result && runs) *t = from_ns(ns_of(t) * times());
    return result;
}

int gettimeofday(struct timeval* restrict tv, void* restrict zone) {
    struct timespec t;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &t);
    tv->tv_sec = t.tv_sec;
    tv->tv_usec = t.tv_nsec / 1000;
    return 0;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec* asked, struct timespec* left) {
    SYSTEM(clock_nanosleep);
    const struct timespec t = from_ns(ns_of(asked) / times());
    return of_system(clock, flags, &t, left);
}

int nanosleep(const struct timespec* asked, struct timespec* left) {
    SYSTEM(nanosleep);
    const struct timespec t = from_ns(ns_of(asked) / times());
    return of_system(&t, left);
}

int usleep(useconds_t us) {
    const struct timespec t = from_ns((__int128)us * 1000);
    return nanosleep(&t, NULL);
}

unsigned sleep(unsigned seconds) {
    const struct timespec t = {seconds, 0};
    nanosleep(&t, NULL);
    return 0;
}

int select(int n, fd_set* in, fd_set* out, fd_set* failed, struct timeval* wait) {
    SYSTEM(select);
    if (!wait) return of_system(n, in, out, failed, NULL);
    const long us = (wait->tv_sec * 1000000L + wait->tv_usec) / times();
    struct timeval t = {us / 1000000, us % 1000000};
    return of_system(n, in, out, failed, &t);
}

int poll(struct pollfd* files, nfds_t n, int ms) {
    SYSTEM(poll);
    return of_system(files, n, ms > 0 ? (int)(ms / times()) + 1 : ms);
}
