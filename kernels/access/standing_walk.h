// The ways through the tree of a StandingPart. Internal to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "kernels/access/near_facets.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// Nodes or facets of a node of the tree.
inline constexpr std::size_t kFan = 8;

/// Asks for what is looked at soon.
template <class T>
void expect(const T& what) {
    for (std::size_t byte = 0; byte < sizeof(T); byte += 64)
        __builtin_prefetch(static_cast<const char*>(static_cast<const void*>(&what)) + byte);
}

/// Visits, in the order of the tree, the facets [first, last) of every node whose bit is 1 in what
/// choose(eights, kept) says of up to eight times eight nodes of one level at a time: looking at them costs
/// little more than calling for it.
template <class Choose, class Visit>
void StandingPart::walk_leaves(Choose&& choose, Visit&& visit) const {
    if (facets_.empty()) return;
    struct Waiting {  // eights of a level, ascending: all that the last look at the level above has kept
        std::size_t next, end;
        std::array<std::uint32_t, ManyNodes::kMost * kFan> eights;
    };
    constexpr std::size_t levels = 12;  // of 2³² facets: 11
    std::array<Waiting, levels> waiting;
    ManyNodes many;
    std::array<unsigned, ManyNodes::kMost> kept;
    std::size_t level = levels_.size() - 1;
    waiting[level].next = 0;
    waiting[level].end = 1;
    waiting[level].eights[0] = 0;
    while (level < levels_.size()) {
        Waiting& here = waiting[level];
        if (here.next == here.end) {
            ++level;
            continue;
        }
        const std::uint32_t* const eights = here.eights.data() + here.next;
        many.count = std::min(here.end - here.next, ManyNodes::kMost);
        here.next += many.count;
        for (std::size_t i = 0; i < many.count; ++i) many.eights[i] = &levels_[level][eights[i]];
        choose(many, kept);
        if (level == 0) {
            for (std::size_t i = 0; i < many.count; ++i)
                for_each_bit(kept[i], [&](std::size_t k) {
                    const std::size_t first = (eights[i] * kFan + k) * kFan;
                    visit(first, std::min(facets_.size(), first + kFan));
                });
            continue;
        }
        Waiting& below = waiting[--level];
        below.next = below.end = 0;
        for (std::size_t i = 0; i < many.count; ++i)
            for_each_bit(kept[i], [&](std::size_t k) {
                const std::size_t eight = eights[i] * kFan + k;
                expect(levels_[level][eight]);
                below.eights[below.end++] = static_cast<std::uint32_t>(eight);
            });
    }
}

/// The same of every node whose box enter() holds for.
template <class Enter, class Visit>
void StandingPart::walk(Enter&& enter, Visit&& visit) const {
    walk_leaves(
        [&](const ManyNodes& many, auto& kept) {
            for (std::size_t i = 0; i < many.count; ++i) {
                const Nodes& nodes = *many.eights[i];
                kept[i] = 0;
                for (unsigned k = 0; k < kFan; ++k)
                    kept[i] |= static_cast<unsigned>(nodes.x0[k] <= nodes.x1[k] && enter(nodes[k])) << k;
            }
        },
        [&](std::size_t first, std::size_t last) {
            for (std::size_t f = first; f < last; ++f) visit(facets_[f]);
        });
}

/// The same of every node whose box has something in common with this.
template <class Visit>
void StandingPart::walk_within(const Within& box, Visit&& visit) const {
    walk_leaves([&](const ManyNodes& many, auto& kept) { overlapping(many, box, kept.data()); },
                [&](std::size_t first, std::size_t last) {
                    for (std::size_t f = first; f < last; ++f) visit(facets_[f]);
                });
}

/// Visits the facets, and which they are, whose box is nearer than limit(), a square, the nearer of sibling
/// nodes first, so that the limit falls early. Ties keep the order of the tree.
template <class Limit, class Visit>
void StandingPart::walk_nearest(const Away& from, Limit&& limit, Visit&& visit) const {
    struct Item {
        std::uint32_t level;
        std::size_t index;
        double d;
    };
    std::array<Item, 128> stack;
    std::array<double, 8> d;
    std::size_t size = 0;
    if (facets_.empty()) return;
    const auto push = [&](std::uint32_t level, std::size_t eight) {
        squares(levels_[level][eight], from, d);  // infinite where there is no node
        const std::size_t first = size;
        const double most = limit();
        for (std::size_t k = kFan; k-- > 0;) {
            if (!(d[k] < most)) continue;
            std::size_t at = size++;
            for (; at > first && stack[at - 1].d < d[k]; --at) stack[at] = stack[at - 1];
            stack[at] = {level, eight * kFan + k, d[k]};
        }
    };
    push(static_cast<std::uint32_t>(levels_.size() - 1), 0);
    while (size > 0) {
        const Item item = stack[--size];
        if (!(item.d < limit())) continue;
        if (item.level > 0) {
            push(item.level - 1, item.index);
            continue;
        }
        Nodes around;
        boxes(facets_.eight(item.index), around);
        squares(around, from, d);
        for (std::size_t first = item.index * kFan, k = 0; first + k < std::min(facets_.size(), first + kFan);
             ++k)
            if (d[k] < limit()) visit(facets_[first + k], static_cast<std::uint32_t>(first + k));
    }
}

}  // namespace slabwright
