#include "io/orient.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include "io/read/pattern.h"
#include "io/slabwright.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

/// The job without what comes after turning.
Job unturned(const Job& job) {
    const PrepareJob& p = job.prepare;
    if (std::any_of(p.turn.begin(), p.turn.end(), [](double d) { return d != 0; }))
        throw Error(ErrorKind::usage, "orient.turned", "the job turns the model itself", "prepare.turn",
                    "leave out either --turn or --orient");
    if (p.scale[0] != p.scale[1] || p.scale[1] != p.scale[2])
        throw Error(ErrorKind::usage, "orient.turned",
                    "the job scales unevenly along axes that another side down would change", "prepare.scale",
                    "scale with `slabwright prepare` first, or turn with --turn");
    Job plain = job;
    plain.prepare = {};
    plain.prepare.scale = p.scale;
    plain.prepare.shrink = p.shrink;
    return plain;
}

}  // namespace

OrientModel orient_model(Context& context, const PatternSource& source, const Job& job, std::size_t planned) {
    validate(job);
    Job plain = unturned(job);
    const std::shared_ptr<Pattern> pattern = read_pattern(context, source, plain);
    OrientModel model;
    model.input = pattern->read.input;
    for (const Orientation& way : orientations(context, pattern->read.mesh.view(), plain))
        model.ways.push_back({way, 0, {}});
    plain.allow_undercut = plain.bonding.accept_weak = true;
    const std::size_t tried = std::min(planned, model.ways.size());
    for (std::size_t k = 0; k < tried; ++k) {
        OrientedWay& way = model.ways[k];
        plain.prepare.turn.assign(way.way.turn.begin(), way.way.turn.end());
        try {
            way.minutes = plan(context, source, plain).totals.build_minutes;
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::no_plan) throw;
            way.refused = error.what();
        }
    }
    std::stable_sort(model.ways.begin(), model.ways.begin() + static_cast<std::ptrdiff_t>(tried),
                     [](const OrientedWay& a, const OrientedWay& b) {
                         const auto rank = [](const OrientedWay& w) {
                             return std::tuple(!w.way.outcome.has_room, !w.refused.empty(),
                                               std::floor(w.way.outcome.unmade_mm3 / 10), w.minutes);
                         };
                         return rank(a) < rank(b);
                     });
    return model;
}

Job oriented(const Job& job, const OrientModel& model) {
    Job turned = job;
    if (!model.ways.empty())
        turned.prepare.turn.assign(model.ways.front().way.turn.begin(), model.ways.front().way.turn.end());
    return turned;
}

std::string orient_json(const OrientModel& model) {
    JsonText json;
    json.begin_object().key("schema").string("slabwright.orient/1").key("units").string("mm");
    json.key("file").string(model.input.file).key("ways").begin_array();
    for (const OrientedWay& w : model.ways) {
        json.begin_object(JsonText::Shape::line).key("turn_deg").begin_array(JsonText::Shape::line);
        for (const double d : w.way.turn) json.rounded(d, 6);
        json.end().key("size").begin_array(JsonText::Shape::line);
        for (const double d : w.way.size) json.rounded(d, 3);
        json.end().key("has_room").boolean(w.way.outcome.has_room);
        json.key("unmade_mm3").rounded(w.way.outcome.unmade_mm3, 1);
        json.key("unmade_height").rounded(w.way.outcome.unmade_mm, 3);
        json.key("layers").integer(w.way.outcome.layers).key("foot_mm2").rounded(w.way.foot_mm2, 1);
        if (w.minutes > 0) json.key("build_minutes").rounded(w.minutes, 2);
        if (!w.refused.empty()) json.key("refused").string(w.refused);
        json.end();
    }
    json.end().end();
    return json.take();
}

std::string orient_text(const OrientModel& model) {
    std::string text =
        fmt::format("{}\n{:>30}  {:>20}  {:>12}  {:>9}  {:>6}  {:>9}  {}\n", model.input.file, "--turn",
                    "size, mm", "unmade, cm3", "up to, mm", "layers", "foot, cm2", "build");
    for (const OrientedWay& w : model.ways) {
        const Orientation& way = w.way;
        const std::string build = !way.outcome.has_room ? "no room for it"
                                  : !w.refused.empty()  ? "no plan: " + w.refused
                                  : w.minutes > 0       ? fmt::format("{:.0f} min", w.minutes)
                                                        : "";
        text += fmt::format("{:>30}  {:>20}  {:>12.2f}  {:>9.1f}  {:>6}  {:>9.1f}  {}\n",
                            fmt::format("{:g},{:g},{:g}", way.turn[0], way.turn[1], way.turn[2]),
                            fmt::format("{:.0f} x {:.0f} x {:.0f}", way.size[0], way.size[1], way.size[2]),
                            way.outcome.unmade_mm3 / 1000, way.outcome.unmade_mm, way.outcome.layers,
                            way.foot_mm2 / 100, build);
    }
    return text;
}

}  // namespace slabwright
