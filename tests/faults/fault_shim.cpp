// Makes the system fail as tests ask: loaded into the command by LD_PRELOAD. SLABWRIGHT_FAULT says how:
//
// - "write 17": the 17th write fails as on a full disk. "write 17+": so does every one after it. Likewise
//   open (to write), rename, mkdir, sync, close (of what was written), read, map (of memory) and new.
// - "kill 17": the process is killed at the 17th call that changes the disk.
// - "short": no read or write takes more than 700 bytes.
// - "interrupted": every second read and write is interrupted by a signal before it does anything.
// - "clock": clocks jump a day ahead or back at every look.
//
// SLABWRIGHT_FAULT_COUNT names a file that is told at the end how often each was called, and
// SLABWRIGHT_FAULT_SITES one that is told of each way through the code to such a call which call was its
// first.
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>

namespace {

enum Call { kWrite, kOpen, kRename, kMkdir, kSync, kClose, kRead, kMap, kNew, kChange, kCalls };
constexpr const char* kNames[kCalls] = {"write", "open", "rename", "mkdir", "sync",
                                        "close", "read", "map",    "new",   "kill"};

struct Wish {
    int call = -1;
    long at = 0;
    bool onwards = false;  // all calls from there on
    bool short_ones = false, interrupted = false, clock = false;

    Wish() {
        const char* text = std::getenv("SLABWRIGHT_FAULT");
        if (text == nullptr) return;
        short_ones = std::strcmp(text, "short") == 0;
        interrupted = std::strcmp(text, "interrupted") == 0;
        clock = std::strcmp(text, "clock") == 0;
        for (int c = 0; c < kCalls; ++c) {
            const std::size_t length = std::strlen(kNames[c]);
            if (std::strncmp(text, kNames[c], length) != 0 || text[length] != ' ') continue;
            call = c;
            char* end = nullptr;
            at = std::strtol(text + length, &end, 10);
            onwards = *end == '+';
        }
    }
};

std::atomic<long> counts[kCalls];
std::atomic<bool> in_main;  // what libraries do before it is theirs: nobody could catch its failures
int (*main_of_command)(int, char**, char**);

int counted_main(int argc, char** argv, char** environment) {
    in_main = true;
    const int status = main_of_command(argc, argv, environment);
    in_main = false;
    return status;
}

const Wish& wish() {
    static const Wish wish;
    return wish;
}

/// The ways through the code by which calls were made, each with the number of its first call.
class Sites {
public:
    void add(Call call, long number) {
        void* frames[kDepth];
        const int depth = ::backtrace(frames, kDepth);
        std::uint64_t hash = 1469598103934665603u ^ static_cast<std::uint64_t>(call);
        for (int i = 0; i < depth; ++i)
            hash = (hash ^ reinterpret_cast<std::uintptr_t>(frames[i])) * 1099511628211u;
        const std::lock_guard<std::mutex> lock(mutex_);
        for (std::size_t at = hash % kRoom;; at = (at + 1) % kRoom) {
            if (sites_[at].number == 0 && ++used_ < kRoom) sites_[at] = {hash, number, call};
            if (sites_[at].number == 0 || sites_[at].hash == hash) return;
        }
    }
    void tell(const char* path) const {
        std::FILE* file = std::fopen(path, "w");
        if (file == nullptr) return;
        for (const Site& site : sites_)
            if (site.number != 0) std::fprintf(file, "%s %ld\n", kNames[site.call], site.number);
        std::fclose(file);
    }

private:
    struct Site {
        std::uint64_t hash;
        long number;
        Call call;
    };
    static constexpr int kDepth = 12;
    static constexpr std::size_t kRoom = 1 << 17;

