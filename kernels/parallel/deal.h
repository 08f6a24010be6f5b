// Many items dealt into parts, as a dealer does cards: what belongs together lies together then, in a piece
// of memory that fits a cache.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

/// Deals the items of n sources, [begin, end) in chunks of `grain`, into parts. Within a part items keep
/// their order. To bound memory the parts may be dealt in rounds, as many in one as there is room for.
/// @param count(begin, end, take) calls take(part) for every item of these sources, once @param items(begin,
/// end, take) calls take(part, item) for the same items in the same order, once a round @param room(total,
/// largest) what memory there is, a pointer to the first item and how many it holds: as many as the largest
/// part has, or more @param done(first, last, starts) after every round: parts [first, last) lie in the
/// memory, part first + i at [starts[i], starts[i + 1])
template <class Count, class Items, class Room, class Done>
void deal(Context& context, std::size_t n, std::size_t grain, std::size_t parts, Count&& count, Items&& items,
          Room&& room, Done&& done) {
    const std::size_t chunks = (n + grain - 1) / grain;
    std::vector<std::uint32_t> next(chunks * parts,
                                    0);  // how many of a chunk go to a part, then where they go
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t* const counts = &next[begin / grain * parts];
        count(begin, end, [&](std::size_t part) { ++counts[part]; });
    });
    std::vector<std::uint64_t> sizes(parts, 0);
    std::uint64_t total = 0, largest = 0;
    for (std::size_t part = 0; part < parts; ++part) {
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) sizes[part] += next[chunk * parts + part];
        total += sizes[part];
        largest = std::max(largest, sizes[part]);
    }
    const auto [memory, most] = room(total, largest);
    std::vector<std::uint32_t> starts;
    for (std::size_t first = 0, last = 0; first < parts; first = last) {
        starts.assign(1, 0);
        while (last < parts && starts.back() + sizes[last] <= most) {
            std::uint32_t at = starts.back();
            for (std::size_t chunk = 0; chunk < chunks; ++chunk)
                at += std::exchange(next[chunk * parts + last], at);
            starts.push_back(at);
            ++last;
        }
        if (starts.back() == 0) continue;
        parallel_for(context, n, grain, [&, to = memory](std::size_t begin, std::size_t end) {
            std::uint32_t* const place = &next[begin / grain * parts];
            items(begin, end, [&](std::size_t part, const auto& item) {
                if (part - first >= last - first) return;
                auto* const at = to + place[part]++;
                // The parts are many: a part's next line is not at hand when it is written to, and all wait
                // for one another.
                __builtin_prefetch(reinterpret_cast<const char*>(at) + 128, 1);
                *at = item;
            });
        });
        done(first, last, std::span<const std::uint32_t>(starts));
    }
}

}  // namespace slabwright
