// What stands along the sharp edges of patterns, planned without and with cutting.edges, and what that takes:
// two Markdown rows a part. Points at which over a millimetre stands, where no tool of the plan reaches, do
// not count.
//     build/release/edges_bench [--tools LIBRARY] PART.stl...
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/tools/libraries.h"
#include "io/read/pattern.h"
#include "io/slabwright.h"
#include "kernels/errors.h"
#include "tests/support/edge_error.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

void print_errors(const std::vector<test::EdgeProbe>& probes, bool convex) {
    const test::EdgeErrors e = test::edge_errors(probes, convex);
    std::printf(" %zu | %zu | %.4f | %.3f | %.3f |", e.points, e.seen, e.mean, e.p95, e.worst);
}

void compare(const std::string& stl, Job job) {
    Context context;
    for (const bool edges : {false, true}) {
        job.cutting.edges = edges;
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        Plan made = plan(context, *pattern, job);
        const support::TemporaryFolder folder;
        const VerifyResult proof = write_proven(context, made, folder / "out", pattern, true);
        std::vector<test::EdgeProbe> probes =
            test::edge_probes(context, pattern->read.mesh.view(), job.cutting.edge_angle_deg);
        test::cut_probes(made, probes);
        double minutes = 0;
        std::size_t count = 0;
        for (const Layer& layer : made.layers)
            for (const Operation& op : layer.operations)
                if (op.kind == OperationKind::edge) minutes += op.minutes, ++count;
        std::printf("| %s | %s |", std::filesystem::path(stl).stem().c_str(), edges ? "with" : "without");
        for (const bool convex : {true, false}) print_errors(probes, convex);
        std::printf(" %.1f | %.1f | %zu | %s |\n", made.totals.cutting_minutes, minutes, count,
                    proof.violations.empty() ? "pass" : "fails");
        for (const Diagnostic& v : proof.violations)
            std::fprintf(stderr, "%s: %s\n", v.code.c_str(), v.message.c_str());
        std::fflush(stdout);
    }
}

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    using namespace slabwright;
    Job job;
    job.cutting.arcs = false;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    int first = 1;
    if (argc > 2 && std::string_view(argv[1]) == "--tools") {
        const auto library = named_library(argv[2]);
        if (!library) {
            std::fprintf(stderr, "edges_bench: there is no tool library %s\n", argv[2]);
            return 2;
        }
        job.tools = *library;
        first = 3;
    }
    std::puts(
        "| part | edges followed | convex: points | over .02 mm | mean, mm | 95 % under | worst | concave: "
        "points | "
        "over .02 mm | mean, mm | 95 % under | worst | cutting, min | along edges | operations | proof |");
    std::puts("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (int i = first; i < argc; ++i) {
        try {
            compare(argv[i], job);
        } catch (const Error& error) {
            std::fprintf(stderr, "%s: %s %s\n", argv[i], error.code().c_str(), error.message().c_str());
        }
    }
}
