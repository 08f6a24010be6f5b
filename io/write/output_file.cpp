#include "io/write/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kPartial = "partial";
/// Of a name that a fresh name keeps, so that it is no longer than 255 bytes.
constexpr std::size_t kNameKept = 180;

[[noreturn]] void refuse(const char* code, const fs::path& place, const std::string& what,
                         const std::string& remedy) {
    throw Error(ErrorKind::input, code, what, place.string(), remedy);
}

std::string reason(int error) { return std::error_code(error, std::generic_category()).message(); }

/// ".name.purpose-", with no more of a long name than fits.
std::string fresh_head(std::string_view name, std::string_view purpose) {
    return fmt::format(".{}.{}-", name.substr(0, kNameKept), purpose);
}

}  // namespace

std::string fresh_name(std::string_view name, std::string_view purpose) {
    static std::atomic<unsigned> counter{0};
    return fmt::format("{}{}-{}", fresh_head(name, purpose), ::getpid(), counter++);
}

std::optional<long> maker_of(std::string_view fresh, std::string_view name, std::string_view purpose) {
    const std::string head = fresh_head(name, purpose);
    if (fresh.substr(0, head.size()) != head) return std::nullopt;
    const char* at = fresh.data() + head.size();
    const char* const end = fresh.data() + fresh.size();
    std::uint32_t process = 0, number = 0;
    const auto first = std::from_chars(at, end, process);
    if (first.ec != std::errc{} || first.ptr == end || *first.ptr != '-') return std::nullopt;
    const auto second = std::from_chars(first.ptr + 1, end, number);
    if (second.ec != std::errc{} || second.ptr != end || process == 0) return std::nullopt;
    return static_cast<long>(process);
}

OutputFile::OutputFile(const fs::path& folder, std::string name)
    : path_(folder / name), name_(std::move(name)) {
    folder_ = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (folder_ < 0) abandon(errno);
    struct stat there {};
    if (::fstatat(folder_, name_.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISREG(there.st_mode) &&
        !S_ISLNK(there.st_mode)) {
        forget();
        refuse("out.unusable", path_, S_ISDIR(there.st_mode) ? "is a folder" : "is no regular file",
               "give another name, or take that away");
    }
    std::string fresh;
    do {  // a number may be taken by a process that is gone
        fresh = fresh_name(name_, kPartial);
        file_ = ::openat(folder_, fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    } while (file_ < 0 && errno == EEXIST);
    if (file_ < 0) abandon(errno);
    fresh_ = std::move(fresh);
}

OutputFile::~OutputFile() { forget(); }

void OutputFile::write(std::string_view text) {
    while (!text.empty()) {
        const ssize_t done = ::write(file_, text.data(), text.size());
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) abandon(errno);
        text.remove_prefix(static_cast<std::size_t>(done));
    }
}

void OutputFile::close() {
    if (file_ < 0) return;
    if (::close(std::exchange(file_, -1)) != 0) abandon(errno);
    if (::renameat(folder_, fresh_.c_str(), folder_, name_.c_str()) != 0) abandon(errno);
    fresh_.clear();
    forget();
}

void OutputFile::abandon(int error) {
    forget();
    refuse("out.unwritable", path_, reason(error), "make room and rights for it, or give another place");
}

void OutputFile::forget() noexcept {
    if (file_ >= 0) ::close(std::exchange(file_, -1));
    if (folder_ < 0) return;
    if (!fresh_.empty()) ::unlinkat(folder_, fresh_.c_str(), 0);
    ::close(std::exchange(folder_, -1));
}

void write_file_in(const fs::path& folder, const std::string& name, std::string_view text) {
    OutputFile file(folder, name);
    file.write(text);
    file.close();
}

void write_file_whole(const std::string& path, std::string_view text) {
    if (path.empty()) refuse("out.missing", "", "no file to write to", "give one after -o");
    std::error_code error;
    const fs::path target = fs::weakly_canonical(fs::absolute(path, error), error);
    if (error) refuse("out.unusable", path, error.message(), "give another file after -o");
    if (!target.has_filename()) refuse("out.unusable", path, "is a folder", "give a file after -o");
    write_file_in(target.parent_path(), target.filename().string(), text);
}

void make_output_directory(const std::string& directory) {
    std::error_code failed;
    fs::create_directories(directory, failed);
    if (!failed && !fs::is_directory(directory, failed) && !failed)
        failed = std::make_error_code(std::errc::not_a_directory);
    if (failed)
        refuse("out.unwritable", directory, "cannot be made: " + failed.message(), "choose another folder");
}

}  // namespace slabwright
