// What stands along the sharp edges of patterns, planned without and with cutting.edges, and what that takes.
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

void print_errors(const char* words, const std::vector<test::EdgeProbe>& probes) {
    for (const bool convex : {true, false}) {
        const test::EdgeErrors e = test::edge_errors(probes, convex);
        std::printf(
            "  %-8s %-8s %7zu points, over .02 mm %zu, mean %.4f, 95 %% under %.4f, worst %.3f mm at %.2f "
            "%.2f %.2f; "
            "over 1 mm %zu\n",
            words, convex ? "convex" : "concave", e.points, e.seen, e.mean, e.p95, e.worst, e.worst_at[0],
            e.worst_at[1], e.worst_at[2], e.beyond);
    }
}

void compare(const std::string& stl, Job job) {
    Context context;
    std::printf("%s\n", std::filesystem::path(stl).stem().c_str());
    for (const bool edges : {false, true}) {
        job.cutting.edges = edges;
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        const Plan made = plan(context, *pattern, job);
        std::vector<test::EdgeProbe> probes =
            test::edge_probes(context, pattern->read.mesh.view(), job.cutting.edge_angle_deg);
        test::cut_probes(made, probes);
        const char* const words = edges ? "with" : "without";
        print_errors(words, probes);
        double minutes = 0;
        std::size_t count = 0;
        for (const Layer& layer : made.layers)
            for (const Operation& op : layer.operations)
                if (op.kind == OperationKind::edge) minutes += op.minutes, ++count;
        const support::TemporaryFolder folder;
        const std::string out = folder / "out";
        write(context, made, out);
        const VerifyResult proof = verify(context, out, stl, {}, 0);
        std::printf("  %-8s cutting %.1f min, of that %.1f in %zu edge operations; %zu violations\n", words,
                    made.totals.cutting_minutes, minutes, count, proof.violations.size());
        for (const Diagnostic& v : proof.violations)
            std::printf("    %s: %s\n", v.code.c_str(), v.message.c_str());
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
    for (int i = first; i < argc; ++i) {
        try {
            compare(argv[i], job);
        } catch (const Error& error) {
            std::printf("  refused: %s %s\n", error.code().c_str(), error.message().c_str());
        }
    }
}
