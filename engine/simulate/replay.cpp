#include "engine/simulate/replay.h"
#include "engine/forces/cuts.h"
#include "engine/simulate/laid_slabs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/access/standing_part.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"
#include "kernels/forces/forces.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/stock/stock.h"

namespace slabwright {

namespace {

constexpr int kBandRows = 24;          // of the stock: bands are cut in parallel, and joined in their order
constexpr double kLeastVolume = 1e-6;  // mm³ that a piece must take to count as cutting
constexpr double kForceShare = 1e-3;   // of a piece's force that it may be wrong by: it is drawn

/// What one piece took, before it is a depth and a width.
struct Taken {
    double volume = 0, deepest = 0;
};

/// The forces of a cut as deep and as wide as a piece shows it.
void rate(ReplayPiece& piece, const Tool& tool, const Material& m, double feed, double rpm) {
    if (!(rpm > 0) || !(feed > 0) || !mills(tool.kind)) return;
    CutSegment s = segment_of(cutter_shape(tool));
    s.flutes = tool.flutes;
    s.helix_rad = tool.helix_rad;
    s.coefficients = coefficients_of(m, tool.helix_rad);
    s.spindle_rpm = rpm;
    s.chip_load_mm = feed / (rpm * tool.flutes);
    s.high_mm = std::min(piece.depth_mm, 64 * s.radius_mm);
    // A ball that cuts less deep than its radius is as wide as its circle at that depth.
    s.arc = engagement_arc(radius_at(s, s.high_mm), piece.width_mm, MillingSense::up);
    const CutForce force = peak_force(s, kForceShare);
    piece.force_n = force.peak_resultant_n;
    piece.deflection_mm = tip_bent_by(tool, force.peak_in_plane_n);
}

}  // namespace

struct Replay::Impl {
    Impl(Context& c, const SimulationInput& i, const ReplayOptions& o) : context(c), input(i), options(o) {}

    Context& context;
    const SimulationInput& input;
    ReplayOptions options;
    CellGrid grid;
    std::vector<Stock> bands;
    std::size_t slabs = 0;
    std::unique_ptr<MemoryCharge> charge;

