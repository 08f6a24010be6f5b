// Whether a pattern that was read is the one that a plan was made of.
#include <gtest/gtest.h>

#include "io/read/pattern.h"

namespace slabwright {
namespace {

TEST(PlannedPattern, IsOfTheSameBytesReadAlikeWithTheSameSupportsAndHoles) {
    const std::vector<Support> supports{{1, 10, 20, 8, 0, 18}};
    const DrillRule drills{{6, 8}, 0.05};
    const PlannedPattern planned{"part.stl", "a5", {.weld_mm = 0.001}, supports, drills};
    const auto pattern = [&](const std::vector<Support>& with, const DrillRule& rounded) {
        Pattern p{"part.stl", {.weld_mm = 0.001}, {}, {}, with, rounded};
        p.read.input.sha256 = "a5";
        return p;
    };
    EXPECT_TRUE(pattern(supports, drills).is(planned));
    EXPECT_TRUE(pattern({}, {}).is(planned)) << "neither is there yet";
    EXPECT_FALSE(pattern(supports, {}).is(planned));
    EXPECT_FALSE(pattern({}, drills).is(planned));
    EXPECT_FALSE(pattern(supports, {{6, 8.5}, 0.05}).is(planned));
    EXPECT_FALSE(pattern({{1, 10, 20, 8, 0, 19}}, drills).is(planned));
    Pattern other = pattern(supports, drills);
    other.read.input.sha256 = "a6";
    EXPECT_FALSE(other.is(planned));
    other = pattern(supports, drills);
    other.reading.weld_mm = 0;
    EXPECT_FALSE(other.is(planned));
}

}  // namespace
}  // namespace slabwright
