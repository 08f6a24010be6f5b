#include "io/write/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/plan.h"
#include "io/posts/dialect.h"
#include "io/read/input_file.h"
#include "io/write/output_file.h"
#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr const char* kRemedy = "give another folder after -o, or make room and rights for this one";
constexpr const char* kMoveAway = "move that away, or give another folder after -o";
constexpr std::string_view kPartial = "partial", kOld = "old";
/// The files of a plan folder beside its programs.
constexpr std::array<std::string_view, 11> kFiles{
    kOwnPostFile,  "plan.json",     "tool.tbl",     "sequence.json", "report.html", "verify.json",
    "sheets.json", "assembly.html", "cut_list.csv", "cut_list.dxf",  "dowels.csv"};
constexpr std::string_view kUndersides = "undersides";  ///< the folder of the plans of slabs' undersides
/// Its folders, and how the names in them end.
struct Inner {
    std::string_view folder, ending;
};
constexpr std::array<Inner, 4> kInner{Inner{"nc", ".ngc"}, Inner{"dxf", ".dxf"}, Inner{"svg", ".svg"},
                                      Inner{"fixture", ".dxf"}};

[[noreturn]] void refuse(const char* code, const fs::path& place, const std::string& what,
                         const std::string& remedy = kRemedy) {
    throw Error(ErrorKind::input, code, what, place.string(), remedy);
}

/// Something in a folder that no plan folder of ours can hold there.
struct Stranger {
    fs::path name;     ///< from the folder
    std::string what;  ///< what it is
};

/// What an entry is, a link not followed; nothing where it is the kind that is wanted.
std::optional<std::string> not_a(const fs::directory_entry& entry, fs::file_type wanted) {
    std::error_code error;
    const fs::file_type type = entry.symlink_status(error).type();
    if (!error && type == wanted) return std::nullopt;
    if (type == fs::file_type::symlink) return "a link";
    if (type == fs::file_type::directory) return "a folder";
    if (type == fs::file_type::regular) return "a file";
    return "neither file nor folder";
}

/// Entries by name, so that a message does not depend on the order in which the disk lists them.
std::vector<fs::directory_entry> entries_of(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::directory_entry> entries;
    for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
         at.increment(error))
        entries.push_back(*at);
    if (error) refuse("out.unusable", folder, error.message());
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
        return a.path().filename().native() < b.path().filename().native();
    });
    return entries;
}

bool lives(long process) { return ::kill(static_cast<pid_t>(process), 0) == 0 || errno != ESRCH; }

/// Whether a name is that of a file of ours, or of one that a process was writing in its place.
bool is_file_of_ours(const std::string& name) {
    // What a killed `resume` was writing. Where it lives, a build is under way.
    if (const auto maker = maker_of(name, "progress.json", kPartial)) return !lives(*maker);
    if (name == "verify.json.part") return true;  // earlier versions left it on a full disk
    return std::any_of(kFiles.begin(), kFiles.end(), [&](std::string_view known) {
        return name == known || maker_of(name, known, kPartial).has_value();
    });
}

/// Whether a name in an inner folder of a folder under way is that of a file of ours.
bool is_program_name(const std::string& name) {
    const auto has = [&](std::string_view known) {
        const std::size_t ending = name.rfind(known);
        return ending != std::string::npos &&
               (name.size() == ending + known.size() ||
                maker_of(name, name.substr(1, ending + known.size() - 1), kPartial));
    };
    return std::any_of(kInner.begin(), kInner.end(), [&](const Inner& inner) { return has(inner.ending); }) ||
           std::any_of(kProgramEndings.begin(), kProgramEndings.end(), has);
}

/// The first entry of a folder that a plan folder cannot hold. @param is_program of names in inner folders
template <class IsProgram>
std::optional<Stranger> stranger_in(const fs::path& folder, IsProgram&& is_program);

/// The same of the folder that holds the plans of undersides: "L003", each a folder of ours.
template <class IsProgram>
std::optional<Stranger> stranger_in_undersides(const fs::path& folder, IsProgram&& is_program) {
    for (const fs::directory_entry& entry : entries_of(folder)) {
        const std::string name = entry.path().filename().string();
        const bool is_named = name.size() > 1 && name.front() == 'L' &&
                              name.find_first_not_of("0123456789", 1) == std::string::npos;
        if (!is_named) return Stranger{fs::path(kUndersides) / name, ""};
        if (const auto what = not_a(entry, fs::file_type::directory))
            return Stranger{fs::path(kUndersides) / name, *what};
        if (auto stranger = stranger_in(entry.path(), is_program)) {
            stranger->name = fs::path(kUndersides) / name / stranger->name;
            return stranger;
        }
    }
    return std::nullopt;
}

