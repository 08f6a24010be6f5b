// All-or-nothing output: a fresh folder beside the target is filled and then takes its place.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace slabwright {

/// @throws Error(input) unless `directory` can become a folder of ours: it does not exist, is an empty
/// folder, or is a folder that holds
///         a plan.json of ours and nothing that we do not write
void require_replaceable(const std::string& directory);

/// A folder under way. If commit() is not reached, the destructor takes it away again, with the parent
/// folders that were made for it.
class OutputFolder {
public:
    /// Makes the fresh folder. @throws Error(input) as require_replaceable, or when the place cannot be
    /// written
    explicit OutputFolder(const std::string& directory);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where `name` is to be written until commit().
    [[nodiscard]] std::filesystem::path path(std::string_view name) const { return fresh_ / name; }
    /// The target takes the fresh folder's content; an older one goes. @throws Error(input), and the target
    /// is as it was
    void commit();

private:
    std::filesystem::path target_, fresh_, made_parent_;
    bool committed_ = false;
};

/// A file written piece by piece. @throws Error(input) with path and reason when the disk does not take it
class OutputFile {
public:
    explicit OutputFile(std::filesystem::path path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    void write(std::string_view text);
    void close();  ///< every byte is handed over, or it throws

private:
    std::filesystem::path path_;
    int file_ = -1;
};

/// Writes one file, all or nothing: beside it first, then renamed over it. @throws Error(input)
void write_file_whole(const std::string& path, std::string_view text);

}  // namespace slabwright