    std::mutex mutex_;
    std::size_t used_ = 0;
    Site sites_[kRoom] = {};
};

const char* const sites_file = std::getenv("SLABWRIGHT_FAULT_SITES");
Sites sites;

/// Whether this call is one that fails.
bool fails(Call call) {
    if (!in_main) return false;
    const long number = ++counts[call];
    if (sites_file != nullptr && *sites_file != '\0') sites.add(call, number);
    return wish().call == call && (number == wish().at || (wish().onwards && number > wish().at));
}

void changes_disk() {
    if (fails(kChange)) ::kill(::getpid(), SIGKILL);
}

template <class Function>
Function real(const char* name) {
    return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

bool refused(Call call, int error) {
    if (!fails(call)) return false;
    errno = error;
    return true;
}

bool interrupted() {
    static std::atomic<unsigned> turn;
    if (!wish().interrupted || (turn++ & 1u) != 0) return false;
    errno = EINTR;
    return true;
}

std::size_t taken(std::size_t bytes) { return wish().short_ones ? std::min<std::size_t>(bytes, 700) : bytes; }

struct Teller {
    ~Teller() {
        in_main = false;
        if (sites_file != nullptr && *sites_file != '\0') sites.tell(sites_file);
        const char* path = std::getenv("SLABWRIGHT_FAULT_COUNT");
        if (path == nullptr) return;
        long told[kCalls];
        for (int c = 0; c < kCalls; ++c) told[c] = counts[c];
        std::FILE* file = std::fopen(path, "w");
        if (file == nullptr) return;
        for (int c = 0; c < kCalls; ++c) std::fprintf(file, "%s %ld\n", kNames[c], told[c]);
        std::fclose(file);
    }
} teller;

void* allocated(std::size_t bytes, std::size_t alignment) {
    if (fails(kNew)) return nullptr;
    void* at = alignment > alignof(std::max_align_t)
                   ? std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment)
                   : std::malloc(std::max<std::size_t>(bytes, 1));
    return at;
}

void* allocated_or_thrown(std::size_t bytes, std::size_t alignment) {
    void* at = allocated(bytes, alignment);
    if (at == nullptr) throw std::bad_alloc();
    return at;
}

}  // namespace

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(),
                      void (*finish)(), void (*linker_finish)(), void* stack_end) {
    main_of_command = main;
    return real<decltype(&__libc_start_main)>("__libc_start_main")(counted_main, argc, argv, init, finish,
                                                                   linker_finish, stack_end);
}

ssize_t write(int file, const void* bytes, size_t count) {
    static const auto next = real<ssize_t (*)(int, const void*, size_t)>("write");
    if (file <= 2) return next(file, bytes, count);
    changes_disk();
    if (refused(kWrite, ENOSPC) || interrupted()) return -1;
    return next(file, bytes, taken(count));
}

ssize_t pwrite(int file, const void* bytes, size_t count, off_t offset) {
    static const auto next = real<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
    changes_disk();
    if (refused(kWrite, ENOSPC) || interrupted()) return -1;
    return next(file, bytes, taken(count), offset);
}

ssize_t read(int file, void* bytes, size_t count) {
    static const auto next = real<ssize_t (*)(int, void*, size_t)>("read");
    if (refused(kRead, EIO) || interrupted()) return -1;
    return next(file, bytes, taken(count));
}

ssize_t pread(int file, void* bytes, size_t count, off_t offset) {
    static const auto next = real<ssize_t (*)(int, void*, size_t, off_t)>("pread");
    if (refused(kRead, EIO) || interrupted()) return -1;
    return next(file, bytes, taken(count), offset);
}

int open(const char* path, int flags, ...) {
    static const auto next = real<int (*)(const char*, int, ...)>("open");
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    if ((flags & O_ACCMODE) != O_RDONLY) {
        changes_disk();
        if (refused(kOpen, EMFILE)) return -1;
    }
    return next(path, flags, mode);
}

int openat(int folder, const char* path, int flags, ...) {
    static const auto next = real<int (*)(int, const char*, int, ...)>("openat");
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    if ((flags & O_ACCMODE) != O_RDONLY) {
        changes_disk();
        if (refused(kOpen, EMFILE)) return -1;
    }
    return next(folder, path, flags, mode);
}

