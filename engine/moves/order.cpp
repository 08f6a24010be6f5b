#include "engine/moves/order.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace slabwright {

NearestRuns::NearestRuns(std::vector<Beginning> beginnings, std::size_t runs)
    : nodes_(std::move(beginnings)) {
    const std::size_t n = nodes_.size();
    low_.assign(n, kNone);
    high_.assign(n, kNone);
    parent_.assign(n, kNone);
    left_.assign(n, 0);
    gone_.assign(n, 0);
    root_ = build(0, static_cast<std::uint32_t>(n), false, kNone);
    starts_.assign(runs + 1, 0);
    for (const Beginning& b : nodes_) ++starts_[b.run + 1];
    for (std::size_t k = 1; k < starts_.size(); ++k) starts_[k] += starts_[k - 1];
    members_.resize(n);
    std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
    for (std::uint32_t k = 0; k < n; ++k) members_[next[nodes_[k].run]++] = k;
}

std::uint32_t NearestRuns::build(std::uint32_t first, std::uint32_t last, bool by_y, std::uint32_t parent) {
    if (first == last) return kNone;
    const std::uint32_t middle = first + (last - first) / 2;
    std::nth_element(nodes_.begin() + first, nodes_.begin() + middle, nodes_.begin() + last,
                     [&](const Beginning& a, const Beginning& b) {
                         const std::int32_t ka = by_y ? a.at.y : a.at.x, kb = by_y ? b.at.y : b.at.x;
                         return std::tie(ka, a.run, a.place) < std::tie(kb, b.run, b.place);
                     });
    parent_[middle] = parent;
    left_[middle] = last - first;
    low_[middle] = build(first, middle, !by_y, middle);
    high_[middle] = build(middle + 1, last, !by_y, middle);
    return middle;
}

Beginning NearestRuns::nearest(Point2 to) const {
    std::uint32_t best = kNone;
    std::int64_t best_way = INT64_MAX;
    auto visit = [&](auto&& self, std::uint32_t node, bool by_y) -> void {
        if (node == kNone || left_[node] == 0) return;
        const Beginning& b = nodes_[node];
        const std::int64_t dx = std::int64_t{b.at.x} - to.x, dy = std::int64_t{b.at.y} - to.y;
        if (!gone_[node]) {
            const std::int64_t way = dx * dx + dy * dy;
            if (way < best_way || (way == best_way &&
                                   std::tie(b.run, b.place) < std::tie(nodes_[best].run, nodes_[best].place)))
                best_way = way, best = node;
        }
        const std::int64_t across = by_y ? dy : dx;
        const bool below = across > 0;  // the place asked for lies on the low side
        self(self, below ? low_[node] : high_[node], !by_y);
        if (across * across <= best_way) self(self, below ? high_[node] : low_[node], !by_y);
    };
    visit(visit, root_, false);
    return nodes_[best];
}

void NearestRuns::remove(std::uint32_t run) {
    for (std::uint32_t k = starts_[run]; k < starts_[run + 1]; ++k) {
        const std::uint32_t node = members_[k];
        if (gone_[node]) continue;
        gone_[node] = 1;
        for (std::uint32_t up = node; up != kNone; up = parent_[up]) --left_[up];
    }
}

void NearestRuns::restore(std::uint32_t run) {
    for (std::uint32_t k = starts_[run]; k < starts_[run + 1]; ++k) {
        const std::uint32_t node = members_[k];
        if (!gone_[node]) continue;
        gone_[node] = 0;
        for (std::uint32_t up = node; up != kNone; up = parent_[up]) ++left_[up];
    }
}

std::vector<Beginning> nearest_order(std::vector<Beginning> beginnings, std::size_t runs, Point2 at) {
    NearestRuns left(std::move(beginnings), runs);
    std::vector<Beginning> order;
    while (!left.empty()) {
        const Beginning next = left.nearest(at);
        order.push_back(next);
        left.remove(next.run);
        at = next.end;
    }
    return order;
}

