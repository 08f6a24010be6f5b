#include "kernels/polygons/loops.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace slabwright {

namespace {

// Coordinates are int32, so differences need 33 bits and their products 66: sums and orientations are exact
// in 128.
using Wide = __int128;

/// Twice the signed area, exact.
Wide twice_area(std::span<const Point2> loop) {
    Wide sum = 0;
    if (loop.size() < 3) return sum;
    const std::int64_t ox = loop[0].x, oy = loop[0].y;
    std::int64_t px = loop[1].x - ox, py = loop[1].y - oy;
    for (std::size_t i = 2; i < loop.size(); ++i) {
        const std::int64_t x = loop[i].x - ox, y = loop[i].y - oy;
        sum += static_cast<Wide>(px) * y - static_cast<Wide>(py) * x;
        px = x;
        py = y;
    }
    return sum;
}

constexpr double kHalfSquareUnit = 0.5 / (kUnitsPerMm * kUnitsPerMm);  // mm² per unit of twice_area

/// A run of edges of one loop along which y never turns back; horizontal edges ride along.
struct Chain {
    std::int32_t y_low = 0, y_high = 0, x_low = 0, x_high = 0;
    std::uint32_t loop = 0;
    std::uint32_t first = 0, edges = 0;  // offset of its first point within the loop, number of edges
    std::int32_t direction = 0;          // +1 rises, −1 falls
};

/// An abscissa num / den, den > 0, exact.
struct Ratio {
    Wide num = 0, den = 1;
};
bool less_or_equal(const Ratio& a, const Ratio& b) { return a.num * b.den <= b.num * a.den; }
bool less(const Ratio& a, const Ratio& b) { return a.num * b.den < b.num * a.den; }
std::int64_t floor_of(const Ratio& r) {
    Wide q = r.num / r.den;
    if (q * r.den > r.num) --q;
    return static_cast<std::int64_t>(q);
}

Point2 cyclic(std::span<const Point2> loop, std::size_t i) {
    return loop[i < loop.size() ? i : i - loop.size()];
}

/// Where the chain crosses the line at y + 1/2. Needs y_low <= y < y_high.
Ratio crossing(const Chain& chain, std::span<const Point2> loop, std::int32_t y) {
    // The last point of the chain on its starting side; the next one lies across the line.
    std::size_t low = 0, high = chain.edges;
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        const bool upper = cyclic(loop, chain.first + middle).y > y;
        if (upper == (chain.direction > 0)) high = middle;
        else low = middle;
    }
    Point2 a = cyclic(loop, chain.first + low), b = cyclic(loop, chain.first + high);
    if (chain.direction < 0) std::swap(a, b);
    const Wide rise = static_cast<Wide>(b.y) - a.y, run = static_cast<Wide>(b.x) - a.x;
    return {2 * rise * a.x + run * (2 * (static_cast<Wide>(y) - a.y) + 1), 2 * rise};
}

void append_chains(std::span<const Point2> loop, std::uint32_t index, std::vector<Chain>& chains) {
    const std::size_t n = loop.size();
    if (n < 3) return;
    std::size_t lowest = 0;
    for (std::size_t i = 1; i < n; ++i)
        if (loop[i].y < loop[lowest].y) lowest = i;
    Chain chain;
    auto open = [&](std::size_t k, std::int32_t direction) {
        const Point2 p = cyclic(loop, lowest + k);
        chain = {p.y, p.y, p.x, p.x, index, static_cast<std::uint32_t>((lowest + k) % n), 0, direction};
    };
    auto extend = [&](Point2 p) {
        ++chain.edges;
        chain.y_low = std::min(chain.y_low, p.y);
        chain.y_high = std::max(chain.y_high, p.y);
        chain.x_low = std::min(chain.x_low, p.x);
        chain.x_high = std::max(chain.x_high, p.x);
    };
    // Starting at a lowest point, the first chain rises and the last one ends where it began.
    open(0, +1);
    for (std::size_t k = 0; k < n; ++k) {
        const Point2 p = cyclic(loop, lowest + k), q = cyclic(loop, k + 1 == n ? lowest : lowest + k + 1);
        const std::int32_t direction = q.y > p.y ? 1 : q.y < p.y ? -1 : chain.direction;
        if (direction != chain.direction) {
            if (chain.y_high > chain.y_low) chains.push_back(chain);
            open(k, direction);
        }
        extend(q);
    }
    if (chain.y_high > chain.y_low) chains.push_back(chain);
}

/// A point just right of `x` on the line at y + 1/2.
struct Probe {
    std::uint32_t loop = 0;
    std::int32_t y = 0;
    Ratio x;
};

