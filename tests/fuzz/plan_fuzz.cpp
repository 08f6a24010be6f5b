// Solids and jobs made from bytes: planned, written, read back and proven; the proof passes, or the plan was
// refused by one clear error.
#include <random>
#include <string>

#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/compositions.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

/// A part of a few bodies, 20 to 60 mm.
shapes::Facets solid(fuzz::Draw& draw) {
    std::mt19937 random(draw.byte() | unsigned{draw.byte()} << 8);
    test::CompositionOptions options;
    options.most = 2 + static_cast<int>(draw.below(5));
    options.size = draw.between(20, 60);
    options.inverted = draw.below(2) == 0 ? 0 : 0.2;
    return test::Composer(random, options).facets();
}

/// A job that a shop could mean.
Job job(fuzz::Draw& draw) {
    Job job;
    job.allow_undercut = draw.below(4) != 0;
    job.bonding.accept_weak = draw.below(4) != 0;
    job.cutting.arcs = draw.below(2) == 0;
    job.machine.frame = draw.below(2) == 0 ? Frame::layer_top : Frame::pattern_base;
    job.tolerances.weld = draw.below(4) == 0 ? draw.between(0, 0.05) : 0;
    if (draw.below(2) == 0) job.slabs.margin = draw.between(0, 20);
    if (draw.below(4) == 0) job.cutting.wall_allowance = draw.between(0, 1);
    for (Tool& tool : job.tools)
        if (draw.below(4) == 0) tool.flute_length *= draw.between(0.4, 1.5);
    return job;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Draw draw(data, size);
    const shapes::Facets facets = solid(draw);
    const Job wanted = job(draw);
    static Context context({.threads = 1, .memory_bytes = std::uint64_t{2} << 30});
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, weld(context, facets));
    fuzz::expect_clear_error([&] {
        const Plan planned = plan(context, stl, wanted);
        const VerifyResult proof = write_verified(context, planned, folder / "out", stl, 0.5);
        for (const Diagnostic& v : proof.violations) fuzz::finding(v.code + " " + v.message);
        fuzz::require(proof.passed, "a plan that does not pass and does not say why");
    });
    return 0;
}
