// The loop from a proof back into the plan of a slab that is milled on both sides: what is wrong in the
// programs of an underside is mended in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/schedule/schedule.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tunnels.h"

namespace slabwright {
namespace {

TEST(MendUndersides, GougesOfAnUndersideAreRaised) {
    const support::TemporaryFolder folder;
    Context context;
    // A block with a tunnel of radius 8 along y, the lower half of which is milled from below.
    write_stl(folder / "tunnel.stl",
              weld(context, support::block_with_tunnels({0, 0, 0}, {50, 30, 18}, {{25, 9, 8}})));
    Job job;
    job.layers.sides = SlabSides::two;
    job.dowels.per_joint = 2;
    Tool drill = job.tools[1];
    drill.number = 11;
    drill.kind = ToolKind::drill;
    drill.name = "drill 8 mm";
    drill.diameter = drill.shank_diameter = 8;
    drill.flute_length = 45;
    drill.stickout = 60;
    drill.plunge_feed = 600;
    drill.plunges = true;
    job.tools.push_back(drill);
    const std::shared_ptr<Pattern> pattern = read_pattern(context, folder / "tunnel.stl", job);
    Plan made = plan(context, *pattern, job);
    ASSERT_EQ(made.undersides.size(), 1U);
    std::vector<Operation>& operations = made.undersides[0].layers[0].operations;
    const auto finish = std::find_if(operations.begin(), operations.end(), [](const Operation& op) {
        return op.kind == OperationKind::finish && op.moves.size() > 60;
    });
    ASSERT_NE(finish, operations.end());
    std::size_t lowered = 0;
    for (std::size_t k = finish->moves.size() / 3; k + 1 < finish->moves.size() && lowered < 12; ++k)
        if (finish->moves[k].feed != 0 && finish->moves[k - 1].feed != 0 && !finish->moves[k].is_arc() &&
            !finish->moves[k + 1].is_arc())
            finish->moves[k].z -= to_units(0.5), ++lowered;
    ASSERT_GT(lowered, 0U);
    schedule(made.undersides[0]);
    schedule(made);
    const VerifyResult proven = write_proven(context, made, folder / "out", pattern);
    for (const Diagnostic& d : proven.violations) ADD_FAILURE() << d.code << ": " << d.message;
    EXPECT_TRUE(proven.passed);
    EXPECT_EQ(made.undersides[0].layers[0].rounds, 1);
    const std::vector<Diagnostic>& told = made.undersides[0].diagnostics;
    EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const Diagnostic& d) {
        return d.code == "proof.round" && d.message.find("gouge.cutter") != std::string::npos;
    }));
}

}  // namespace
}  // namespace slabwright