/// The leftmost crossing at y + 1/2 behind which the loop's own winding is not zero. Whiskers (edges there
/// and back) have none; then false.
bool leftmost_inside(std::span<const Chain> chains, std::span<const Point2> loop, std::int32_t y, Ratio& x,
                     bool& any) {
    struct Crossing {
        Ratio x;
        std::int32_t direction;
    };
    std::vector<Crossing> row;
    for (const Chain& chain : chains)
        if (chain.y_low <= y && y < chain.y_high) row.push_back({crossing(chain, loop, y), chain.direction});
    any = !row.empty();
    if (!any) return false;
    std::sort(row.begin(), row.end(), [](const Crossing& a, const Crossing& b) { return less(a.x, b.x); });
    int sum = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
        sum += row[i].direction;
        const bool last_here = i + 1 == row.size() || less(row[i].x, row[i + 1].x);
        if (last_here && sum != 0) {
            x = row[i].x;
            return true;
        }
    }
    x = row.front().x;
    return false;
}

}  // namespace

double signed_area(std::span<const Point2> loop) {
    return static_cast<double>(twice_area(loop)) * kHalfSquareUnit;
}

double area(const Loops& loops) {
    Wide sum = 0;
    for (std::size_t i = 0; i < loops.size(); ++i) sum += twice_area(loops.loop(i));
    return static_cast<double>(sum) * kHalfSquareUnit;
}

int winding(const Loops& loops, Point2 p) {
    int turns = 0;
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        if (loop.empty()) continue;
        Point2 a = loop.back();
        for (const Point2 b : loop) {
            // An edge counts when it crosses the ray from p to the right; half-open in y, so that a vertex
            // counts once.
            const bool a_upper = a.y > p.y, b_upper = b.y > p.y;
            if (a_upper != b_upper) {
                const Wide side = (static_cast<Wide>(b.x) - a.x) * (static_cast<std::int64_t>(p.y) - a.y) -
                                  (static_cast<Wide>(b.y) - a.y) * (static_cast<std::int64_t>(p.x) - a.x);
                if (b_upper && side > 0) ++turns;
                if (a_upper && side < 0) --turns;
            }
            a = b;
        }
    }
    return turns;
}

namespace {

/// A point just right of a crossing, inside each loop that has any inside; chains of all loops go to
/// `chains`.
std::vector<Probe> probe_loops(const Loops& loops, std::vector<Chain>& chains) {
    std::vector<Probe> probes;
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        const std::size_t first = chains.size();
        append_chains(loop, static_cast<std::uint32_t>(i), chains);
        const std::span<const Chain> own = std::span(chains).subspan(first);
        if (own.empty()) continue;  // flat: no inside, no place in the order
        std::int32_t low = std::numeric_limits<std::int32_t>::max(),
                     high = std::numeric_limits<std::int32_t>::min();
        for (const Chain& chain : own) {
            low = std::min(low, chain.y_low);
            high = std::max(high, chain.y_high);
        }
        Probe probe{static_cast<std::uint32_t>(i), low, {}};
        bool any = false;
        if (!leftmost_inside(own, loop, low, probe.x, any)) {
            // A whisker hangs from the loop's bottom: the middle is a better place, if it is not one of
            // whiskers too.
            Probe middle{
                probe.loop, static_cast<std::int32_t>((static_cast<std::int64_t>(low) + high - 1) / 2), {}};
            if (leftmost_inside(own, loop, middle.y, middle.x, any)) probe = middle;
        }
        probes.push_back(probe);
    }
    return probes;
}

/// Which loops have an abscissa between their leftmost and their rightmost point: a segment tree over the
/// abscissae that are ever asked for. A loop lies in O(log n) nodes, and in one at most on the way from any
/// leaf to the root.
class LoopsOverX {
public:
    explicit LoopsOverX(std::vector<std::int64_t> asked) : asked_(std::move(asked)) {
        std::sort(asked_.begin(), asked_.end());
        asked_.erase(std::unique(asked_.begin(), asked_.end()), asked_.end());
        nodes_.resize(2 * asked_.size());
    }
    /// Adds a loop that covers low <= x < high.
    void add(std::uint32_t loop, std::int64_t low, std::int64_t high) {
        std::size_t begin = leaf(low), end = leaf(high);
        for (; begin < end; begin /= 2, end /= 2) {
            if (begin % 2 == 1) nodes_[begin++].push_back(loop);
            if (end % 2 == 1) nodes_[--end].push_back(loop);
        }
    }
    /// Calls visit(loop) for those that cover x, which was asked for, the last that were added to a node
    /// first; drops those for which it returns false.
    template <class Visit>
    void at(std::int64_t x, Visit visit) {
        for (std::size_t node = leaf(x); node > 0; node /= 2) {
            std::vector<std::uint32_t>& held = nodes_[node];
            // From the back; what is dropped leaves a gap that the kept ones behind it close, in order.
            std::size_t kept = held.size();
            for (std::size_t i = held.size(); i-- > 0;)
                if (visit(held[i])) held[--kept] = held[i];
            held.erase(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(kept));
        }
    }

private:
    [[nodiscard]] std::size_t leaf(std::int64_t x) const {
        return asked_.size() +
               static_cast<std::size_t>(std::lower_bound(asked_.begin(), asked_.end(), x) - asked_.begin());
    }
    std::vector<std::int64_t> asked_;
    std::vector<std::vector<std::uint32_t>> nodes_;  // node i has the children 2 i and 2 i + 1; 0 is none
};

}  // namespace

