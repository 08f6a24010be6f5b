#include "engine/flask/flask.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "kernels/errors.h"
#include "kernels/geometry/vectors.h"
#include "kernels/polygons/hull.h"
#include "kernels/polygons/thinned.h"
#include "kernels/slicing/silhouette.h"

namespace slabwright {

namespace {

// The opening's outline is made a tenth wider than the gap, and thinned by no more than that.
constexpr double kThinned = 0.1;
constexpr double kArc = 0.05;  // mm by which round corners may come out too wide; an offset's chords miss by
                               // no more than 2.25 of it

double slope(const FlaskShape& shape) { return std::tan(shape.draft_deg * std::numbers::pi / 180); }

// The outer loops alone.
Loops filled(const Loops& region) {
    Loops outer;
    for (std::size_t i = 0; i < region.size(); ++i) {
        if (region.parents[i] >= 0) continue;
        for (const Point2 p : region.loop(i)) outer.points.push_back(p);
        outer.close_loop();
    }
    return outer;
}

}  // namespace

double flask_margin(const FlaskShape& shape, double height) {
    return shape.gap + kThinned + 3 * kArc + std::max(0.0, height) * slope(shape) + shape.wall;
}

Flask place_flask(Context& context, MeshView mesh, const Plan& plan) {
    const FlaskShape& shape = plan.job.flask;
    Loops opening = filled(offset(filled(silhouette(context, mesh)), shape.gap + kThinned, kArc));
    if (opening.size() > 1) {
        const std::vector<Point2> hull = convex_hull(opening.points);
        opening = {};
        opening.points = hull;
        opening.close_loop();
    }
    opening = filled(simplify(thinned(opening, kThinned)));

    Flask flask;
    const Point2 low{to_units(plan.stock_min[0]), to_units(plan.stock_min[1])},
        high{to_units(plan.stock_max[0]), to_units(plan.stock_max[1])};
    flask.outer.points = {low, {high.x, low.y}, high, {low.x, high.y}};
    flask.outer.close_loop();
    flask.wall_mm = kUnbounded;
    for (const Layer& layer : plan.layers) {
        const double wider = layer.z_bottom * slope(shape);
        flask.inner.push_back(wider > 1e-4 ? filled(offset(opening, wider, kArc)) : opening);
        for (const Point2 p : flask.inner.back().points)
            flask.wall_mm =
                std::min(flask.wall_mm,
                         to_mm(std::min(std::min(std::int64_t{p.x} - low.x, std::int64_t{high.x} - p.x),
                                        std::min(std::int64_t{p.y} - low.y, std::int64_t{high.y} - p.y))));
        flask.volume_mm3 += (area(flask.outer) - area(flask.inner.back())) * (layer.z_top - layer.z_bottom);
        flask.opening_mm3 += area(flask.inner.back()) * (layer.z_top - layer.z_bottom);
    }
    if (flask.wall_mm < shape.wall - 1e-3)
        throw Error(
            ErrorKind::no_plan, "fit.flask",
            fmt::format(
                "the flask's wall would be {:.1f} mm thick, {:.1f} mm less than the {:.1f} mm asked for",
                flask.wall_mm, shape.wall - flask.wall_mm, shape.wall),
            "flask", "use larger slabs, a smaller flask.gap or flask.wall, or turn the pattern");
    return flask;
}

Loops flask_frame(const Flask& flask, std::size_t layer) { return subtract(flask.outer, flask.inner[layer]); }

}  // namespace slabwright
