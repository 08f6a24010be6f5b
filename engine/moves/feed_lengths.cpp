#include "engine/moves/feed_lengths.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

void add_length(std::vector<FeedLength>& lengths, const FeedLength& more) {
    const auto at = std::lower_bound(lengths.begin(), lengths.end(), more.feed,
                                     [](const FeedLength& a, double value) { return a.feed < value; });
    if (at == lengths.end() || at->feed != more.feed) {
        lengths.insert(at, more);
        return;
    }
    at->mm += more.mm;
    for (std::size_t k = 0; k < 3; ++k) at->moment[k] += more.moment[k];
}

FeedLength straight_length(double feed, const std::array<double, 3>& from, const std::array<double, 3>& to) {
    const double mm = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    return {feed, mm, {mm * (from[0] + to[0]) / 2, mm * (from[1] + to[1]) / 2, mm * (from[2] + to[2]) / 2}};
}

FeedLength arc_length(double feed, const LevelArc& arc) {
    // ∫(centre + r·(cos φ, sin φ)) r dφ; the integral of a cosine is a difference of sines, spelled as a
    // product so that short arcs lose no digits.
    const double mm = arc.length(), middle = arc.start + arc.turn / 2,
                 chord = 2 * arc.radius * arc.radius * std::sin(std::abs(arc.turn) / 2);
    return {
        feed, mm, {mm * arc.x + chord * std::cos(middle), mm * arc.y + chord * std::sin(middle), mm * arc.z}};
}

std::vector<FeedLength> feed_lengths(std::span<const Move> moves) {
    const auto place = [](const Move& m) {
        return std::array<double, 3>{to_mm(std::int64_t{m.x}), to_mm(std::int64_t{m.y}),
                                     to_mm(std::int64_t{m.z})};
    };
    std::vector<FeedLength> lengths;
    // A second move that is a rapid at the first one's height is the first to name x and y.
    const std::size_t first = moves.size() > 1 && moves[1].feed == 0 && moves[1].z == moves[0].z ? 2 : 1;
    for (std::size_t i = first; i < moves.size(); ++i) {
        const Move &a = moves[i - 1], &b = moves[i];
        FeedLength more;
        if (b.is_arc()) {
            const double end =
                std::hypot(to_mm(std::int64_t{b.x} - a.x - b.i), to_mm(std::int64_t{b.y} - a.y - b.j));
            const ArcShape arc = arc_shape(a, b);
            more = arc_length(b.feed, {arc.x, arc.y, to_mm(std::int64_t{b.z}), (arc.radius + end) / 2,
                                       arc.start, arc.sweep});
        } else {
            more = straight_length(b.feed, place(a), place(b));
        }
        if (more.mm > 0) add_length(lengths, more);
    }
    return lengths;
}

}  // namespace slabwright
