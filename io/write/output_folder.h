// All-or-nothing output: a fresh folder beside the target is filled and then takes its place.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace slabwright {

/// A folder under way. If commit() is not reached, the destructor takes it away again, with the parent
/// folders that were made for it. While it lives it holds a lock on its folder, by which others know that it
/// is not a dead process's.
class OutputFolder {
public:
    /// Makes the fresh folder, beside the target, and makes sure that it can take the target's place: that
    /// does not exist, is an empty folder, or is a folder that holds a plan of ours and nothing that such a
    /// folder cannot hold. Takes away what dead processes left beside it.
    /// @throws Error(input) that names what stands against it
    explicit OutputFolder(const std::string& directory);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// The folder to write to until commit().
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return fresh_; }
    /// The target takes the fresh folder's content; an older plan goes. @throws Error(input), and the target
    /// is as it was
    void commit();

private:
    void take_place();
    void remove_made_parents() noexcept;

    std::filesystem::path target_, fresh_, made_parent_;
    int lock_ = -1;
    bool committed_ = false;
};

}  // namespace slabwright
