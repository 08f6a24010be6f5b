// A part of two layers in a folder of its own, the commands on it, and what they leave in OUT.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace slabwright::faults {

using Tree = std::map<std::string, std::string>;

/// Whether two folders hold the same, but for the time at which progress.json was written.
inline bool same(Tree a, Tree b) {
    for (Tree* tree : {&a, &b}) {
        const auto progress = tree->find("progress.json");
        const std::size_t at =
            progress == tree->end() ? std::string::npos : progress->second.find("\"time\"");
        if (at != std::string::npos) progress->second.erase(at, progress->second.find('\n', at) - at);
    }
    return a == b;
}

/// A plate with a boss, planned in a tenth of a second. Commands run on one thread unless they say otherwise.
struct PlateBuild {
    support::TemporaryFolder folder;
    std::string part = folder / "part.stl", out = folder / "out";

    explicit PlateBuild(float height = 24) {
        Context context;
        shapes::Facets facets = shapes::box({0, 0, 0}, {30, 20, 8});
        shapes::append(facets, shapes::box({4, 3, 6}, {26, 17, height}));
        write_stl(part, weld(context, facets));
    }
    [[nodiscard]] std::vector<std::string> plan() const {
        return with({"plan", part, "-o", out, "--tools", "fixed", "--quiet"});
    }
    [[nodiscard]] std::vector<std::string> verify() const { return with({"verify", out, "--stl", part}); }
    [[nodiscard]] std::vector<std::string> report() const { return with({"report", out, "--stl", part}); }
    [[nodiscard]] std::vector<std::string> resume(std::vector<std::string> options) const {
        options.insert(options.begin(), {"resume", out});
        return with(std::move(options));
    }
    /// Names beside part and OUT.
    [[nodiscard]] std::string strangers() const {
        std::string names;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
            const std::string name = entry.path().filename().string();
            if (name != "part.stl" && name != "out") names += name + " ";
        }
        return names;
    }
    [[nodiscard]] Tree tree() const { return support::tree(out); }
    /// Makes OUT what it was.
    void restore(const Tree& tree) const {
        std::filesystem::remove_all(out);
        for (const auto& [name, text] : tree) {
            const std::filesystem::path path = std::filesystem::path(out) / name;
            if (std::filesystem::path(name).filename() == "nc" || name.ends_with("resume_001")) {
                std::filesystem::create_directories(path);
            } else {
                std::filesystem::create_directories(path.parent_path());
                support::spit(path, text);
            }
        }
    }

private:
    static std::vector<std::string> with(std::vector<std::string> words) {
        words.insert(words.begin(), support::built_command());
        words.insert(words.end(), {"--threads", "1"});
        return words;
    }
};

}  // namespace slabwright::faults