int rename(const char* from, const char* to) {
    static const auto next = real<int (*)(const char*, const char*)>("rename");
    changes_disk();
    return refused(kRename, EIO) ? -1 : next(from, to);
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) {
    static const auto next = real<int (*)(int, const char*, int, const char*)>("renameat");
    changes_disk();
    return refused(kRename, EIO) ? -1 : next(from_folder, from, to_folder, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
    static const auto next = real<int (*)(int, const char*, int, const char*, unsigned)>("renameat2");
    changes_disk();
    return refused(kRename, EIO) ? -1 : next(from_folder, from, to_folder, to, flags);
}

int mkdir(const char* path, mode_t mode) {
    static const auto next = real<int (*)(const char*, mode_t)>("mkdir");
    changes_disk();
    return refused(kMkdir, ENOSPC) ? -1 : next(path, mode);
}

int mkdirat(int folder, const char* path, mode_t mode) {
    static const auto next = real<int (*)(int, const char*, mode_t)>("mkdirat");
    changes_disk();
    return refused(kMkdir, ENOSPC) ? -1 : next(folder, path, mode);
}

int unlink(const char* path) {
    static const auto next = real<int (*)(const char*)>("unlink");
    changes_disk();
    return next(path);
}

int unlinkat(int folder, const char* path, int flags) {
    static const auto next = real<int (*)(int, const char*, int)>("unlinkat");
    changes_disk();
    return next(folder, path, flags);
}

int close(int file) {
    static const auto next = real<int (*)(int)>("close");
    struct stat there {};
    const int mode = in_main ? ::fcntl(file, F_GETFL) : -1;
    const bool written = mode >= 0 && (mode & (O_ACCMODE | O_PATH)) == O_WRONLY &&
                         ::fstat(file, &there) == 0 && S_ISREG(there.st_mode);
    const bool refuses = written && refused(kClose, EIO);
    const int answer = next(file);  // the system lets go of a file even where that fails
    if (refuses) errno = EIO;
    return refuses ? -1 : answer;
}

// jemalloc maps before anything can be looked up by name. What Embree maps for a tree is let through: where
// that fails its tasks wait for one another without end.
void* mmap(void* at, size_t bytes, int rights, int flags, int file, off_t offset) {
    Dl_info caller{};
    const bool by_embree = in_main && ::dladdr(__builtin_return_address(0), &caller) != 0 &&
                           caller.dli_fname != nullptr &&
                           std::strstr(caller.dli_fname, "libembree") != nullptr;
    if (!by_embree && refused(kMap, ENOMEM)) return MAP_FAILED;
    return reinterpret_cast<void*>(::syscall(SYS_mmap, at, bytes, rights, flags, file, offset));
}

int fsync(int file) {
    static const auto next = real<int (*)(int)>("fsync");
    return refused(kSync, EIO) ? -1 : next(file);
}

int fdatasync(int file) {
    static const auto next = real<int (*)(int)>("fdatasync");
    return refused(kSync, EIO) ? -1 : next(file);
}

int clock_gettime(clockid_t clock, timespec* time) {
    static const auto next = real<int (*)(clockid_t, timespec*)>("clock_gettime");
    const int answer = next(clock, time);
    static std::atomic<unsigned> turn;
    if (wish().clock && clock == CLOCK_REALTIME) time->tv_sec += (turn++ & 1u) != 0 ? 86400 : -86400;
    return answer;
}

}  // extern "C"

void* operator new(std::size_t bytes) { return allocated_or_thrown(bytes, 0); }
void* operator new[](std::size_t bytes) { return allocated_or_thrown(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return allocated_or_thrown(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
    return allocated_or_thrown(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocated(bytes, 0); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return allocated(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
    return allocated(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* at) noexcept { std::free(at); }
void operator delete[](void* at) noexcept { std::free(at); }
void operator delete(void* at, std::size_t) noexcept { std::free(at); }
void operator delete[](void* at, std::size_t) noexcept { std::free(at); }
void operator delete(void* at, std::align_val_t) noexcept { std::free(at); }
void operator delete[](void* at, std::align_val_t) noexcept { std::free(at); }
void operator delete(void* at, std::size_t, std::align_val_t) noexcept { std::free(at); }
void operator delete[](void* at, std::size_t, std::align_val_t) noexcept { std::free(at); }
