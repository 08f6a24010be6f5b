#include "io/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr const char* kRemedy = "give another folder after -o, or make room and rights for this one";

[[noreturn]] void refuse(const char* code, const fs::path& place, const std::string& what,
                         const std::string& remedy = kRemedy) {
    throw Error(ErrorKind::input, code, what, place.string(), remedy);
}

/// Names that OUT may hold (design.md), so that replacing it loses nothing of anybody else's.
bool is_ours(const fs::path& name) {
    static constexpr std::array ours{"plan.json",   "tool.tbl",    "sequence.json",
                                     "report.html", "verify.json", "nc"};
    for (const char* known : ours)
        if (name == known) return true;
    return false;
}

bool is_our_plan(const fs::path& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) return false;
    char head[128];
    const ssize_t got = ::read(file, head, sizeof head);
    ::close(file);
    return got > 0 && std::string_view(head, static_cast<std::size_t>(got)).find("\"slabwright.plan/") !=
                          std::string_view::npos;
}

/// The path with symlinks resolved as far as it exists and no slash at its end: what rename() must be given.
fs::path resolved(const std::string& path) {
    std::error_code error;
    fs::path full = fs::weakly_canonical(fs::absolute(path, error), error);
    if (error) refuse("out.unusable", path, error.message());
    if (!full.has_filename()) full = full.parent_path();
    return full;
}

/// A name beside `target` that nobody else uses: several plans may be written at once, also by one process.
fs::path beside(const fs::path& target, const char* purpose) {
    static std::atomic<unsigned> counter{0};
    return target.parent_path() /
           fmt::format(".{}.{}-{}-{}", target.filename().string(), purpose, ::getpid(), counter++);
}

}  // namespace

void require_replaceable(const std::string& directory) {
    if (directory.empty()) refuse("out.missing", "", "no folder to write to", "give one after -o");
    const fs::path target = resolved(directory);
    std::error_code error;
    const fs::file_status status = fs::status(target, error);
    if (status.type() == fs::file_type::not_found) {
        // The nearest folder above that exists must take a new entry; better to know now than after planning.
        fs::path parent = target.parent_path();
        while (!fs::exists(parent, error) && parent.has_relative_path()) parent = parent.parent_path();
        if (!fs::is_directory(parent, error)) refuse("out.unusable", parent, "not a folder");
        if (::access(parent.c_str(), W_OK | X_OK) != 0)
            refuse("out.unwritable", parent, std::strerror(errno));
        return;
    }
    if (error) refuse("out.unusable", target, error.message());
    if (status.type() != fs::file_type::directory)
        refuse("out.unusable", target, "exists and is not a folder");
    if (::access(target.parent_path().c_str(), W_OK | X_OK) != 0)
        refuse("out.unwritable", target.parent_path(), std::strerror(errno));
    fs::path foreign;
    bool empty = true;
    fs::directory_iterator entries(target, error);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
        empty = false;
        const fs::path name = entries->path().filename();
        // The first by name, so that the message does not depend on the order in which the disk lists them.
        if (!is_ours(name) && (foreign.empty() || name < foreign)) foreign = name;
    }
    if (error) refuse("out.unusable", target, error.message());
    if (empty) return;
    if (!is_our_plan(target / "plan.json"))
        refuse("out.not_ours", target, "the folder is not empty and holds no plan of ours",
               "give another folder after -o");
    if (foreign.empty()) {
        for (entries = fs::directory_iterator(target / "nc", error);
             !error && entries != fs::directory_iterator(); entries.increment(error))
            if (entries->path().extension() != ".ngc" &&
                (foreign.empty() || entries->path().filename() < foreign.filename()))
                foreign = fs::path("nc") / entries->path().filename();
    }
    if (!foreign.empty())
        refuse("out.not_ours", target,
               fmt::format("the folder holds a plan and also {}, which replacing it would lose",
                           foreign.string()),
               "move that away, or give another folder after -o");
}

