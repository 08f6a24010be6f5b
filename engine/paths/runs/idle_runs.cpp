#include "engine/paths/runs/idle_runs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/stock/idle_ways.h"

namespace slabwright {

namespace {

constexpr double kPiece = 2;     // mm of a run that are looked at together
constexpr double kOver = 0.005;  // mm over the cusp: rounding

std::array<double, 3> mm_of(const PathPoint& p) { return {to_mm(p.x), to_mm(p.y), to_mm(p.z)}; }

// A run in pieces of about kPiece: their ends, and which of them are points of the run.
struct Pieces {
    std::vector<PathPoint> ends;
    std::vector<char> own;
};
Pieces pieces_of(const std::vector<PathPoint>& points) {
    Pieces pieces{{points.front()}, {1}};
    for (std::size_t k = 1; k < points.size(); ++k) {
        const PathPoint &a = points[k - 1], &b = points[k];
        const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y,
                     dz = static_cast<double>(b.z) - a.z;
        const int n = std::max(
            1, static_cast<int>(std::ceil(std::sqrt(dx * dx + dy * dy + dz * dz) / (kUnitsPerMm * kPiece))));
        for (int i = 1; i <= n; ++i) {
            const double t = static_cast<double>(i) / n;
            pieces.ends.push_back(i == n ? b
                                         : PathPoint{static_cast<std::int32_t>(std::lround(a.x + t * dx)),
                                                     static_cast<std::int32_t>(std::lround(a.y + t * dy)),
                                                     static_cast<std::int32_t>(std::ceil(a.z + t * dz))});
            pieces.own.push_back(i == n);
        }
    }
    return pieces;
}

double way(const PathPoint& a, const PathPoint& b) {
    return std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
}

// Of pieces one after the other which are kept: those that cut, with one on either side, and what lies
// between two of them that is not worth leaving the cut for. Of a closed run the first piece follows the
// last.
std::vector<char> kept_of(const Pieces& pieces, std::span<const char> cuts, bool closed,
                          double worth_leaving) {
    const std::size_t n = cuts.size();
    std::vector<char> kept(cuts.begin(), cuts.end());
    for (std::size_t k = 0; k < n; ++k) {
        if (cuts[k] == 0) continue;
        if (k > 0 || closed) kept[(k + n - 1) % n] = 1;
        if (k + 1 < n || closed) kept[(k + 1) % n] = 1;
    }
    const auto first = static_cast<std::size_t>(std::find(kept.begin(), kept.end(), 1) - kept.begin());
    if (first == n) return kept;
    for (std::size_t k = 1; k < n;) {
        if (kept[(first + k) % n] != 0) {
            ++k;
            continue;
        }
        const std::size_t begin = k;
        double length = 0;
        for (; k < n && kept[(first + k) % n] == 0; ++k)
            length += way(pieces.ends[(first + k) % n], pieces.ends[(first + k) % n + 1]);
        const bool at_end = !closed && (first + k >= n || first + begin >= n);
        if (!at_end && length < worth_leaving)
            for (std::size_t i = begin; i < k; ++i) kept[(first + i) % n] = 1;
    }
    return kept;
}

// What is kept of a run.
void append_kept(const LevelRun& run, const Pieces& pieces, const std::vector<char>& kept,
                 std::vector<LevelRun>& out) {
    const std::size_t n = kept.size();
    std::size_t start = 0;
    if (run.closed) {
        while (start < n && kept[start] != 0) ++start;
        if (start == n) {
            out.push_back(run);
            return;
        }
    }
    for (std::size_t k = 0; k < n;) {
        if (kept[(start + k) % n] == 0) {
            ++k;
            continue;
        }
        LevelRun part;
        part.points.push_back(pieces.ends[(start + k) % n]);
        for (; k < n && kept[(start + k) % n] != 0; ++k) {
            const std::size_t end = (start + k) % n + 1;
            const bool last = k + 1 == n || kept[(start + k + 1) % n] == 0;
            if (pieces.own[end] != 0 || last) part.points.push_back(pieces.ends[end]);
        }
        out.push_back(std::move(part));
    }
}

}  // namespace

void take_out_idle(const LayerCut& cut, const CutterShape& cutter, double worth_leaving,
                   std::vector<std::vector<LevelRun>>& groups) {
    if (cut.stock == nullptr) return;
    std::vector<Pieces> runs;
    std::vector<StraightPiece> ways;
    for (const std::vector<LevelRun>& group : groups)
        for (const LevelRun& run : group) {
            const std::vector<PathPoint>& ends = runs.emplace_back(pieces_of(run.points)).ends;
            for (std::size_t k = 1; k < ends.size(); ++k)
                ways.push_back({mm_of(ends[k - 1]), mm_of(ends[k])});
        }
    const std::vector<char> cuts =
        which_cut(cut.context, *cut.stock, cutter, ways, cut.job.tolerances.cusp + kOver);
    std::size_t run = 0, at = 0;
    for (std::vector<LevelRun>& group : groups) {
        std::vector<LevelRun> left;
        for (const LevelRun& whole : group) {
            const Pieces& pieces = runs[run++];
            const std::size_t n = pieces.ends.size() - 1;
            append_kept(whole, pieces,
                        kept_of(pieces, std::span(cuts).subspan(at, n), whole.closed, worth_leaving), left);
            at += n;
        }
        group = std::move(left);
    }
}

}  // namespace slabwright
