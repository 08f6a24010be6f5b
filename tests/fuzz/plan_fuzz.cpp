// Solids and jobs made from bytes: planned, proven and written as `slabwright plan` does it. The proof
// passes, or the plan is refused by clear errors; what was written, verify() judges alike.
#include <memory>
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
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, wanted);
        Plan planned = plan(context, *pattern, wanted);
        constexpr double cell_mm = 0.5;
        const VerifyResult proven = write_proven(context, planned, folder / "out", pattern, false, cell_mm);
        if (!proven.written) {
            fuzz::require(!proven.refusals.empty(), "a plan that is refused and does not say why");
            throw proven.refusals.front();
        }
        const VerifyResult judged = verify(context, folder / "out", stl, {}, cell_mm);
        for (const Diagnostic& v : judged.violations) fuzz::finding(v.code + " " + v.message);
        fuzz::require(proven.passed && judged.passed, "a plan that does not pass and does not say why");
    });
    return 0;
}
