// The proof of sheets on a program written by hand: a box of 20 mm cut from one sheet by a router.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "engine/sheet_proof/sheet_proof.h"
#include "io/posts/sheet_reader.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/sheet_proofs.h"

namespace slabwright {
namespace {

const std::string kBox =
    "(stock 300 x 200 thickness 6 kerf 6 router)\n"
    "(piece 1 from 0 to 6 turn 0 at 20 20)\n"
    "G21 G17 G90 G94 G40 G49 G80\n"
    "G64 P0.005\n"
    "G54\n"
    "T1 M6\n"
    "G43 H1\n"
    "M3 S18000\n"
    "G4 P3\n"
    "(cut of piece 1 loop 0 pass 0 outline)\n"
    "G0 Z5\n"
    "G0 X12 Y12\n"
    "G1 Z-6.2 F800\n"
    "X17 Y17 F3000\n"
    "X43\n"
    "Y43\n"
    "X17\n"
    "Y17\n"
    "G0 Z5\n"
    "M2\n";

class SheetProofs : public testing::Test {
protected:
    /// The codes of what is found after one change of the program.
    std::set<std::string> found(const std::string& from, const std::string& to,
                                const SheetProofRules& rules = {}) {
        std::string text = kBox;
        const std::size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        if (at != std::string::npos) text.replace(at, from.size(), to);
        const SheetProof proof =
            prove_sheets(context_, mesh_.view(), {read_sheet_program(text, "sheet_1.ngc")}, rules);
        std::set<std::string> codes;
        for (const Diagnostic& d : proof.violations) codes.insert(d.code);
        EXPECT_EQ(proof.passed, codes.empty());
        return codes;
    }

private:
    Context context_;
    Mesh mesh_ = weld(context_, shapes::box({0, 0, 0}, {20, 20, 6}));
};

using Codes = std::set<std::string>;

TEST_F(SheetProofs, AGoodProgramPasses) {
    EXPECT_EQ(found("", ""), Codes{});
    SheetProofRules strict;
    strict.left_over = 0.01;
    EXPECT_EQ(found("", "", strict), Codes{});
}

TEST_F(SheetProofs, WaysThatDoNotCloseAreTold) {
    EXPECT_TRUE(found("X17\nY17\n", "X17\nY17.1\n").contains("sheets.open_way"));
    EXPECT_EQ(found("X17\nY17\n", "X17\nY17.001\n"), Codes{}) << "within the text's digits";
    EXPECT_TRUE(found("Y43\nX17\nY17\n", "").contains("sheets.open_way")) << "a line is no way around";
}

TEST_F(SheetProofs, WhatIsLeftIsToldWhereItIsAskedFor) {
    SheetProofRules strict;
    strict.left_over = 0.5;
    EXPECT_EQ(found("X43", "X44", strict), Codes{"sheets.left_over"});
    EXPECT_EQ(found("X43", "X43.4", strict), Codes{});
    EXPECT_EQ(found("X43", "X44"), Codes{}) << "and else not";
}

TEST_F(SheetProofs, WhatIsCutIntoOrAwayIsTold) {
    EXPECT_TRUE(found("X43", "X42.9").contains("sheets.gouge"));
    EXPECT_TRUE(found("kerf 6", "kerf 60").contains("sheets.nothing"));
    EXPECT_TRUE(found("cut of piece 1", "cut of piece 2").contains("sheets.piece"));
    EXPECT_TRUE(found("300 x 200", "45 x 200").contains("sheets.leaves_stock"));
}

TEST_F(SheetProofs, CutsGoThrough) {
    EXPECT_EQ(found("Z-6.2", "Z-6"), Codes{});
    EXPECT_EQ(found("Z-6.2", "Z-5.999"), Codes{}) << "within the text's digits";
    EXPECT_EQ(found("Z-6.2", "Z-5.9"), Codes{"sheets.depth"}) << "a skin is left, thinner than is looked at";
    EXPECT_TRUE(found("Z-6.2", "Z-3").contains("sheets.depth"));
}

// Whatever one line of a program is missing, the rest is refused, is found fault with, or does the same.
TEST(SheetProofsOfPlans, EveryLineLostIsToldOrDoesNothing) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {20, 20, 12}));
    for (const SheetHead head : {SheetHead::router, SheetHead::laser, SheetHead::jet}) {
        SheetJob job;
        job.head = head;
        job.slicing.thicknesses = {6};
        job.cutting.kerf = head == SheetHead::router ? 6 : 0.8;
        const std::string text = support::texts_of(plan_sheets(context, mesh, job)).at(0);
        ASSERT_TRUE(support::proof_of(context, mesh, {text}).passed);
        std::string passes;
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = text.find('\n', at) + 1;
            const std::string line = text.substr(at, end - at);
            try {
                // A place that lies on a straight line, or all but on it, does nothing.
                if (support::proof_of(context, mesh, {text.substr(0, at) + text.substr(end)}).passed &&
                    line[0] != 'X')
                    passes += line;
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::verification) << error.what();
            }
            at = end;
        }
        // A plunge from higher up is only slower, M2 stops the spindle too, and a head may end where it is.
        EXPECT_EQ(passes, head == SheetHead::router
                              ? "(slabwright sheets: program 1 of 1)\nG0 Z1\nG0 Z1\nM5\n"
                              : "(slabwright sheets: program 1 of 1)\nG0 Z5\n")
            << text.substr(0, 900);
    }
}

}  // namespace
}  // namespace slabwright
