#include "engine/forces/split_cuts.h"

#include <algorithm>
#include <utility>

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

Move straight_to(Move at, std::uint32_t feed) {
    at.feed = feed;
    at.i = at.j = 0;
    return at;
}

// Writes runs with their passes behind what lies before them.
class Splitter {
public:
    Splitter(const std::vector<Move>& moves, std::uint32_t plunge_feed, bool by_turns)
        : moves_(moves), plunge_feed_(plunge_feed), by_turns_(by_turns) {}

    void copy(std::size_t first, std::size_t end) {
        split_.moves.insert(split_.moves.end(), moves_.begin() + static_cast<std::ptrdiff_t>(first),
                            moves_.begin() + static_cast<std::ptrdiff_t>(end));
    }

    void add(const Passes& run) {
        SplitRun& into = split_.runs.emplace_back();
        into.all.first = next();
        const Move start = straight_to(moves_[run.first - 1], plunge_feed_),
                   end = straight_to(moves_[run.last], plunge_feed_);
        const bool closed = start.x == end.x && start.y == end.y && start.z == end.z,
                   by_turns = by_turns_ && level(run);
        bool at_start = true;
        for (const std::int32_t up : run.up) {
            split_.moves.push_back(raised(at_start ? start : end, up));
            const std::uint32_t first = next();
            go(run, up, at_start);
            into.passes.push_back({first, next() - 1});
            if (closed) continue;
            if (by_turns) at_start = !at_start;
            else go(run, up, false);
        }
        if (!at_start) go(run, run.up.back(), false);
        if (!run.up.empty()) split_.moves.push_back(start);
        copy(run.first, run.last + std::size_t{1});
        into.all.last = next() - 1;
    }

    [[nodiscard]] SplitMoves take() { return std::move(split_); }

private:
    [[nodiscard]] std::uint32_t next() const { return static_cast<std::uint32_t>(split_.moves.size()); }

    [[nodiscard]] bool level(const Passes& run) const {
        const auto end = moves_.begin() + run.last + 1;
        return std::all_of(moves_.begin() + run.first, end,
                           [z = moves_[run.first - 1].z](const Move& m) { return m.z == z; });
    }

    void go(const Passes& run, std::int32_t up, bool forward) {
        if (forward)
            for (std::uint32_t k = run.first; k <= run.last; ++k)
                split_.moves.push_back(raised(moves_[k], up));
        else
            for (std::uint32_t k = run.last; k >= run.first; --k)
                split_.moves.push_back(raised(backward(moves_[k - 1], moves_[k]), up));
    }

    const std::vector<Move>& moves_;
    const std::uint32_t plunge_feed_;
    const bool by_turns_;
    SplitMoves split_;
};

}  // namespace

Passes passes_of(const DeepRun& run) {
    Passes result{run.first, run.last, {}};
    for (int pass = 1; pass < run.passes; ++pass) {
        const double rest = static_cast<double>(run.passes - pass) / run.passes;
        result.up.push_back(
            to_units(run.depth_mm * (run.shares == PassShares::growing ? rest * rest : rest)));
    }
    return result;
}

SplitMoves split_runs(const std::vector<Move>& moves, std::span<const Passes> runs, std::uint32_t plunge_feed,
                      bool by_turns) {
    Splitter splitter(moves, plunge_feed, by_turns);
    std::size_t next = 0;
    for (const Passes& run : runs) {
        splitter.copy(next, run.first);
        splitter.add(run);
        next = run.last + std::size_t{1};
    }
    splitter.copy(next, moves.size());
    return splitter.take();
}

}  // namespace slabwright
