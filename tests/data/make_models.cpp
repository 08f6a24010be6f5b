// Writes the project's models as binary STL:
//     make_models all DIRECTORY
//     make_models metre OUT.stl [--facets N] [--size MM] [--height MM] [--seed S] [--shuffled]
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <random>

#include "tests/data/luo_layer_sample.h"
#include "tests/data/models.h"

namespace {

using namespace slabwright;

void write_file(const std::string& path, const std::string& bytes) {
    std::ofstream file(path, std::ios::binary);
    if (!file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush())
        throw std::runtime_error(path + ": cannot be written");
}

void write_all(const std::string& directory) {
    write_file(directory + "/luo-layer-sample.stl", stl_bytes("luo-layer-sample", luo_layer_sample()));
    write_file(directory + "/luo-tool-sample.stl", stl_bytes("luo-tool-sample", luo_tool_sample()));
    write_file(directory + "/half-sphere.stl", stl_bytes("half-sphere", half_sphere()));
    write_file(directory + "/pump-cover.stl", stl_bytes("pump-cover", pump_cover()));
}

void write_metre(const std::string& path, const MetrePattern& pattern, bool shuffled) {
    const std::uint64_t facets =
        metre_pattern_facets(pattern);  // before anything is written: it refuses what cannot be made
    std::ofstream file(path, std::ios::binary);
    auto write_head = [&](std::uint64_t count) {
        const std::string head = stl_head("metre", count);
        file.write(head.data(), static_cast<std::streamsize>(head.size()));
    };
    std::uint64_t written = 0;
    write_head(facets);
    if (shuffled) {
        std::vector<std::array<char, 50>> records;
        records.reserve(facets);
        metre_pattern(pattern, [&](const Facet& facet) { records.push_back(stl_facet(facet)); });
        std::mt19937_64 random(pattern.seed);
        for (std::size_t i = records.size(); i > 1; --i) std::swap(records[i - 1], records[random() % i]);
        file.write(records.front().data(), static_cast<std::streamsize>(records.size() * sizeof records[0]));
        written = records.size();
    } else {
        metre_pattern(pattern, [&](const Facet& facet) {
            const auto record = stl_facet(facet);
            file.write(record.data(), record.size());
            ++written;
        });
    }
    file.seekp(0);
    write_head(written);
    if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
    std::cout << path << ": " << written << " facets\n";
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Writes the project's models as binary STL, the same bytes every time.");
    app.option_defaults()->always_capture_default();
    app.require_subcommand(1);
    std::string out;
    MetrePattern pattern;
    bool shuffled = false;
    CLI::App* all = app.add_subcommand("all", "the four models of tests/data");
    all->add_option("directory", out)->required();
    CLI::App* metre = app.add_subcommand("metre", "a pattern of any size and number of facets");
    metre->add_option("out", out)->required();
    metre->add_option("--facets", pattern.facets, "at least so many");
    metre->add_option("--size", pattern.size_mm, "side of the square, mm");
    metre->add_option("--height", pattern.height_mm, "mm");
    metre->add_option("--seed", pattern.seed, "chooses the features");
    metre->add_flag("--shuffled", shuffled, "facets in random order");
    try {
        app.parse(argc, argv);
        if (*all) write_all(out);
        if (*metre) write_metre(out, pattern, shuffled);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        std::cerr << "make_models: " << error.what() << '\n';
        return 1;
    }
    return 0;
}
