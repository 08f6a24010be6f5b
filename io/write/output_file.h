// How files are written: beside their place first, then renamed over it. Nobody reads half of one, and
// nothing is written through a link.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace slabwright {

/// A file under way. What stands at its place is replaced when close() is reached, and stays as it is when it
/// is not. A link there is replaced itself; what it leads to is not touched.
class OutputFile {
public:
    /// @param folder that exists. Links that lead to it are followed: its user named it
    /// @param name of the file in it
    /// @throws Error(input, "out.unusable") where a folder or a device has that name,
    ///         Error(input, "out.unwritable") where the folder takes no file
    OutputFile(const std::filesystem::path& folder, std::string name);
    ~OutputFile();  ///< what was not closed goes away
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// @throws Error(input, "out.unwritable") with path and reason when the disk does not take it
    void write(std::string_view text);
    /// Every byte is handed over and the file has its name, or it throws as write() does.
    void close();

private:
    [[noreturn]] void abandon(int error);
    void forget() noexcept;

    std::filesystem::path path_;
    std::string name_, fresh_;
    int folder_ = -1, file_ = -1;
};

/// Writes one file into a folder of ours, as OutputFile does. @throws Error(input)
void write_file_in(const std::filesystem::path& folder, const std::string& name, std::string_view text);

/// Writes one file where the user said. Where a link stands there, the file that it leads to is replaced.
/// @throws Error(input)
void write_file_whole(const std::string& path, std::string_view text);

/// Makes a folder for files that the user asked for, with its parents. @throws Error(input, "out.unwritable")
void make_output_directory(const std::string& directory);

/// What is beside `name` until it takes its place: ".name.purpose-process-number".
[[nodiscard]] std::string fresh_name(std::string_view name, std::string_view purpose);

/// The number of the process that a fresh name stands for; nothing for any other name.
/// @param fresh a name of a file or folder
[[nodiscard]] std::optional<long> maker_of(std::string_view fresh, std::string_view name,
                                           std::string_view purpose);

}  // namespace slabwright
