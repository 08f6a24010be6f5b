#include "engine/moves/order.h"

#include <algorithm>
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

}  // namespace slabwright