template <class IsProgram>
std::optional<Stranger> stranger_in(const fs::path& folder, IsProgram&& is_program) {
    for (const fs::directory_entry& entry : entries_of(folder)) {
        const std::string name = entry.path().filename().string();
        if (name == kUndersides) {
            if (const auto what = not_a(entry, fs::file_type::directory)) return Stranger{name, *what};
            if (auto stranger = stranger_in_undersides(entry.path(), is_program)) return stranger;
            continue;
        }
        const bool programs = std::any_of(kInner.begin(), kInner.end(),
                                          [&](const Inner& inner) { return name == inner.folder; });
        if (!programs && !is_file_of_ours(name)) return Stranger{name, ""};
        if (const auto what = not_a(entry, programs ? fs::file_type::directory : fs::file_type::regular))
            return Stranger{name, *what};
        if (!programs) continue;
        for (const fs::directory_entry& program : entries_of(entry.path())) {
            const fs::path inner = program.path().filename();
            if (!is_program(inner.string())) return Stranger{name / inner, ""};
            if (const auto what = not_a(program, fs::file_type::regular))
                return Stranger{name / inner, *what};
        }
    }
    return std::nullopt;
}

/// The names of the files in inner folders that a sheets.json of ours names; nothing where it is none.
std::optional<std::set<std::string>> files_of_sheets(const fs::path& sheets) {
    using nlohmann::json;
    try {
        const json document = json::parse(read_document(sheets, ErrorKind::input, "out.not_ours", ""));
        if (document.at("schema").get<std::string>().rfind("slabwright.sheets/", 0) != 0) return std::nullopt;
        std::set<std::string> names;
        for (const json& program : document.at("programs"))
            for (const char* key : {"file", "dxf", "svg"})
                names.insert(fs::path(program.at(key).get<std::string>()).filename().string());
        if (document.contains("fixture"))
            for (const json& name : document.at("fixture")) names.insert(name.get<std::string>());
        return names;
    } catch (const json::exception&) {
        return std::nullopt;
    } catch (const Error&) {
        return std::nullopt;
    }
}

/// The names in nc/ of the programs that a plan.json of ours names; nothing where it is none.
std::optional<std::set<std::string>> programs_of(const fs::path& plan) {
    using nlohmann::json;
    try {
        const json document = json::parse(read_document(plan, ErrorKind::input, "out.not_ours", ""));
        if (document.at("schema").get<std::string>().rfind("slabwright.plan/", 0) != 0) return std::nullopt;
        std::set<std::string> names;
        for (const json& layer : document.at("layers"))
            for (const json& operation : layer.at("operations"))
                names.insert(fs::path(file_of(operation.at("file").get<std::string>())).filename().string());
        if (document.contains("probes"))
            for (const json& probe : document.at("probes"))
                names.insert(fs::path(probe.at("file").get<std::string>()).filename().string());
        for (const json& layer : document.at("layers")) {
            if (!layer.contains("underside")) continue;
            const fs::path folder = layer.at("underside").at("folder").get<std::string>();
            if (const auto of_underside = programs_of(plan.parent_path() / folder.parent_path().filename() /
                                                      folder.filename() / plan.filename()))
                names.insert(of_underside->begin(), of_underside->end());
        }
        return names;
    } catch (const json::exception&) {
        return std::nullopt;
    } catch (const Error&) {
        return std::nullopt;
    }
}

/// @throws Error(input) unless a folder is empty, or holds a plan of ours and nothing else
void require_ours(const fs::path& folder, const fs::path& told) {
    const std::vector<fs::directory_entry> entries = entries_of(folder);
    if (entries.empty()) return;
    const fs::path plan = folder / "plan.json";
    std::error_code ignored;
    const bool is_file = fs::symlink_status(plan, ignored).type() == fs::file_type::regular;
    const fs::path sheets = folder / "sheets.json";
    const bool has_sheets = fs::symlink_status(sheets, ignored).type() == fs::file_type::regular;
    const auto programs = is_file ? programs_of(plan) : has_sheets ? files_of_sheets(sheets) : std::nullopt;
    if (!programs)
        refuse("out.not_ours", told, "the folder is not empty and holds no plan of ours",
               "give another folder after -o");
    const auto stranger =
        stranger_in(folder, [&](const std::string& name) { return programs->count(name) > 0; });
    if (!stranger) return;
    const std::string what = stranger->what.empty() ? "" : " as " + stranger->what;
    refuse("out.not_ours", told,
           fmt::format("the folder holds a plan and also {}{}, which replacing it would lose",
                       stranger->name.string(), what),
           kMoveAway);
}

