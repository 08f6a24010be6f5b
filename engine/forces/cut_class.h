// Cuts by classes: most of a layer's cuts are alike but for rounding (METHOD.md section 8).
#pragma once

#include <bit>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "engine/job.h"
#include "engine/stock/cut_stretches.h"
#include "kernels/forces/forces.h"

namespace slabwright {

inline constexpr double kLeastDepth = 0.01;  ///< mm: shallower cuts are taken as this deep
/// By how much a cut of a fine class may bear less than its class, as a share.
inline constexpr double kFineRounding = 0.01;

/// Classes to a doubling of the depth, of the diameter, and of the radius.
struct ClassSteps {
    int depth, width, low;
};
inline constexpr ClassSteps kCoarse{8, 24, 16};   // by which feeds are chosen
inline constexpr ClassSteps kFine{64, 240, 128};  // by which forces are stated: within 1 % of the cut's own

/// A cut's class: what its forces depend on but the feed.
struct CutClass {
    std::int16_t low = 0, depth = 0, width = 0;
    bool left = false;
    friend bool operator==(const CutClass&, const CutClass&) = default;
};

/// What is known of classes at a feed, mm/min.
struct ClassAndFeed {
    CutClass of;
    double feed = 0;
    friend bool operator==(const ClassAndFeed&, const ClassAndFeed&) = default;
};
struct HashClassAndFeed {
    std::size_t operator()(const ClassAndFeed& key) const {
        const auto word = [](std::int16_t v) { return std::uint64_t{static_cast<std::uint16_t>(v)}; };
        std::uint64_t h = word(key.of.low) | word(key.of.depth) << 16U | word(key.of.width) << 32U |
                          std::uint64_t{key.of.left} << 48U;
        h = (h ^ h >> 29U) * 0x9E3779B97F4A7C15U + std::bit_cast<std::uint64_t>(key.feed);
        return (h ^ h >> 32U) * 0xD6E8FEB86659FD93U >> 16U;
    }
};
template <class T>
using ByClassAndFeed = std::unordered_map<ClassAndFeed, T, HashClassAndFeed>;

/// The class of a stretch of a tool's way: depth and width are rounded up.
[[nodiscard]] CutClass class_of(const CutStretch& stretch, const Tool& tool, ClassSteps steps);

/// One of so many equal passes of a class.
[[nodiscard]] CutClass shallower(CutClass c, int passes, ClassSteps steps);

/// The cut that a class stands for. @param idle of the tool (idle_cut). @param feed mm/min
[[nodiscard]] CutSegment segment_of(const CutClass& c, const CutSegment& idle, const Tool& tool, double feed,
                                    ClassSteps steps);

}  // namespace slabwright
