#include "io/read/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace slabwright {

namespace {

std::string reason(int error) { return std::error_code(error, std::generic_category()).message(); }

}  // namespace

InputFile::InputFile(std::filesystem::path path, ReadRule rule)
    : path_(std::move(path)), rule_(std::move(rule)) {
    // A pipe without a writer would keep open() waiting, a terminal would become ours.
    file_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file_ < 0) {
        const int error = errno;
        if (error == ENOENT || error == ENOTDIR) refuse("missing", "there is no such file", "check the path");
        refuse("unreadable", "the file cannot be opened: " + reason(error), "check its permissions");
    }
    const bool known = ::fstat(file_, &opened_) == 0;
    if (known && S_ISREG(opened_.st_mode) && size() <= rule_.most_bytes) return;
    ::close(std::exchange(file_, -1));
    if (known && S_ISDIR(opened_.st_mode)) refuse("directory", "this is a directory", "name a file in it");
    if (!known || !S_ISREG(opened_.st_mode))
        refuse("unreadable", "this is no regular file", "copy it to a file first");
    refuse("too_large",
           fmt::format("the file has {} bytes, over the limit of {} for its kind", size(), rule_.most_bytes),
           "check that it is the file that was meant");
}

InputFile::~InputFile() {
    if (file_ >= 0) ::close(file_);
}

void InputFile::read(std::uint64_t offset, char* into, std::uint64_t bytes) const {
    while (bytes > 0) {
        constexpr std::uint64_t most = std::uint64_t{1} << 30;  // one call reads less than 2 GiB
        const ssize_t got = ::pread(file_, into, std::min(bytes, most), static_cast<off_t>(offset));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) refuse("unreadable", "cannot be read: " + reason(errno), "copy it to a local disk");
        if (got == 0)
            refuse("changed", fmt::format("the file became shorter while it was read, at offset {}", offset),
                   "wait until it is written, and try again");
        into += got;
        offset += static_cast<std::uint64_t>(got);
        bytes -= static_cast<std::uint64_t>(got);
    }
}

void InputFile::require_unchanged() const {
    struct stat now {};
    const bool same = ::fstat(file_, &now) == 0 && now.st_size == opened_.st_size &&
                      now.st_mtim.tv_sec == opened_.st_mtim.tv_sec &&
                      now.st_mtim.tv_nsec == opened_.st_mtim.tv_nsec;
    if (!same)
        refuse("changed", "the file was written while it was read",
               "wait until it is written, and try again");
}

void InputFile::refuse(const char* word, const std::string& message, const char* remedy) const {
    const bool open_ended = !rule_.code.empty() && rule_.code.back() == '.';
    throw Error(rule_.kind, open_ended ? rule_.code + word : rule_.code, message, path_.string(),
                rule_.remedy.empty() ? remedy : rule_.remedy);
}

std::string read_whole(const std::filesystem::path& path, const ReadRule& rule) {
    const InputFile file(path, rule);
    std::string text(file.size(), '\0');
    file.read(0, text.data(), text.size());
    file.require_unchanged();
    return text;
}

std::string read_document(const std::filesystem::path& path, ErrorKind kind, const std::string& code,
                          const std::string& remedy) {
    std::string text = read_whole(path, {kind, code, kMostDocumentBytes, remedy});
    constexpr int deepest = 64;  // plan.json has 9 levels
    int depth = 0;
    bool in_text = false;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char c = text[at];
        if (in_text && c == '\\') ++at;
        else if (c == '"') in_text = !in_text;
        else if (!in_text && (c == ']' || c == '}')) --depth;
        else if (!in_text && (c == '[' || c == '{') && ++depth > deepest)
            throw Error(kind, code, fmt::format("is nested deeper than {} levels, at offset {}", deepest, at),
                        path.string(), remedy);
    }
    return text;
}

}  // namespace slabwright
