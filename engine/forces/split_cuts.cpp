#include "engine/forces/split_cuts.h"

#include <cmath>

namespace slabwright {

namespace {

Move raised(Move m, std::int32_t by) {
    m.z += by;
    return m;
}

// The move that leads from the end of `move` back to `from`. The centre of an arc counts from where it
// begins; being the shorter arc either way, it turns the other way round by itself.
Move backward(const Move& from, const Move& move) {
    Move back = from;
    back.feed = move.feed;
    back.i = back.j = 0;
    if (move.is_arc()) back.i = from.x + move.i - move.x, back.j = from.y + move.j - move.y;
    return back;
}

}  // namespace

std::vector<Move> split_runs(const std::vector<Move>& moves, std::span<const DeepRun> runs,
                             std::uint32_t plunge_feed) {
    std::vector<Move> result;
    result.reserve(moves.size());
    std::size_t next = 0;
    for (const DeepRun& run : runs) {
        result.insert(result.end(), moves.begin() + static_cast<std::ptrdiff_t>(next),
                      moves.begin() + run.first);
        next = run.first;
        Move start = moves[run.first - 1];
        start.feed = plunge_feed;
        start.i = start.j = 0;
        for (int pass = 1; pass < run.passes; ++pass) {
            const double rest = static_cast<double>(run.passes - pass) / run.passes;
            const std::int32_t up =
                to_units(run.depth_mm * (run.shares == PassShares::growing ? rest * rest : rest));
            result.push_back(raised(start, up));
            for (std::uint32_t k = run.first; k <= run.last; ++k) result.push_back(raised(moves[k], up));
            for (std::uint32_t k = run.last; k >= run.first; --k)
                result.push_back(raised(backward(moves[k - 1], moves[k]), up));
        }
        result.push_back(start);
    }
    result.insert(result.end(), moves.begin() + static_cast<std::ptrdiff_t>(next), moves.end());
    return result;
}

}  // namespace slabwright