OutputFolder::OutputFolder(const std::string& directory) {
    require_replaceable(directory);
    target_ = resolved(directory);
    std::error_code error;
    // Parents that are made for this folder are remembered by the topmost, to be taken away if nothing comes
    // of it.
    fs::path missing = target_.parent_path();
    while (!missing.empty() && !fs::exists(missing, error)) {
        made_parent_ = missing;
        missing = missing.parent_path();
    }
    fresh_ = beside(target_, "partial");
    if (!made_parent_.empty()) fs::create_directories(target_.parent_path(), error);
    if (!error) fs::create_directory(fresh_, error);
    if (error) {
        std::error_code ignored;
        if (!made_parent_.empty()) fs::remove_all(made_parent_, ignored);
        refuse("out.unwritable", target_.parent_path(), error.message());
    }
}

OutputFolder::~OutputFolder() {
    if (committed_) return;
    std::error_code ignored;
    fs::remove_all(fresh_, ignored);
    // Only folders that are still empty go: somebody else may have begun to use them.
    for (fs::path parent = target_.parent_path(); !made_parent_.empty(); parent = parent.parent_path()) {
        fs::remove(parent, ignored);
        if (ignored || parent == made_parent_) break;
    }
}

void OutputFolder::commit() {
    if (::rename(fresh_.c_str(), target_.c_str()) == 0) {  // the target did not exist, or was empty
        committed_ = true;
        return;
    }
    if (errno != ENOTEMPTY && errno != EEXIST) refuse("out.unwritable", target_, std::strerror(errno));
    require_replaceable(target_.string());  // it may have changed while the plan was made
    std::error_code ignored;
    // Both change places in one step, so that at every moment one whole plan lies in the target.
    if (::renameat2(AT_FDCWD, fresh_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0) {
        committed_ = true;
        fs::remove_all(fresh_, ignored);
        return;
    }
    // File systems without exchange: two renames, the second undone if it fails.
    const fs::path old = beside(target_, "old");
    if (::rename(target_.c_str(), old.c_str()) != 0) refuse("out.unwritable", target_, std::strerror(errno));
    if (::rename(fresh_.c_str(), target_.c_str()) != 0) {
        const std::string reason = std::strerror(errno);
        if (::rename(old.c_str(), target_.c_str()) != 0)
            refuse("out.unwritable", target_, reason, fmt::format("the old plan lies in {}", old.string()));
        refuse("out.unwritable", target_, reason);
    }
    committed_ = true;
    fs::remove_all(old, ignored);
}

OutputFile::OutputFile(fs::path path) : path_(std::move(path)) {
    file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file_ < 0) refuse("out.unwritable", path_, std::strerror(errno));
}

OutputFile::~OutputFile() {
    if (file_ >= 0) ::close(file_);
}

void OutputFile::write(std::string_view text) {
    while (!text.empty()) {
        const ssize_t done = ::write(file_, text.data(), text.size());
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) refuse("out.unwritable", path_, std::strerror(errno));
        text.remove_prefix(static_cast<std::size_t>(done));
    }
}

void OutputFile::close() {
    const int file = std::exchange(file_, -1);
    if (file >= 0 && ::close(file) != 0) refuse("out.unwritable", path_, std::strerror(errno));
}

void write_file_whole(const std::string& path, std::string_view text) {
    if (path.empty()) refuse("out.missing", "", "no file to write to", "give one after -o");
    const fs::path target = resolved(path), fresh = beside(target, "partial");
    std::error_code error;
    if (fs::is_directory(target, error))
        refuse("out.unusable", target, "is a folder", "give a file after -o");
    try {
        OutputFile file(fresh);
        file.write(text);
        file.close();
        if (::rename(fresh.c_str(), target.c_str()) != 0)
            refuse("out.unwritable", target, std::strerror(errno));
    } catch (const Error& e) {
        fs::remove(fresh, error);
        throw Error(e.kind(), e.code(), e.message(), target.string(),
                    e.remedy());  // the user knows the target, not the file beside it
    }
}

}  // namespace slabwright