// Every loop is asked for at one point: on a line half a unit above an integer height, just right of the
// loop's leftmost crossing. No point of any loop lies on such a line, so loops that touch in points cannot
// confuse the count, and where they share an edge "just right" decides. All arithmetic is exact. Whether
// another loop holds that point is found by counting its signed crossings to the left, over chains of edges
// that rise or fall: a chain that lies wholly on one side costs one comparison, the others a binary search.
// A sweep in y keeps up which loops a line meets, a tree over x which of those have the point between their
// ends: fins in a row never ask about one another.
//
// Only a larger loop (of two equal ones the earlier) may be a parent, so that there is no cycle even where
// loops cross. A loop that could not better the parent found so far is not counted: loops that are given
// many times over cost a comparison each.
void nest(Loops& loops) {
    const std::size_t n = loops.size();
    loops.parents.assign(n, -1);
    if (n < 2) return;

    std::vector<Chain> chains;
    std::vector<Probe> probes = probe_loops(loops, chains);
    std::vector<Wide> size(n);
    std::vector<std::int32_t> left(n, std::numeric_limits<std::int32_t>::max());
    std::vector<std::int32_t> right(n, std::numeric_limits<std::int32_t>::min());
    std::vector<std::int32_t> top = right;
    for (std::size_t i = 0; i < n; ++i) {
        size[i] = twice_area(loops.loop(i));
        if (size[i] < 0) size[i] = -size[i];
    }
    for (const Chain& chain : chains) {
        left[chain.loop] = std::min(left[chain.loop], chain.x_low);
        right[chain.loop] = std::max(right[chain.loop], chain.x_high);
        top[chain.loop] = std::max(top[chain.loop], chain.y_high);
    }
    auto larger = [&](std::size_t a, std::size_t b) {
        return size[a] != size[b] ? size[a] > size[b] : a < b;
    };
    // Of those that begin on one line the larger first, so that the smallest is met first.
    std::sort(chains.begin(), chains.end(), [&](const Chain& a, const Chain& b) {
        if (a.y_low != b.y_low) return a.y_low < b.y_low;
        return a.loop != b.loop ? larger(a.loop, b.loop) : a.first < b.first;
    });
    std::sort(probes.begin(), probes.end(), [](const Probe& a, const Probe& b) { return a.y < b.y; });

    std::vector<std::int64_t> asked;
    for (const Probe& probe : probes) asked.push_back(floor_of(probe.x));
    LoopsOverX over(std::move(asked));
    std::vector<std::vector<Chain>> active(n);  // of each loop, those that the line may still meet
    std::vector<bool> added(n, false);
    std::size_t next = 0;
    for (const Probe& probe : probes) {
        for (; next < chains.size() && chains[next].y_low <= probe.y; ++next) {
            const std::uint32_t loop = chains[next].loop;
            active[loop].push_back(chains[next]);
            if (!added[loop]) over.add(loop, left[loop], right[loop]);
            added[loop] = true;
        }
        const std::int64_t x = floor_of(probe.x);
        std::int32_t parent = -1;
        over.at(x, [&](std::uint32_t j) {
            if (top[j] <= probe.y) return false;
            if (!larger(j, probe.loop) || (parent >= 0 && !larger(static_cast<std::size_t>(parent), j)))
                return true;
            std::erase_if(active[j], [&](const Chain& chain) { return chain.y_high <= probe.y; });
            std::int32_t turns = 0;
            for (const Chain& chain : active[j])
                if (chain.x_low <= x &&
                    (chain.x_high <= x || less_or_equal(crossing(chain, loops.loop(j), probe.y), probe.x)))
                    turns += chain.direction;
            if (turns != 0) parent = static_cast<std::int32_t>(j);
            return true;
        });
        loops.parents[probe.loop] = parent;
    }
}

std::vector<std::vector<Span>> line_spans(const Loops& region, std::span<const double> y) {
    using Crossing = std::pair<double, int>;
    std::vector<std::vector<Crossing>> crossings(y.size());
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
            const double low = std::min(a.y, b.y), high = std::max(a.y, b.y);
            for (auto at = std::lower_bound(y.begin(), y.end(), low); at != y.end() && *at < high; ++at) {
                const double t = (*at - a.y) / (static_cast<double>(b.y) - a.y);
                crossings[static_cast<std::size_t>(at - y.begin())].emplace_back(
                    a.x + t * (static_cast<double>(b.x) - a.x), a.y > b.y ? 1 : -1);
            }
        }
    }
    std::vector<std::vector<Span>> lines(y.size());
    for (std::size_t j = 0; j < y.size(); ++j) {
        // Entering before leaving where two crossings coincide, so that touching loops make one span.
        std::sort(crossings[j].begin(), crossings[j].end(), [](const Crossing& a, const Crossing& b) {
            return a.first != b.first ? a.first < b.first : a.second > b.second;
        });
        int depth = 0;
        for (const auto& [x, turn] : crossings[j]) {
            if (depth <= 0 && depth + turn > 0) lines[j].push_back({x, x});
            depth += turn;
            if (depth <= 0 && depth - turn > 0) lines[j].back().high = x;
        }
    }
    return lines;
}

}  // namespace slabwright