    void add_slabs(std::size_t upto) {
        for (; slabs <= upto; ++slabs)
            for (Stock& band : bands) lay_slab(band, input.layers[slabs]);
    }
};

Replay::Replay(Context& context, const SimulationInput& input, const ReplayOptions& options) {
    if (!(options.cell > 0) || options.pieces == 0 || input.layers.empty())
        throw Error(ErrorKind::usage, "replay.options", "no cells, no pieces or no layers", "", "give some");
    impl_ = std::make_unique<Impl>(context, input, options);
    CellGrid& g = impl_->grid;
    const double width = input.stock_max[0] - input.stock_min[0],
                 depth = input.stock_max[1] - input.stock_min[1];
    g.cell = options.cell;
    g.nx = std::max(1, static_cast<int>(std::ceil(width / g.cell - 1e-9)));
    g.ny = std::max(1, static_cast<int>(std::ceil(depth / g.cell - 1e-9)));
    g.x0 = input.stock_min[0] + g.cell / 2;
    g.y0 = input.stock_min[1] + g.cell / 2;
    impl_->charge = std::make_unique<MemoryCharge>(context, g.count() * 4 * (input.layers.size() + 2),
                                                   "the replayed stock");
    for (int j = 0; j < g.ny; j += kBandRows) {
        CellGrid band = g;
        band.y0 = g.y(j);
        band.ny = std::min(kBandRows, g.ny - j);
        impl_->bands.emplace_back(band);
    }
}

Replay::~Replay() = default;

int Replay::nx() const { return impl_->grid.nx; }
int Replay::ny() const { return impl_->grid.ny; }
std::array<double, 2> Replay::first() const { return {impl_->grid.x0, impl_->grid.y0}; }

ReplayedProgram Replay::run(const Program& program) {
    Impl& r = *impl_;
    const auto layer = static_cast<std::size_t>(program.layer);
    if (layer >= r.input.layers.size())
        throw Error(ErrorKind::usage, "replay.layer", "a program of no layer", program.file, "plan again");
    r.add_slabs(layer);
    ReplayedProgram result;
    const auto tool = std::find_if(r.input.tools.begin(), r.input.tools.end(),
                                   [&](const Tool& t) { return t.number == program.tool; });
    const auto& steps = program.steps;
    // When every motion ends, by way over feed.
    std::vector<double> ends(steps.size(), 0);
    double now = 0;
    for (std::size_t k = 1; k < steps.size(); ++k) {
        if (steps[k - 1].known() && steps[k].known()) {
            const double feed = steps[k].rapid() ? r.input.machine.rapid_feed : steps[k].feed;
            now += std::hypot(steps[k].x - steps[k - 1].x, steps[k].y - steps[k - 1].y,
                              steps[k].z - steps[k - 1].z) /
                   feed * 60;
        }
        ends[k] = now;
    }
    result.seconds = now;
    if (tool == r.input.tools.end() || !(now > 0)) return result;
    const std::size_t pieces = std::max<std::size_t>(1, std::min(r.options.pieces, steps.size()));
    result.pieces.resize(pieces);
    const auto piece_of = [&](std::size_t k) {
        const double middle = (ends[k - 1] + ends[k]) / 2;
        return std::min(pieces - 1, static_cast<std::size_t>(middle / now * static_cast<double>(pieces)));
    };
    const CutterEnd end = cutter_end(cutter_shape(*tool));
    const double top = r.input.layers[layer].z_bottom + r.input.layers[layer].slab_thickness;
    std::vector<std::vector<Taken>> taken(r.bands.size());
    std::vector<std::vector<char>> cuts(r.bands.size());
    parallel_each(r.context, r.bands.size(), [&](std::size_t b) {
        Stock& stock = r.bands[b];
        const CellGrid& g = stock.grid();
        const double low = g.y0 - end.radius, high = g.y(g.ny - 1) + end.radius;
        taken[b].resize(pieces);
        cuts[b].assign(steps.size(), 0);
        for (std::size_t k = 1; k < steps.size(); ++k) {
            if (k % 4096 == 0) r.context.throw_if_cancelled();
            const ProgramStep &from = steps[k - 1], &to = steps[k];
            if (!from.known() || !to.known() || std::min(from.z, to.z) >= top) continue;
            if (std::max(from.y, to.y) < low || std::min(from.y, to.y) > high) continue;
            // What a flat cutter covers where it starts the motion before has taken, whatever that was.
            ChainedSweep chain;
            const auto disc = [&](std::size_t m) {  // whether motion m keeps its disc at one height
                return steps[m - 1].known() &&
                       (steps[m - 1].z == steps[m].z ||
                        (steps[m - 1].x == steps[m].x && steps[m - 1].y == steps[m].y));
            };
            chain.been = end.form == CutterEnd::Form::flat && from.z == to.z && k > 1 && disc(k - 1);
            const CutEffect effect =
                stock.cut(end, {from.x, from.y, from.z}, {to.x, to.y, to.z}, kUnbounded, chain);
            if (!(effect.removed > 0)) continue;
            Taken& piece = taken[b][piece_of(k)];
            piece.volume += effect.removed * g.cell * g.cell;
            piece.deepest = std::max(piece.deepest, effect.deepest);
            cuts[b][k] = 1;
        }
    });
    // The way cut and the fastest feed in the plane, of motions that took something.
    std::vector<double> way(pieces, 0), feed(pieces, 0);
    for (std::size_t k = 1; k < steps.size(); ++k) {
        const bool any =
            std::any_of(cuts.begin(), cuts.end(), [&](const std::vector<char>& c) { return c[k] != 0; });
        if (!any) continue;
        const double dx = steps[k].x - steps[k - 1].x, dy = steps[k].y - steps[k - 1].y;
        const std::size_t p = piece_of(k);
        way[p] += std::hypot(dx, dy, steps[k].z - steps[k - 1].z);
        if (dx != 0 || dy != 0) feed[p] = std::max(feed[p], steps[k].feed);
    }
    std::vector<Taken> sums(pieces);
    for (std::size_t p = 0; p < pieces; ++p) {
        for (const auto& band : taken)
            sums[p].volume += band[p].volume, sums[p].deepest = std::max(sums[p].deepest, band[p].deepest);
        result.removed_mm3 += sums[p].volume;
    }
    parallel_each(r.context, pieces, [&](std::size_t p) {
        const Taken& sum = sums[p];
        if (sum.volume < kLeastVolume || !(way[p] > 0) || !(sum.deepest > 0)) return;
        ReplayPiece& piece = result.pieces[p];
        piece.depth_mm = sum.deepest;
        piece.width_mm = std::min(tool->diameter, sum.volume / (way[p] * sum.deepest));
        rate(piece, *tool, r.options.material, feed[p], program.spindle_rpm);
    });
    return result;
}

void Replay::finished(const StandingPart& part,
                      const std::function<void(std::size_t, const ReplayedLayer&)>& fn) const {
    Impl& r = *impl_;
    r.add_slabs(r.input.layers.size() - 1);
    std::vector<std::unique_ptr<RisingEnvelope>> envelopes(r.bands.size());
    parallel_each(r.context, r.bands.size(), [&](std::size_t b) {
        const CellGrid& g = r.bands[b].grid();
        envelopes[b] = std::make_unique<RisingEnvelope>(part, g.x0, g.y0, g.cell, g.nx, g.ny);
    });
    ReplayedLayer found;
    found.left.resize(r.grid.count());
    found.surface.resize(r.grid.count());
    for (std::size_t layer = 0; layer < r.input.layers.size(); ++layer) {
        const SimulatedLayer& l = r.input.layers[layer];
        parallel_each(r.context, r.bands.size(), [&](std::size_t b) {
            const Stock& stock = r.bands[b];
            const CellGrid& g = stock.grid();
            std::vector<float> envelope(g.count());
            envelopes[b]->at(l.z_top, std::numeric_limits<float>::lowest(), envelope.data());
            const std::size_t first =
                b * static_cast<std::size_t>(kBandRows) * static_cast<std::size_t>(g.nx);
            float *out = found.left.data() + first, *surface = found.surface.data() + first;
            for (int j = 0; j < g.ny; ++j)
                for (int i = 0; i < g.nx; ++i) {
                    const std::size_t c = g.index(i, j);
                    const double x = g.x(i), y = g.y(j), z = stock.surface(layer, c);
                    surface[c] = static_cast<float>(z);
                    if (!l.flask.empty() && winding(l.flask, {to_units(x), to_units(y)}) > 0) {
                        out[c] = std::numeric_limits<float>::quiet_NaN();
                        continue;
                    }
                    const double keep = std::max(l.z_bottom, static_cast<double>(envelope[c]));
                    double over = z - keep;
                    if (over > r.options.cusp)
                        over = std::min(over, part.from_shadow({x, y, z}, l.z_top, over).distance);
                    else if (over < 0) over = -part.from_facets({x, y, z}, -over);
                    out[c] = static_cast<float>(over);
                }
        });
        fn(layer, found);
    }
}

}  // namespace slabwright
