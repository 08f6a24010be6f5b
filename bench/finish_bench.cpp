// FINISH's benchmark (its chapter 4, table 1): a part with freeform surfaces, sharp edges and holes, milled
// in its way, by an adaptive raster, along sharp edges and with drills, and by a raster of one step-over.
// Prints the table, as Markdown.
//     build/release/finish_bench [PART.stl]      writes the part where that is said
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "engine/tools/libraries.h"
#include "io/read/pattern.h"
#include "io/slabwright.h"
#include "kernels/errors.h"
#include "kernels/geometry/units.h"
#include "tests/data/models.h"
#include "tests/support/edge_error.h"
#include "tests/support/files.h"
#include "tests/support/finish_part.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using test::EdgeProbe;

constexpr double kFromEdges = 4, kOut = 0.02;  // mm
constexpr double kCusp = 0.0015 * kInch;       // what the paper's second part had

/// Points of the facets whose normal's upward part lies between, drawn evenly and moved out by `out`, mm,
/// that lie further than `from_edges` from sharp edges in plan: those see what is beside them too.
std::vector<EdgeProbe> probes_of(MeshView mesh, const std::array<double, 2>& nz, double out,
                                 const std::vector<EdgeProbe>& edges, double from_edges) {
    constexpr double kPerMm2 = 4;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<EdgeProbe> probes;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
        const Vec3d area = area_normal(mesh, f);
        const Vec3d n = scaled(1 / length(area), area);
        if (n[2] < nz[0] || n[2] > nz[1]) continue;
        std::array<Vec3d, 3> at{};
        for (std::size_t k = 0; k < 3; ++k) at[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
        for (double wanted = length(area) / 2 * kPerMm2; wanted > share(random); --wanted) {
            const double s = std::sqrt(share(random)), t = share(random);
            const Vec3d p = plus(between(at[0], between(at[1], at[2], t), s), n, out);
            const bool near = std::any_of(edges.begin(), edges.end(), [&](const EdgeProbe& e) {
                return std::hypot(e.x - p[0], e.y - p[1]) < from_edges;
            });
            if (!near) probes.push_back({p[0], p[1], p[2], n[2], true, 0});
        }
    }
    return probes;
}

Tool drill(int number, double diameter) {
    Tool tool;
    tool.number = number, tool.kind = ToolKind::drill;
    tool.name = "drill " + std::to_string(static_cast<int>(diameter)) + " mm";
    tool.diameter = tool.shank_diameter = diameter;
    tool.flute_length = 45, tool.stickout = 60, tool.holder_diameter = 30;
    tool.max_rpm = 6000, tool.max_feed = 3000, tool.plunge_feed = 600;
    tool.stepdown_min = 1, tool.stepdown_max = 6;
    return tool;
}

struct Way {
    const char* name;
    bool as_finish;  // adaptive, edges, drills; else one step-over
    bool proven;     // what its proof finds goes back into the plan
};

void mill(Context& context, const std::string& stl, const Way& way) {
    Job job;
    job.tools = *named_library("fixed");
    job.cutting.arcs = false;
    job.allow_undercut = true;
    job.tolerances.cusp = kCusp;
    job.cutting.finish_strategy = FinishStrategy::projection;
    job.cutting.uniform_steps = !way.as_finish;
    job.cutting.edges = way.as_finish;
    if (way.as_finish)
        for (const int d : {6, 8}) job.tools.push_back(drill(10 + d, d));
    const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
    Plan made = plan(context, *pattern, job);
    const support::TemporaryFolder folder;
    VerifyResult proof;
    if (way.proven) proof = write_proven(context, made, folder / "out", pattern, true);
    else proof = write_verified(context, made, folder / "out", pattern);
    const MeshView mesh = pattern->read.mesh.view();
    std::vector<EdgeProbe> edges = test::edge_probes(context, mesh, job.cutting.edge_angle_deg);
    std::vector<EdgeProbe> surface = probes_of(mesh, {0.6, 0.9999}, 0, edges, kFromEdges),
                           walls = probes_of(mesh, {-0.01, 0.01}, kOut, {}, 0);
    for (std::vector<EdgeProbe>* probes : {&edges, &surface, &walls}) test::cut_probes(made, *probes);
    std::vector<double> cusps;
    for (const EdgeProbe& p : surface) cusps.push_back(p.error());
    std::sort(cusps.begin(), cusps.end());
    const auto rough =
        std::count_if(walls.begin(), walls.end(), [](const EdgeProbe& p) { return p.stands > p.surface; });
    const test::EdgeErrors convex = test::edge_errors(edges, true), concave = test::edge_errors(edges, false);
    int drilled = 0;
    for (const Layer& layer : made.layers)
        for (const Operation& op : layer.operations) drilled += op.kind == OperationKind::drill ? 1 : 0;
    const auto size = static_cast<double>(walls.size());
    std::printf("| %s | %.1f | %.4f | %.4f | %.2f %% | %.4f, %.3f | %.4f, %.3f | %d | %s |\n", way.name,
                made.totals.cutting_minutes + made.totals.tool_change_minutes, cusps[cusps.size() / 2],
                cusps.back(), 100 * static_cast<double>(rough) / size, convex.mean, convex.worst,
                concave.mean, concave.worst, drilled, proof.violations.empty() ? "pass" : "fails");
    for (const Diagnostic& v : proof.violations)
        std::fprintf(stderr, "%s: %s\n", v.code.c_str(), v.message.c_str());
    std::fflush(stdout);
}

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    using namespace slabwright;
    const support::TemporaryFolder folder;
    const std::string stl = argc > 1 ? argv[1] : folder / "part.stl";
    support::spit(stl, stl_bytes("finish", test::finish_part()));
    Context context;
    std::puts(
        "| way | minutes | cusps, middle, mm | worst, mm | of the walls more than .02 mm stands on | convex "
        "edges, mean and worst, mm | "
        "concave, mm | runs of drills | its proof |\n|---|---|---|---|---|---|---|---|---|");
    try {
        for (const Way& way : {Way{"adaptive, edges, drills", true, true}, Way{"one step-over", false, false},
                               Way{"one step-over, until its proof passes", false, true}})
            mill(context, stl, way);
    } catch (const Error& error) {
        std::fprintf(stderr, "finish_bench: %s %s\n", error.code().c_str(), error.message().c_str());
        return 1;
    }
}
