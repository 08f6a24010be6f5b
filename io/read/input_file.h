// How files are read: regular files only, opened without waiting, no longer than their kind may be.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "kernels/errors.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// How long a file of one kind may be, and how one that cannot be read is refused.
struct ReadRule {
    ErrorKind kind = ErrorKind::input;
    std::string code;              ///< of the error. One that ends in a point is completed by what is wrong:
                                   ///< missing, directory, unreadable, too_large or changed
    std::uint64_t most_bytes = 0;  ///< a longer file is refused before it is read
    std::string remedy = {};       ///< empty: one that suits what is wrong
};

inline constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;
inline constexpr std::uint64_t kMostJobBytes = kMebibyte;                ///< job files have some kilobytes
inline constexpr std::uint64_t kMostPostBytes = kMebibyte / 16;          ///< as above
inline constexpr std::uint64_t kMostToolTableBytes = kMebibyte;          ///< a line for each tool
inline constexpr std::uint64_t kMostDocumentBytes = 64 * kMebibyte;      ///< plan.json has some megabytes
inline constexpr std::uint64_t kMostProgramBytes = 1024 * kMebibyte;     ///< one operation's G-code
inline constexpr std::uint64_t kMostMeshBytes = std::uint64_t{1} << 40;  ///< memory is the limit before

/// A regular file, open to be read. Pipes, devices and folders are refused at once: none of them is waited
/// for. A file that becomes shorter while it is read is an error, never a signal.
class InputFile {
public:
    /// @throws Error as the rule says
    InputFile(std::filesystem::path path, ReadRule rule);
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    /// Bytes, when it was opened.
    [[nodiscard]] std::uint64_t size() const noexcept { return static_cast<std::uint64_t>(opened_.st_size); }
    /// Copies [offset, offset + bytes). May be called from several threads. @throws Error as the rule says
    /// when the file ends before
    void read(std::uint64_t offset, char* into, std::uint64_t bytes) const;
    /// @throws Error as the rule says when somebody has written the file since it was opened
    void require_unchanged() const;

private:
    [[noreturn]] void refuse(const char* word, const std::string& message, const char* remedy) const;

    std::filesystem::path path_;
    ReadRule rule_;
    int file_ = -1;
    struct stat opened_ {};
};

/// The whole of a file. @throws Error as the rule says
[[nodiscard]] std::string read_whole(const std::filesystem::path& path, const ReadRule& rule);

/// The whole of a JSON document of kMostDocumentBytes at most, nested no deeper than documents of ours: who
/// writes it again calls himself for each level. @throws Error as kind, code and remedy say
[[nodiscard]] std::string read_document(const std::filesystem::path& path, ErrorKind kind,
                                        const std::string& code, const std::string& remedy);

}  // namespace slabwright
