#include "engine/forces/seen_stretches.h"

#include <algorithm>
#include <utility>

#include "engine/tools/tools.h"

namespace slabwright {

bool roughs(OperationKind kind) { return kind == OperationKind::rough || kind == OperationKind::face; }

void run_through(Context& context, StandingSlab& slab, const Operation& op, const Tool& tool,
                 const Layer& layer, const WoodLimits& limits, double setback, std::vector<SeenStretch>& seen,
                 std::span<const MoveRange> parts) {
    seen.clear();
    const auto see = [&](const CutStretch& s) {
        if (seen.size() % 1024 == 0) context.throw_if_cancelled();
        SeenStretch now;
        now.first = s.first;
        now.last = s.last;
        now.cuts = s.cuts();
        now.length = static_cast<float>(s.length);
        for (std::size_t i = 0; i < 3; ++i) now.at[i] = static_cast<float>(s.at[i]);
        if (now.cuts) {
            now.coarse = class_of(s, tool, kCoarse);
            now.fine = class_of(s, tool, kFine);
            now.low = static_cast<float>(s.low);
            now.depth = static_cast<float>(s.high);
            now.height = static_cast<float>(std::max(0.0, s.at[2] - layer.z_bottom + (s.low + s.high) / 2));
            // Roughing is carried by the slab that stands, floors by what stays under them. Thinner than the
            // least step it is no slab but a sliver that tears off; and what a ball or a wall's finishing has
            // under its tip is not what carries it.
            const bool floor =
                op.kind == OperationKind::finish && roughs_layers(tool.kind) && op.stepdown == 0;
            const double under = s.at[2] - layer.z_bottom, wood = roughs(op.kind) ? under + s.high
                                                                  : floor         ? under
                                                                                  : 0;
            const double beyond =
                limits.overhang && wood >= (floor ? kLeastDepth : std::max(kLeastDepth, least_slab(tool)))
                    ? limits.overhang->at(s.at[0], s.at[1])
                    : 0;
            if (beyond > 0)
                now.wood = static_cast<float>(wood), now.overhang = static_cast<float>(beyond + setback);
            if (limits.walls != nullptr)
                if (const WallBears bears = limits.walls->bears(wall_push(now, op, tool)); bears.foot)
                    now.wall_n = static_cast<float>(bears.force_n);
        }
        seen.push_back(now);
    };
    if (parts.empty()) slab.run(op, tool, see);
    else slab.run_parts(op, tool, parts, see);
}

bool any_halved(const std::vector<SeenStretch>& seen, std::span<const Passes> runs) {
    std::size_t r = 0;
    for (const SeenStretch& s : seen) {
        while (r < runs.size() && runs[r].last < s.first) ++r;
        if (r < runs.size() && runs[r].first <= s.last && (s.first < runs[r].first || s.last > runs[r].last))
            return true;
    }
    return false;
}

void replaced(const std::vector<SeenStretch>& seen, std::span<const Passes> runs,
              std::span<const MoveRange> parts, const std::vector<SeenStretch>& anew,
              std::vector<SeenStretch>& all) {
    all.clear();
    all.reserve(seen.size() + anew.size());
    std::size_t r = 0, next = 0;  // runs passed, and of what was seen anew
    const auto take = [&] {
        for (; next < anew.size() && anew[next].last <= parts[r].last; ++next) all.push_back(anew[next]);
        ++r;
    };
    for (SeenStretch s : seen) {
        while (r < runs.size() && runs[r].last < s.first) take();
        if (r < runs.size() && s.first >= runs[r].first) continue;
        const std::uint32_t more = r == 0 ? 0 : parts[r - 1].last - runs[r - 1].last;
        s.first += more;
        s.last += more;
        all.push_back(s);
    }
    while (r < runs.size()) take();
}

bool without_idle(std::span<Passes> runs, std::span<const SplitRun> split,
                  const std::vector<SeenStretch>& seen) {
    bool any = false;
    std::size_t next = 0;
    for (std::size_t r = 0; r < runs.size(); ++r) {
        std::vector<std::int32_t> busy;
        for (std::size_t p = 0; p < runs[r].up.size(); ++p) {
            const MoveRange& pass = split[r].passes[p];
            while (next < seen.size() && seen[next].last < pass.first) ++next;
            bool cuts = false;
            for (; next < seen.size() && seen[next].first <= pass.last; ++next) cuts |= seen[next].cuts;
            if (cuts) busy.push_back(runs[r].up[p]);
        }
        any |= busy.size() < runs[r].up.size();
        runs[r].up = std::move(busy);
    }
    return any;
}

}  // namespace slabwright