/// The path with symlinks resolved as far as it exists and no slash at its end: what rename() must be given.
fs::path resolved(const std::string& path) {
    std::error_code error;
    fs::path full = fs::weakly_canonical(fs::absolute(path, error), error);
    if (error) refuse("out.unusable", path, error.message());
    if (!full.has_filename()) full = full.parent_path();
    return full;
}

fs::path beside(const fs::path& target, std::string_view purpose) {
    return target.parent_path() / fresh_name(target.filename().string(), purpose);
}

/// Whether something is mounted on a folder: it then cannot be exchanged for another.
bool is_mounted_on(const fs::path& folder) {
    if (folder == folder.root_path()) return true;
    struct statx info {};
    if (::statx(AT_FDCWD, folder.c_str(), AT_SYMLINK_NOFOLLOW | AT_NO_AUTOMOUNT, STATX_BASIC_STATS, &info) !=
        0)
        return false;
    if ((info.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT) != 0)
        return (info.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0;
    struct stat own {
    }, above{};
    return ::stat(folder.c_str(), &own) == 0 && ::stat(folder.parent_path().c_str(), &above) == 0 &&
           own.st_dev != above.st_dev;
}

void require_target(const std::string& directory) {
    if (directory.empty()) refuse("out.missing", "", "no folder to write to", "give one after -o");
    const fs::path target = resolved(directory);
    std::error_code error;
    const fs::file_status status = fs::status(target, error);
    if (status.type() == fs::file_type::not_found) {
        fs::path parent = target.parent_path();
        while (!fs::exists(parent, error) && parent.has_relative_path()) parent = parent.parent_path();
        if (!fs::is_directory(parent, error)) refuse("out.unusable", parent, "not a folder");
        const long longest = ::pathconf(parent.c_str(), _PC_NAME_MAX);
        for (const fs::path& name : target.lexically_relative(parent))
            if (longest > 0 && name.native().size() > static_cast<std::size_t>(longest))
                refuse("out.unusable", target, std::strerror(ENAMETOOLONG));
        return;
    }
    if (error) refuse("out.unusable", target, error.message());
    if (status.type() != fs::file_type::directory)
        refuse("out.unusable", target, "exists and is not a folder");
    if (is_mounted_on(target))
        refuse("out.unusable", target, "something is mounted on this folder, so no other can take its place",
               "give a folder in it after -o");
    struct stat own {
    }, above{};
    const bool known = ::stat(target.c_str(), &own) == 0 && ::stat(target.parent_path().c_str(), &above) == 0;
    // In a folder like /tmp only its owner may rename it.
    if (known && (above.st_mode & S_ISVTX) != 0 && ::geteuid() != 0 && own.st_uid != ::geteuid() &&
        above.st_uid != ::geteuid())
        refuse("out.unwritable", target, std::strerror(EPERM));
    require_ours(target, target);
}

/// Takes a folder away with all that is in it. It opens one folder at a time: that no more can be opened may
/// be why it has to go. @throws std::bad_alloc; Error where it cannot be looked into
void remove_within(const fs::path& folder) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : entries_of(folder))
        if (not_a(entry, fs::file_type::directory)) fs::remove(entry.path(), ignored);
        else remove_within(entry.path());
    fs::remove(folder, ignored);
}

/// The same as far as it can be done; what stays, the next plan takes away.
void remove_folder(const fs::path& folder) noexcept {
    for (int attempt = 0; attempt < 2; ++attempt) try {
            remove_within(folder);
            return;
        } catch (const std::exception&) {  // the memory that it asked for is free again
        }
}

/// Between making a folder and having its lock, nobody of this process may look for leftovers.
std::mutex& making() {
    static std::mutex mutex;
    return mutex;
}

