#include "kernels/geometry/cutter_shape.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "engine/job.h"
#include "kernels/access/standing_part.h"
#include "kernels/cutting/tool_shape.h"
#include "kernels/errors.h"
#include "kernels/forces/forces.h"
#include "kernels/mesh/weld.h"
#include "kernels/stock/sweep.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

constexpr CutterShape kFlat{6, 0, 0}, kBall{6, 6, 0}, kBullNose{6, 1.5, 0}, kTapered{6, 1, 0.1},
    kCone{6, 0, 1};

TEST(CutterShape, FormFollowsFromRadiusCornerAndTaper) {
    EXPECT_EQ(kFlat.form(), CutterForm::flat);
    EXPECT_EQ(kBall.form(), CutterForm::ball);
    EXPECT_EQ(kBullNose.form(), CutterForm::bull_nose);
    EXPECT_EQ(kTapered.form(), CutterForm::tapered_ball);
    EXPECT_EQ(kCone.form(), CutterForm::cone);
}

TEST(CutterShape, KernelsTakeWhatTheyCanCutWithAndRefuseTheRest) {
    EXPECT_EQ(cutter_end(kFlat).form, CutterEnd::Form::flat);
    EXPECT_EQ(cutter_end(kBall).form, CutterEnd::Form::ball);
    EXPECT_EQ(cutter_end(kCone).form, CutterEnd::Form::cone);
    EXPECT_EQ(cutter_end(kBullNose).form, CutterEnd::Form::other);
    EXPECT_EQ(cutter_end(kTapered).form, CutterEnd::Form::other);
    EXPECT_TRUE(segment_of(kFlat).flat() && !segment_of(kFlat).ball());
    EXPECT_TRUE(segment_of(kBall).ball() && !segment_of(kBall).flat());
    EXPECT_FALSE(segment_of(kBullNose).flat() || segment_of(kBullNose).ball());
    for (const CutterShape& shape : {kTapered, kCone})
        EXPECT_TRUE(segment_of(shape).tapers() && !segment_of(shape).flat() && !segment_of(shape).ball());
    EXPECT_NO_THROW(check_tool_shape({.cutter = kTapered}));
    EXPECT_THROW(check_tool_shape({.cutter = kCone}), Error);
    Context context;
    const StandingPart part(context, weld(context, shapes::box({0, 0, 0}, {20, 20, 9})).view());
    // Its tip a millimetre under the top of a block wider than itself: as deep as that, a cone by less.
    EXPECT_NEAR(part.depth(kCone, 9, {10, 10, 8}, {11, 10, 8}, 0).depth,
                std::sin(1.0) * (1 - StandingPart::kSheet), 1e-6);
    for (const CutterShape& shape : {kFlat, kBall, kBullNose, kTapered})
        EXPECT_NEAR(part.depth(shape, 9, {10, 10, 8}, {11, 10, 8}, 0).depth, 1 - StandingPart::kSheet, 1e-6);
}

// The height of a cutter's end over its tip, as each kernel has it, is one.
TEST(CutterShape, KernelsAgreeOnTheUnderSide) {
    for (const CutterShape& shape : {kFlat, kBall}) {
        const ToolShape tool{.cutter = shape, .shank_radius = shape.radius};
        const Envelope under = envelopes(tool).front();
        for (const double r : {0.0, 1.0, 3.0, 5.5}) {
            const double expected = shape.form() == CutterForm::ball
                                        ? shape.radius - std::sqrt(shape.radius * shape.radius - r * r)
                                        : 0;
            EXPECT_NEAR(under.height(r), expected, 1e-12);
        }
    }
    EXPECT_NEAR(cutter_end(kCone).slope, 1 / std::tan(1.0), 1e-12);
}

TEST(CutterShape, OfTheToolsOfAJob) {
    Tool tool;
    tool.diameter = 12;
    const auto form_of = [&](ToolKind kind) {
        tool.kind = kind;
        return cutter_shape(tool).form();
    };
    EXPECT_EQ(form_of(ToolKind::flat), CutterForm::flat);
    EXPECT_EQ(form_of(ToolKind::face), CutterForm::flat);
    EXPECT_EQ(form_of(ToolKind::ball), CutterForm::ball);
    EXPECT_EQ(form_of(ToolKind::drill), CutterForm::cone);
    EXPECT_EQ(cutter_shape(tool).radius, 6);
    // A point of 118°.
    EXPECT_NEAR(cutter_end(cutter_shape(tool)).slope, std::tan(31 * std::numbers::pi / 180), 1e-12);
    for (const ToolKind kind : {ToolKind::flat, ToolKind::ball})
        EXPECT_TRUE(is_end_mill(kind) && mills(kind));
    EXPECT_TRUE(mills(ToolKind::face) && !is_end_mill(ToolKind::face));
    EXPECT_FALSE(mills(ToolKind::drill) || is_end_mill(ToolKind::drill));
}

}  // namespace
