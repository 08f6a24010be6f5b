// Boards that slabs are cut from, sawn and milled out (slabs.layout), as Markdown (bench/reproduce boards).
//     build/release/boards_bench PART.stl…
// Slabs are those of quotes with slabs.blanks = "layer", base board included, on boards of 2440 x 1220 mm
// with 4 mm of kerf. The last line lays the slabs of all parts together. Offcuts are the largest single ones
// of those boards, m². Exits with 1 where milling them out takes more boards.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/schedule/nested_boards.h"
#include "io/quote.h"
#include "kernels/errors.h"

namespace {

using slabwright::SawnBoard;
using slabwright::SawnRectangle;
using slabwright::SawnSize;
using Sizes = std::map<double, std::vector<SawnSize>>;  // by thickness

constexpr SawnSize kBoard{2440, 1220};
constexpr double kKerf = 4;

struct Laid {
    std::size_t boards = 0;
    double offcut_m2 = 0;
};

/// @param lay one way to lay the slabs of a thickness
template <class Lay>
Laid laid(const Sizes& sizes, const Lay& lay) {
    Laid sum;
    for (const auto& [thickness, slabs] : sizes) {
        const std::vector<SawnBoard> boards = lay(slabs, kBoard, kKerf);
        sum.boards += boards.size();
        for (const SawnBoard& board : boards)
            for (const SawnRectangle& r : board.offcuts)
                sum.offcut_m2 = std::max(sum.offcut_m2, r.mm2() * 1e-6);
    }
    return sum;
}

/// @return whether milling out takes no more boards
bool print(const std::string& name, const Sizes& sizes) {
    std::size_t count = 0;
    double m2 = 0;
    for (const auto& [thickness, slabs] : sizes)
        for (const SawnSize& s : slabs) ++count, m2 += s.length * s.width * 1e-6;
    const Laid sawn = laid(sizes, slabwright::lay_on_boards),
               milled = laid(sizes, slabwright::nest_on_boards);
    std::printf("| %s | %zu | %.3f | %zu | %.3f | %zu | %.3f |\n", name.c_str(), count, m2, sawn.boards,
                sawn.offcut_m2, milled.boards, milled.offcut_m2);
    std::fflush(stdout);
    return milled.boards <= sawn.boards;
}

}  // namespace

int main(int count, char** arguments) {
    bool good = count > 1;
    Sizes all;
    std::printf(
        "| part | slabs | m² | boards, sawn | offcut, m² | boards, milled out | offcut, m² |\n"
        "|---|---|---|---|---|---|---|\n");
    for (int i = 1; i < count; ++i) {
        const std::filesystem::path stl = arguments[i];
        slabwright::Job job;
        job.slabs.blanks = slabwright::Blanks::layer;
        job.slabs.board_length = kBoard.length;
        job.slabs.board_width = kBoard.width;
        job.slabs.kerf = kKerf;
        if (stl.stem().string().find("cylinder_half") != std::string::npos) job.tolerances.weld = 0.01;
        try {
            slabwright::Context context;
            Sizes own;
            for (const auto& blank : slabwright::quote_model(context, stl.string(), job).quote.boards.blanks)
                own[blank.thickness].push_back(blank.size);
            good &= print(stl.stem().string(), own);
            for (const auto& [thickness, slabs] : own)
                all[thickness].insert(all[thickness].end(), slabs.begin(), slabs.end());
        } catch (const slabwright::Error& error) {
            std::fprintf(stderr, "boards_bench: %s\n", error.what());
            good = false;
        }
    }
    good &= print("all together", all);
    return good ? 0 : 1;
}
