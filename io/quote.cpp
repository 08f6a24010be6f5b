#include "io/quote.h"

#include <fmt/format.h>

#include <memory>

#include "engine/schedule/probes.h"
#include "io/read/pattern.h"
#include "io/slabwright.h"
#include "io/text/json_text.h"
#include "io/write/wood_json.h"

namespace slabwright {

QuotedModel quote_model(Context& context, const PatternSource& source, const Job& job) {
    validate(job);
    check_probing(job);
    const std::shared_ptr<Pattern> pattern = read_pattern(context, source, job);
    return {pattern->read.input, quote(context, pattern->read.mesh.view(), job), job};
}

std::string quote_json(const QuotedModel& model) {
    const Quote& q = model.quote;
    JsonText json;
    json.begin_object().key("schema").string("slabwright.quote/1").key("units").string("mm");
    json.key("file").string(model.input.file).key("layers").integer(q.outcome.layers);
    json.key("unmade_mm3").rounded(q.outcome.unmade_mm3, 1);
    json.key("stock").begin_array(JsonText::Shape::line).rounded(q.stock[0], 3).rounded(q.stock[1], 3).end();
    json.key("slabs").begin_array();
    for (const QuotedSlabs& s : q.slabs)
        json.begin_object(JsonText::Shape::line)
            .key("thickness")
            .rounded(s.thickness, 4)
            .key("count")
            .integer(s.count)
            .end();
    json.end().key("slab_m2").rounded(q.slab_m2, 4).key("glue_m2").rounded(q.glue_m2, 4);
    json.key("mass_kg").rounded(q.mass_kg, 2).key("work").begin_array();
    for (const QuotedWork& w : q.work)
        json.begin_object(JsonText::Shape::line)
            .key("name")
            .string(w.name)
            .key("ideal_minutes")
            .rounded(w.ideal_minutes, 3)
            .key("minutes")
            .rounded(w.minutes, 2)
            .end();
    json.end().key("cutting_minutes").rounded(q.cutting_minutes, 1);
    json.key("bonding_minutes").rounded(q.bonding_minutes, 1);
    json.key("tool_change_minutes").rounded(q.tool_change_minutes, 1);
    if (model.job.layers.sides != SlabSides::one)
        json.key("undersides").integer(q.undersides).key("underside_minutes").rounded(q.underside_minutes, 1);
    json.key("build_minutes").rounded(q.build_minutes, 1).key("spread").rounded(q.spread, 2);
    json.key("boards").integer(static_cast<std::int64_t>(q.boards.boards.size()));
    json.key("bought_m2").rounded(q.boards.bought_m2(), 4);
    json.key("cost");
    put_cost(json, model.job, q.cost);
    json.end();
    return json.take();
}

std::string quote_text(const QuotedModel& model) {
    const Quote& q = model.quote;
    const auto hours = [](double minutes) {
        return minutes < 90 ? fmt::format("{:.0f} min", minutes) : fmt::format("{:.1f} h", minutes / 60);
    };
    std::string text =
        fmt::format("{}: {} {}, about {}, give or take a quarter (cutting {}, bonding {}, tool changes {})\n",
                    model.input.file, q.outcome.layers, q.outcome.layers == 1 ? "layer" : "layers",
                    hours(q.build_minutes), hours(q.cutting_minutes), hours(q.bonding_minutes),
                    hours(q.tool_change_minutes));
    if (q.undersides > 0)
        text += fmt::format("below   {} of the slabs {} milled from below first, {} of that time\n",
                            q.undersides, q.undersides == 1 ? "is" : "are", hours(q.underside_minutes));
    const bool by_layer = model.job.slabs.blanks == Blanks::layer;
    for (const QuotedSlabs& s : q.slabs)
        text += fmt::format("slabs   {} of {:g} x {:.0f} x {:.0f} mm{}\n", s.count, s.thickness, q.stock[0],
                            q.stock[1], by_layer ? " at most" : "");
    text += fmt::format("wood    {:.2f} m2 of slabs, {:.1f} kg with the base board; {}\n", q.slab_m2,
                        q.mass_kg, boards_text(q.boards));
    text += fmt::format("glue    on {:.3f} m2\n", q.glue_m2) + cost_text(model.job, q.cost);
    if (q.outcome.unmade_mm3 >= 1)
        text += fmt::format("unmade  {:.1f} cm3 under overhangs{}, up to {:.1f} mm high\n",
                            q.outcome.unmade_mm3 / 1000,
                            q.undersides > 0 ? " that are reached neither from above nor from below" : "",
                            q.outcome.unmade_mm);
    return text;
}

}  // namespace slabwright
