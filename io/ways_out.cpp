#include "io/ways_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "engine/planner/ways_out.h"
#include "engine/prepare/preparation.h"
#include "io/read/pattern.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostFacets = 1'000'000;  // for which looking takes no longer than planning would

/// A word as a shell takes it.
std::string word(const std::string& text) {
    constexpr std::string_view plain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+./:=@%,";
    if (!text.empty() && text.find_first_not_of(plain) == std::string::npos) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

std::string leaves(const Lying& outcome) {
    const std::string left = outcome.unmade_mm3 < 0.5
                                 ? "leaves nothing unmade"
                                 : fmt::format("leaves {:.1f} cm3 unmade, up to {:.1f} mm high",
                                               outcome.unmade_mm3 / 1000, outcome.unmade_mm);
    return fmt::format("{}, {} layers", left, outcome.layers);
}

/// What was done to the model already, as options that the command repeats.
std::string repeated(const PrepareJob& job, bool turns) {
    std::string text;
    const auto list = [&](const char* option, const std::vector<double>& v, double usual) {
        if (std::all_of(v.begin(), v.end(), [&](double x) { return x == usual; })) return;
        text += fmt::format(" {} {},{},{}", option, v[0], v[1], v[2]);
    };
    if (turns) list("--turn", job.turn, 0);
    list("--scale", job.scale, 1);
    if (contraction_of(job.shrink) != 0) text += " --shrink " + word(job.shrink);
    if (job.mirror != MirrorAxis::none)
        text += fmt::format(" --mirror {}", "xyz"[static_cast<std::size_t>(job.mirror) - 1]);
    if (job.skin != 0) text += fmt::format(" --skin {}", job.skin);
    list("--shift", job.shift, 0);
    return text;
}

}  // namespace

std::string ways_out_text(Context& context, const Pattern& pattern, const Job& job, const std::string& out) {
    const Mesh& mesh = pattern.read.mesh;
    if (mesh.facets.size() > kMostFacets) return {};
    context.begin_phase("ways out", 0.9, 1.0);
    const Lying now = lying(context, mesh.view(), job);
    const PrepareJob& p = job.prepare;
    const bool may_turn = std::all_of(p.turn.begin(), p.turn.end(), [](double d) { return d == 0; }) &&
                          p.scale[0] == p.scale[1] && p.scale[1] == p.scale[2] &&
                          p.mirror == MirrorAxis::none && p.skin == 0;
    std::string text;
    const std::string from = word(pattern.place);
    for (const WayOut& way : ways_out(context, mesh.view(), pattern.read.report, job, now)) {
        if (way.turn && !may_turn) continue;
        if (way.turn) {
            text += fmt::format("  slabwright plan {} -o {} --turn {:g},{:g},{:g}{}\n", from, word(out),
                                (*way.turn)[0], (*way.turn)[1], (*way.turn)[2], repeated(p, false));
        } else {
            const Vec3d& n = way.plane->normal;
            text += fmt::format("  slabwright split {} --plane {:g},{:g},{:g},{:.9g} -o {} {}{}\n", from,
                                n[0], n[1], n[2], way.plane->offset_mm, word(out + "-above.stl"),
                                word(out + "-below.stl"), repeated(p, true));
        }
        text += fmt::format("    {}{}\n", leaves(way.outcome),
                            way.turn ? "" : " in both halves, to be planned one by one");
    }
    if (text.empty()) return "neither another side down nor two halves would build much more of it\n";
    return fmt::format("as it lies it {}; better would be\n{}", leaves(now), text);
}

}  // namespace slabwright
