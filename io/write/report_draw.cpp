#include "io/write/report_draw.h"

#include <vector>

#include "kernels/access/closest_point.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

char code_of(const DrawReport& report, std::uint32_t facet) {
    if (facet == kNoFacet) return 0;
    if (report.finding[facet] == DrawFinding::undercut) return 2;
    if (report.thickness_mm[facet] > 0) return 3;
    return report.finding[facet] == DrawFinding::little_draft ? 1 : 0;
}

}  // namespace

DrawReport draw_within_memory(Context& context, MeshView mesh) {
    try {
        return check_draw(context, mesh);
    } catch (const Error& error) {
        if (error.code() != "memory.limit") throw;
    }
    return check_draw(context, mesh, {.thin_mm = 0});
}

std::string draw_codes(Context& context, MeshView mesh, const DrawReport& report, MeshView model) {
    std::string codes(model.size(), 0);
    if (report.little_draft.empty() && report.undercuts.empty() && report.thin.empty()) return codes;
    std::vector<Point3> middles(model.size());
    for (std::size_t f = 0; f < model.size(); ++f)
        for (const std::uint32_t v : model.facets[f])
            middles[f] = plus(middles[f], to_double(model.vertices[v]), 1.0 / 3);
    try {
        const ClosestPoint closest(context, mesh);
        const std::vector<ClosestHit> hits = closest.query(context, middles, kUnbounded);
        for (std::size_t f = 0; f < hits.size(); ++f) codes[f] = code_of(report, hits[f].facet);
    } catch (const Error& error) {
        if (error.code() != "memory.limit") throw;
        codes.clear();
    }
    return codes;
}

}  // namespace slabwright