/// A lock on a folder, which its process holds as long as it lives; −1 where it cannot be had.
int lock_folder(const fs::path& folder) {
    const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (file >= 0 && ::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
    if (file >= 0) ::close(file);
    return -1;
}

/// Takes away folders that processes left beside the target when they were killed. Such a folder has a name
/// that only we give, is the same user's, holds nothing but what we write, and nobody that lives has its
/// lock.
void remove_leftovers(const fs::path& target) {
    std::error_code ignored;
    const bool replaced = fs::exists(target, ignored);
    const std::lock_guard none_is_made(making());
    for (fs::directory_iterator at(target.parent_path(), ignored); at != fs::directory_iterator();
         at.increment(ignored)) {
        const std::string name = at->path().filename().string(), own = target.filename().string();
        auto maker = maker_of(name, own, kPartial);
        // An old plan that was set aside goes only where a new one has its place.
        if (!maker && replaced) maker = maker_of(name, own, kOld);
        if (!maker || not_a(*at, fs::file_type::directory)) continue;
        struct stat info {};
        if (::lstat(at->path().c_str(), &info) != 0 || info.st_uid != ::geteuid()) continue;
        if (*maker != ::getpid() && lives(*maker)) continue;
        const int lock = lock_folder(at->path());
        if (lock < 0) continue;
        try {
            if (!stranger_in(at->path(), is_program_name)) fs::remove_all(at->path(), ignored);
        } catch (const Error&) {
            // It cannot be looked into, so it stays.
        }
        ::close(lock);
    }
}

}  // namespace

OutputFolder::OutputFolder(const std::string& directory) {
    require_target(directory);
    target_ = resolved(directory);
    remove_leftovers(target_);
    std::error_code error;
    // Parents that are made for this folder are remembered by the topmost, to be taken away if nothing comes
    // of it.
    fs::path missing = target_.parent_path();
    while (!missing.empty() && !fs::exists(missing, error)) {
        made_parent_ = missing;
        missing = missing.parent_path();
    }
    error.clear();
    if (!made_parent_.empty()) fs::create_directories(target_.parent_path(), error);
    const std::lock_guard until_locked(making());
    while (!error) {
        fresh_ = beside(target_, kPartial);
        if (fs::create_directory(fresh_, error)) break;  // else a dead process's has that name
    }
    if (error) {
        remove_made_parents();
        refuse("out.unwritable", target_.parent_path(), error.message());
    }
    lock_ = lock_folder(fresh_);
}

OutputFolder::~OutputFolder() {
    if (lock_ >= 0) ::close(lock_);
    if (committed_) return;
    remove_folder(fresh_);
    remove_made_parents();
}

void OutputFolder::remove_made_parents() noexcept {
    std::error_code ignored;
    // Only folders that are still empty go: somebody else may have begun to use them.
    try {
        for (fs::path parent = target_.parent_path(); !made_parent_.empty(); parent = parent.parent_path()) {
            fs::remove(parent, ignored);
            if (ignored || parent == made_parent_) break;
        }
    } catch (const std::bad_alloc&) {  // they stay, empty
    }
}

void OutputFolder::commit() {
    take_place();
    committed_ = true;
}

void OutputFolder::take_place() {
    if (::rename(fresh_.c_str(), target_.c_str()) == 0) return;  // the target did not exist, or was empty
    if (errno != ENOTEMPTY && errno != EEXIST) refuse("out.unwritable", target_, std::strerror(errno));
    require_target(target_.string());  // it may have changed while the plan was made
    // Both change places in one step, so that at every moment one whole plan lies in the target.
    const auto exchange = [&] {
        return ::renameat2(AT_FDCWD, fresh_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0;
    };
    if (exchange()) {
        try {
            require_ours(fresh_, target_);  // what came into it until that moment is not lost either
        } catch (const Error&) {
            if (exchange()) throw;
            return;  // the new plan has its place, the old folder stays beside it
        }
        remove_folder(fresh_);
        return;
    }
    // File systems without exchange: two renames, the second undone if it fails.
    const fs::path old = beside(target_, kOld);
    if (::rename(target_.c_str(), old.c_str()) != 0) refuse("out.unwritable", target_, std::strerror(errno));
    try {
        require_ours(old, target_);
        if (::rename(fresh_.c_str(), target_.c_str()) != 0)
            refuse("out.unwritable", target_, std::strerror(errno));
    } catch (const Error& error) {
        if (::rename(old.c_str(), target_.c_str()) != 0)
            refuse("out.unwritable", target_, error.message(),
                   fmt::format("what it held lies in {}", old.string()));
        throw;
    }
    remove_folder(old);
}

}  // namespace slabwright
