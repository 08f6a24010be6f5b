// Keep-outs: their keys, the ways of programs around and over them, and the proof that finds what runs into
// one.
#include <gtest/gtest.h>

#include <functional>

#include "engine/job.h"
#include "io/read/job_toml.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"

namespace slabwright {
namespace {

Error error_of(const std::string& text) {
    try {
        (void)parse_job(text, "my.toml");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        EXPECT_FALSE(error.remedy().empty());
        EXPECT_EQ(error.message().find('\n'), std::string::npos);
        return error;
    }
    ADD_FAILURE() << "accepted: " << text;
    return Error(ErrorKind::usage, "", "");
}

const std::string kBolt = "[[machine.keep_out]]\nname = \"bolt\"\ncircle = [10, 20, 6]\nheight = 30\n";

TEST(KeepOutJob, KeysAreReadAndRoundTrip) {
    const Job job = parse_job("[machine]\nzero = \"corner\"\n" + kBolt +
                                  "[[machine.keep_out]]\nname = \"fence\"\nrectangle = [-50, 0, -30, 400.5]\n"
                                  "height = 60\nclearance = 2\n"
                                  "[[machine.keep_out]]\nname = \"clamp\"\npolygon = [[0, 0], [30, 0], [0, "
                                  "30.25]]\nheight = 12\nfrom = \"slab\"\n",
                              "x");
    EXPECT_EQ(job.machine.zero, WorkZero::corner);
    const std::vector<KeepOut>& k = job.machine.keep_outs;
    ASSERT_EQ(k.size(), 3u);
    EXPECT_EQ(k[0], (KeepOut{"bolt", {}, {}, {10, 20, 6}, 30, KeepOutBase::board, 5}));
    EXPECT_EQ(k[1], (KeepOut{"fence", {-50, 0, -30, 400.5}, {}, {}, 60, KeepOutBase::board, 2}));
    EXPECT_EQ(k[2], (KeepOut{"clamp", {}, {{0, 0}, {30, 0}, {0, 30.25}}, {}, 12, KeepOutBase::slab, 5}));
    const std::string text = job_toml(job);
    EXPECT_EQ(parse_job(text, "again").machine.keep_outs, k);
    EXPECT_EQ(job_toml(parse_job(text, "again")), text);
    // A job file's own list replaces that of the job it starts from; one without keeps it.
    EXPECT_EQ(parse_job(kBolt, "x", job).machine.keep_outs.size(), 1u);
    EXPECT_EQ(parse_job("[machine]\nclearance = 12\n", "x", job).machine.keep_outs.size(), 3u);
    EXPECT_TRUE(parse_job("machine.keep_out = []\n", "x", job).machine.keep_outs.empty());
    EXPECT_TRUE(parse_job("", "x").machine.keep_outs.empty());
}

TEST(KeepOutJob, FaultsAreToldWithKeyAndLine) {
    struct Case {
        std::string text, code, words, place;
    };
    const std::string head = "[[machine.keep_out]]\nname = \"a\"\nheight = 5\n";
    for (const Case& c : std::vector<Case>{
             {"[[machine.keep_out]]\ncircle = [1, 2, 3]\nheight = 5\n", "job.missing_key",
              "machine.keep_out[1].name", "my.toml"},
             {"[[machine.keep_out]]\nname = \"a\"\ncircle = [1, 2, 3]\n", "job.missing_key",
              "machine.keep_out[1].height", "my.toml"},
             {head, "job.range", "no shape", "my.toml:2"},
             {head + "circle = [1, 2, 3]\nrectangle = [0, 0, 1, 1]\n", "job.range", "more than one shape",
              "my.toml:2"},
             {kBolt + kBolt, "job.range", "machine.keep_out[1]", "my.toml:6"},
             {head + "circle = [1, 2]\n", "job.range", "has 2 numbers", "my.toml:4"},
             {head + "circle = [1, 2, 0]\n", "job.range", "out of range", "my.toml:4"},
             {head + "circle = [1, nan, 3]\n", "job.type", "finite", "my.toml:4"},
             {head + "circle = [1, inf, 3]\n", "job.type", "finite", "my.toml:4"},
             {head + "rectangle = [5, 0, 1, 1]\n", "job.range", "no area", "my.toml:4"},
             {head + "polygon = [[0, 0], [1, 1]]\n", "job.range", "has 2 points", "my.toml:4"},
             {head + "polygon = [[0, 0], [1, 1], [2, 2]]\n", "job.range", "no area", "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 9], [9, 0], [0, 8]]\n", "job.range", "meets itself",
              "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [9, 9], [9, 5], [0, 5]]\n", "job.range", "meets itself",
              "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [9, 0], [0, 9]]\n", "job.range", "twice", "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [0, 9, 1]]\n", "job.type", "points", "my.toml:4"},
             {head + "polygon = [0, 0, 9, 0]\n", "job.type", "points", "my.toml:4"},
             {head + "circle = [1, 2, 3]\nclearance = 0\n", "job.range", "clearance is 0", "my.toml:5"},
             {head + "circle = [1, 2, 3]\nfrom = \"table\"\n", "job.word", "none of board, slab",
              "my.toml:5"},
             {head + "circel = [1, 2, 3]\n", "job.unknown_key", "machine.keep_out.circel", "my.toml:4"},
             {"[machine]\nkeep_out = 3\n", "job.type", "not a list of tables", "my.toml:2"},
             {"[machine]\nkeep_outs = 3\n", "job.unknown_key", "machine.keep_outs", "my.toml:2"},
             {"[[machine.keep_out]]\nname = \"a\"\nheight = -2\ncircle = [1, 2, 3]\n", "job.range",
              "height is -2", "my.toml:3"}}) {
        const Error error = error_of(c.text);
        EXPECT_EQ(error.code(), c.code) << c.text << error.what();
        EXPECT_NE(error.message().find(c.words), std::string::npos) << c.text << error.what();
        EXPECT_EQ(error.place().substr(0, c.place.size()), c.place) << c.text << error.what();
    }
}

}  // namespace
}  // namespace slabwright
