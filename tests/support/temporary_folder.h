// A folder of a test's own, gone with its scope.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace slabwright::support {

class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / ("slabwright-" + std::string(6, 'X')))
                               .string();  // mkdtemp fills the X in
        if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder under " + name);
        path = name;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] std::string operator/(const std::string& name) const { return (path / name).string(); }

    std::filesystem::path path;
};

}  // namespace slabwright::support