namespace {

double way(Point2 a, Point2 b) {
    const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
    return std::sqrt(dx * dx + dy * dy);
}

// Visits one after another, of which the last may end anywhere.
class Tour {
public:
    Tour(std::vector<Beginning> order, Point2 from) : visits_(std::move(order)), from_(from) {}

    // @returns whether something is shorter now. @param window visits that are looked at together
    bool shorten(std::size_t window) {
        bool shorter = false;
        for (std::size_t i = 0; i < visits_.size(); ++i)
            for (std::size_t j = i; j < std::min(visits_.size(), i + window); ++j)
                shorter |= turn(i, j) || (j - i < kMoved && move(i, j, window));
        return shorter;
    }
    [[nodiscard]] std::vector<Beginning> visits() && { return std::move(visits_); }

private:
    static constexpr std::size_t kMoved = 3;  // visits that are moved at once, at most
    static constexpr double kLess = 1;        // 0.1 µm

    [[nodiscard]] Point2 before(std::size_t i) const { return i == 0 ? from_ : visits_[i - 1].end; }
    [[nodiscard]] double on_to(Point2 at, std::size_t i) const {
        return i < visits_.size() ? way(at, visits_[i].at) : 0;
    }
    void reverse(std::size_t i, std::size_t j) {
        const auto first = visits_.begin() + static_cast<std::ptrdiff_t>(i),
                   last = visits_.begin() + static_cast<std::ptrdiff_t>(j) + 1;
        std::reverse(first, last);
        std::for_each(first, last, [](Beginning& b) {
            if (b.at == b.end) return;
            std::swap(b.at, b.end);
            b.place = 1 - b.place;
        });
    }

    // The visits i to j the other way round.
    bool turn(std::size_t i, std::size_t j) {
        const Point2 a = before(i), b = visits_[i].at, c = visits_[j].end;
        const double now = way(a, b) + on_to(c, j + 1), then = way(a, c) + on_to(b, j + 1);
        if (!(then < now - kLess)) return false;
        reverse(i, j);
        return true;
    }

    // The visits i to j to where the way is least longer for them, either way round.
    bool move(std::size_t i, std::size_t j, std::size_t window) {
        const Point2 a = before(i), b = visits_[i].at, c = visits_[j].end;
        const double spared = way(a, b) + on_to(c, j + 1) - on_to(a, j + 1);
        if (!(spared > kLess)) return false;
        double least = spared - kLess;
        std::size_t place = visits_.size() + 1;
        bool turned = false;
        const std::size_t low = i > window ? i - window : 0, high = std::min(visits_.size(), j + window);
        for (std::size_t k = low; k <= high; ++k) {
            if (k >= i && k <= j + 1) continue;
            const Point2 p = before(k);
            const double was = on_to(p, k), straight = way(p, b) + on_to(c, k) - was,
                         round = way(p, c) + on_to(b, k) - was;
            if (straight < least) least = straight, place = k, turned = false;
            if (round < least) least = round, place = k, turned = true;
        }
        if (place > visits_.size()) return false;
        if (turned) reverse(i, j);
        const auto at = [&](std::size_t k) { return visits_.begin() + static_cast<std::ptrdiff_t>(k); };
        if (place < i) std::rotate(at(place), at(i), at(j + 1));
        else std::rotate(at(i), at(j + 1), at(place));
        return true;
    }

    std::vector<Beginning> visits_;
    Point2 from_;
};

}  // namespace

std::vector<Beginning> shortened(std::vector<Beginning> order, Point2 from) {
    constexpr std::size_t pairs = 200'000, rounds = 20;
    const std::size_t window = std::max<std::size_t>(20, pairs / std::max<std::size_t>(1, order.size()));
    Tour tour(std::move(order), from);
    for (std::size_t round = 0; round < rounds && tour.shorten(window); ++round) {}
    return std::move(tour).visits();
}

}  // namespace slabwright
