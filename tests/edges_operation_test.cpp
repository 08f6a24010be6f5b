// Sharp edges followed by an operation of their own: what stands along them before and after, by the moves
// alone, and the proof.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "engine/tools/libraries.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "tests/support/edge_error.h"
#include "tests/support/files.h"
#include "tests/support/height_field.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

/// A roof whose ridge and valleys fall along y. Lines that cross them touch them at single points.
Mesh ridge_and_valleys(Context& context) {
    return test::height_field(context, 20, 4, [](double x, double y) {
        constexpr double kRidge = 14, kFall = 0.05, kSlope = 0.4, kValley = 20;
        const double across = std::abs(x);
        return kRidge - kFall * y - kSlope * (across < kValley ? across : 2 * kValley - across);
    });
}

Job job_with(bool edges) {
    Job job;
    job.cutting.arcs = false;
    job.cutting.edges = edges;
    job.selection.mode = SelectionMode::fixed;
    return job;
}

std::vector<const Operation*> edge_operations(const Plan& plan) {
    std::vector<const Operation*> found;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations)
            if (op.kind == OperationKind::edge) found.push_back(&op);
    return found;
}

TEST(EdgesOperation, LeavesLessAlongRidgesAndIsProven) {
    Context context;
    const support::TemporaryFolder folder;
    const Mesh mesh = ridge_and_valleys(context);
    const std::string stl = folder / "roof.stl";
    write_stl(stl, mesh);
    std::array<test::EdgeErrors, 2> convex, concave;
    for (const bool edges : {false, true}) {
        const Plan made = plan(context, stl, job_with(edges));
        EXPECT_EQ(edge_operations(made).empty(), !edges);
        std::vector<test::EdgeProbe> probes = test::edge_probes(context, mesh.view(), 30);
        std::erase_if(probes, [](const test::EdgeProbe& p) {
            return std::max(std::abs(p.x), std::abs(p.y)) > 38;  // those of the sides are no ridges
        });
        ASSERT_GT(probes.size(), 100u);
        test::cut_probes(made, probes);
        convex[edges] = test::edge_errors(probes, true);
        concave[edges] = test::edge_errors(probes, false);
        const std::string out = folder / (edges ? "with" : "without");
        write(context, made, out);
        EXPECT_EQ(support::schema_complaint(support::slurp(out + "/plan.json"),
                                            support::checkout("io/plan.schema.json")),
                  "");
        for (const Diagnostic& v : verify(context, out, stl, {}, 1).violations)
            ADD_FAILURE() << v.code << ' ' << v.message;
    }
    for (const auto& [words, e] : {std::pair{"convex", &convex}, {"concave", &concave}})
        std::printf("%s: mean %.4f, worst %.4f mm; followed: mean %.4f, worst %.4f mm\n", words, (*e)[0].mean,
                    (*e)[0].worst, (*e)[1].mean, (*e)[1].worst);
    EXPECT_GT(convex[0].mean, 0.003);
    EXPECT_LT(convex[1].mean, 0.3 * convex[0].mean);
    EXPECT_LT(convex[1].worst, 0.02);
    EXPECT_LT(concave[1].mean, concave[0].mean);
    EXPECT_GT(convex[1].least, -0.0101) << "nothing is gouged";
}

// A valley of 136 degrees keeps a ball's radius; the point of a cone of 90 goes to its bottom.
TEST(EdgesOperation, AConeRunsAlongConcaveEdges) {
    Context context;
    const support::TemporaryFolder folder;
    const Mesh mesh = ridge_and_valleys(context);
    const std::string stl = folder / "roof.stl", out = folder / "out";
    write_stl(stl, mesh);
    Job job = job_with(true);
    job.tools = forms_library();
    const Plan made = plan(context, stl, job);
    const std::vector<const Operation*> edges = edge_operations(made);
    EXPECT_TRUE(std::any_of(edges.begin(), edges.end(), [](const Operation* op) { return op->tool == 7; }));
    // The finishing ball touches a ridge as well as the tapered one does, which has to be changed for.
    EXPECT_TRUE(std::any_of(edges.begin(), edges.end(), [](const Operation* op) { return op->tool == 3; }));
    std::vector<test::EdgeProbe> probes = test::edge_probes(context, mesh.view(), 30);
    std::erase_if(probes,
                  [](const test::EdgeProbe& p) { return std::max(std::abs(p.x), std::abs(p.y)) > 38; });
    test::cut_probes(made, probes);
    const test::EdgeErrors concave = test::edge_errors(probes, false);
    std::printf("concave: mean %.4f, worst %.4f mm\n", concave.mean, concave.worst);
    EXPECT_LT(concave.mean, 0.02);
    EXPECT_GT(concave.least, -0.0101) << "nothing is gouged";
    write(context, made, out);
    for (const Diagnostic& v : verify(context, out, stl, {}, 1).violations)
        ADD_FAILURE() << v.code << ' ' << v.message;
}

TEST(EdgesOperation, IsTheSameOnAnyNumberOfThreads) {
    const auto moves = [](int threads) {
        Context context({.threads = threads});
        const support::TemporaryFolder folder;
        const std::string stl = folder / "roof.stl";
        write_stl(stl, ridge_and_valleys(context));
        std::vector<Move> all;
        const Plan made = plan(context, stl, job_with(true));
        for (const Operation* op : edge_operations(made))
            all.insert(all.end(), op->moves.begin(), op->moves.end());
        return all;
    };
    const std::vector<Move> one = moves(1);
    EXPECT_GT(one.size(), 20u);
    EXPECT_EQ(one, moves(2));
}

}  // namespace
}  // namespace slabwright
