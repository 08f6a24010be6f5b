#include "io/ways_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "engine/prepare/preparation.h"
#include "io/read/pattern.h"
#include "io/text/json_text.h"
#include "io/write/milled_ways_json.h"

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

WaysOut find_ways_out(Context& context, const Pattern& pattern, const Job& job, const std::string& out) {
    WaysOut found;
    const Mesh& mesh = pattern.read.mesh;
    if (mesh.facets.size() > kMostFacets) return found;
    context.begin_phase("ways out", 0.9, 1.0);
    found.looked = true;
    found.lies = lying(context, mesh.view(), job);
    found.milled = milled_ways(context, mesh.view(), job);
    const PrepareJob& p = job.prepare;
    const bool may_turn = std::all_of(p.turn.begin(), p.turn.end(), [](double d) { return d == 0; }) &&
                          p.scale[0] == p.scale[1] && p.scale[1] == p.scale[2] &&
                          p.mirror == MirrorAxis::none && p.skin == 0;
    const std::string from = word(pattern.place);
    for (const WayOut& way : ways_out(context, mesh.view(), pattern.read.report, job, found.lies)) {
        if (way.turn && !may_turn) continue;
        if (way.turn) {
            found.commands.push_back(
                {fmt::format("slabwright plan {} -o {} --turn {:g},{:g},{:g}{}", from, word(out),
                             (*way.turn)[0], (*way.turn)[1], (*way.turn)[2], repeated(p, false)),
                 way});
        } else {
            const Vec3d& n = way.plane->normal;
            found.commands.push_back(
                {fmt::format("slabwright split {} --plane {:g},{:g},{:g},{:.9g} -o {} {}{}", from, n[0], n[1],
                             n[2], way.plane->offset_mm, word(out + "-above.stl"), word(out + "-below.stl"),
                             repeated(p, true)),
                 way});
        }
    }
    return found;
}

std::string ways_out_text(const WaysOut& ways) {
    if (!ways.looked) return {};
    std::string text = fmt::format("as it lies it {}; the largest places are\n", leaves(ways.lies));
    text += pocket_lines(ways.milled.front().above.air, 3, "    ");
    text += ways.commands.empty() ? "neither another side down nor two halves would build much more of it\n"
                                  : "better would be\n";
    for (const WayOutCommand& c : ways.commands)
        text += fmt::format("  {}\n    {}{}\n", c.command, leaves(c.way.outcome),
                            c.way.turn ? "" : " in both halves, to be planned one by one");
    return text + "on each side, slabs milled from above, and on both sides (--sides two), would leave\n" +
           milled_ways_table(ways.milled);
}

std::string ways_out_json(const WaysOut& ways) {
    JsonText json;
    json.begin_object().key("schema").string("slabwright.ways_out/1").key("units").string("mm");
    const auto put = [&](const Lying& lying) {
        json.key("layers").integer(lying.layers).key("unmade_mm3").rounded(lying.unmade_mm3, 1);
        json.key("unmade_height").rounded(lying.unmade_mm, 3).key("has_room").boolean(lying.has_room);
    };
    json.key("looked").boolean(ways.looked).key("commands").begin_array();
    for (const WayOutCommand& c : ways.commands) {
        json.begin_object().key("command").string(c.command);
        json.key("halves").boolean(!c.way.turn.has_value());
        put(c.way.outcome);
        json.end();
    }
    json.end();
    if (ways.looked) {
        json.key("as_it_lies").begin_object();
        put(ways.lies);
        json.end().key("ways");
        put_milled_ways(json, ways.milled);
    }
    json.end();
    return json.take();
}

}  // namespace slabwright
