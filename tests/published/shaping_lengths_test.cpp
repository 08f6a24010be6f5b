// SHAPING table 1 (half sphere R 50, ball r 12.7) against the closed forms of the path lengths on a sphere:
// what the emitted programs travel on the surface, by levels alone, projection alone, both over everything,
// and split by slope.
//
// The tool's tip moves as the ball's centre does, on a sphere of radius ρ = R + r; at slope α the centre is
// ρ·cos α above the base and ρ·sin α from the axis. With one stepdown c and one step-over s:
//   levels from slope a up:            (1/c) ∫ 2π√(ρ² − h²) dh over 0 … H = ρ·cos a   = π(H√(ρ² − H²) +
//   ρ²·asin(H/ρ)) / c offset curves up to slope a:       (1/s) ∫ 2πx dx over 0 … A = ρ·sin a            = πA²
//   / s a raster up to slope a:            (1/s) ∫ 2√(ρ² − y²)·asin√((A² − y²)/(ρ² − y²)) dy over −A … A
// Over the whole: π²ρ²/2c, πρ²/s and π²ρ²/2s. So, with c = s, levels are π/2 times the offset curves, and
//   both/split = (1 + π/2) / (1 + π/4) = 1.4399.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/paths/runs/tolerances.h"
#include "engine/planner/planner.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "kernels/cutting/cusp.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

constexpr double pi = std::numbers::pi, kSphere = 50, kBall = 12.7, kRho = kSphere + kBall, kStep = 0.4,
                 kQuarter = pi / 4;

double levels_length(double from_slope, double c) {
    const double h = kRho * std::cos(from_slope);
    return pi * (h * std::sqrt(kRho * kRho - h * h) + kRho * kRho * std::asin(h / kRho)) / c;
}
double offsets_length(double to_slope, double s) {
    const double a = kRho * std::sin(to_slope);
    return pi * a * a / s;
}
double raster_length(double to_slope, double s) {
    // By Simpson's rule over y = A·sin t, where the integrand has no infinite slope at its ends.
    const double a = kRho * std::sin(to_slope);
    constexpr int n = 2000;
    double sum = 0;
    for (int k = 0; k <= n; ++k) {
        const double t = -pi / 2 + pi * k / n, y = a * std::sin(t), chord = std::max(0.0, a * a - y * y),
                     circle = kRho * kRho - y * y;
        const double f =
            circle > 0 ? 2 * std::sqrt(circle) * std::asin(std::min(1.0, std::sqrt(chord / circle))) : 0;
        sum += (k == 0 || k == n ? 1 : k % 2 == 1 ? 4 : 2) * f * a * std::cos(t);
    }
    return sum * pi / n / 3 / s;
}

Job shaping_job(FinishStrategy strategy, Projection projection) {
    Job job;
    job.slabs.thicknesses = {52};
    job.slabs.margin = 30;
    job.machine.travel_z = 400;
    job.tolerances.cusp = 0.003;
    job.cutting.engagement = Engagement::nominal;  // of lengths alone
    for (Tool& tool : job.tools) tool.flute_length = 110, tool.stickout = 130;
    Tool& ball = job.tools[2];
    ball.name = "ball end mill 1 in";
    ball.diameter = ball.shank_diameter = 2 * kBall;
    ball.holder_diameter = 50;
    ball.stepdown_max = 2;
    job.machine.frame = Frame::pattern_base;  // so that the programs' z is the sphere's
    job.cutting.finish_strategy = strategy;
    job.cutting.projection = projection;
    // SHAPING's steps are constant; this one is just over what the cusp of .003 mm asks for at 45°, so every
    // method has it.
    job.cutting.uniform_steps = true;
    job.cutting.min_stepdown = job.cutting.min_stepover = kStep;
    job.cutting.overlap_deg = 0;
    job.cutting.vertical_deg = 90;
    return job;
}

struct Lengths {
    double levels = 0, projection = 0;
    [[nodiscard]] double all() const { return levels + projection; }
};

/// What the emitted finish programs travel with the ball on the sphere, mm. Plunges, leads and links through
/// air do not count.
Lengths finish_lengths(FinishStrategy strategy, Projection projection) {
    Context context;
    const Mesh mesh = weld(context, half_sphere());
    const Plan plan = make_plan(context, mesh, {}, shaping_job(strategy, projection));
    EXPECT_EQ(plan.layers.size(), 1U);
    Lengths lengths;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            const bool levels = op.purpose == "level contours",
                       projected = op.purpose == "projected raster" || op.purpose == "projected offsets";
            if (!levels && !projected) continue;
            EXPECT_NEAR(levels ? op.stepdown : op.stepover, kStep, 1e-9) << op.purpose;
            const Program program = read_gcode(program_text(plan, layer, op), op.purpose);
            double length = 0;
            for (std::size_t i = 1; i < program.steps.size(); ++i) {
                const ProgramStep &a = program.steps[i - 1], &b = program.steps[i];
                if (!a.known() || b.rapid()) continue;
                // The model's facets lie up to 0.015 mm inside its sphere, and so does the ball.
                auto on_surface = [](const ProgramStep& s) {
                    return std::abs(std::hypot(s.x, s.y, s.z + kBall) - kRho) < 0.05;
                };
                if (on_surface(a) && on_surface(b)) length += std::hypot(b.x - a.x, b.y - a.y, b.z - a.z);
            }
            (levels ? lengths.levels : lengths.projection) += length;
        }
    return lengths;
}

void expect_near(double measured, double integral, const char* what, double within = 0.02) {
    std::printf("%-34s programs %8.2f m, integral %8.2f m, %+.2f %%\n", what, measured / 1000,
                integral / 1000, 100 * (measured / integral - 1));
    EXPECT_NEAR(measured, integral, within * integral) << what;
}

TEST(Shaping, LengthsOfTheEmittedProgramsAreTheIntegrals) {
    const Lengths levels = finish_lengths(FinishStrategy::levels, Projection::offset);
    expect_near(levels.levels, levels_length(0, kStep), "levels alone");
    EXPECT_EQ(levels.projection, 0);
    const Lengths projection = finish_lengths(FinishStrategy::projection, Projection::offset);
    // Offsets that end at the equator count in whole ones: one more or less is half a percent.
    expect_near(projection.projection, offsets_length(pi / 2, kStep), "projection alone", 0.025);
    EXPECT_EQ(projection.levels, 0);
    const Lengths both = finish_lengths(FinishStrategy::both, Projection::offset);
    expect_near(both.levels, levels_length(0, kStep), "both: levels");
    expect_near(both.projection, offsets_length(pi / 2, kStep), "both: projection");
    const Lengths split = finish_lengths(FinishStrategy::split, Projection::offset);
    expect_near(split.levels, levels_length(kQuarter, kStep), "split: levels");
    expect_near(split.projection, offsets_length(kQuarter, kStep), "split: projection");

    const double levels_ratio = levels.all() / projection.all(), split_ratio = both.all() / split.all();
    EXPECT_NEAR(levels_ratio, pi / 2, 0.02 * pi / 2);
    EXPECT_NEAR(split_ratio, (1 + pi / 2) / (1 + pi / 4), 0.02 * 1.44);
    // Print rounds to minutes: 29/20 lies between 28.5/20.5 and 29.5/19.5.
    EXPECT_GT(split_ratio, 28.5 / 20.5);
    EXPECT_LT(split_ratio, 29.5 / 19.5);

    // Absolute figures: at 1000 mm/min a minute is a metre. `ours` is the tip's way at the step that this
    // cusp asks for.
    const double root = std::sqrt(2 * kBall * 0.003 - 0.003 * 0.003), step45 = 2 * root * std::sin(kQuarter),
                 scale = kStep / step45 / 1000;
    const double on_contact =
        kSphere * kSphere / (kRho * kRho);  // were the way of the contact meant, on R instead of ρ
    EXPECT_NEAR(ball_level_stepdown_printed(kBall, kQuarter, 0.003), step45, 1e-9);
    std::printf("\nSHAPING table 1, minutes at 1000 mm/min     published  computed  why they differ\n");
    std::printf(
        "levels / projection                            %6.3f    %6.3f  they agree: pi/2 at one step\n",
        2028.0 / 1292, levels_ratio);
    std::printf(
        "both / split                                   %6.3f    %6.3f  they agree within the rounding of 29 "
        "and 20 to minutes\n",
        29.0 / 20, split_ratio);
    std::printf(
        "both, cusp .003 mm                             %6d    %6.1f  by the tip; by the contact %.1f: print "
        "has a cusp of %.4f mm\n",
        29, both.all() * scale, both.all() * scale * on_contact,
        kBall -
            std::sqrt(kBall * kBall -
                      std::pow(pi * kSphere * kSphere * (1 + pi / 2) / 29000 / 2 / std::sin(kQuarter), 2)));
    std::printf(
        "split, cusp .003 mm                            %6d    %6.1f  as above; by the contact %.1f\n", 20,
        split.all() * scale, split.all() * scale * on_contact);
    // Levels and projection alone need a step of zero where the sphere is level or vertical: print's steps
    // stand for a limit slope.
    for (const auto& [what, published, length] : {std::tuple{"levels alone", 2028.0, levels_length(0, 1)},
                                                  {"projection alone", 1292.0, offsets_length(pi / 2, 1)}}) {
        const double tip = length / published / 1000, contact = tip * on_contact;
        std::printf(
            "%-46s %6.0f      any   a step of %.4f mm by the tip, of slopes over %.2f degrees only; %.4f mm, "
            "%.2f by the contact\n",
            what, published, tip, std::asin(tip / 2 / root) * 180 / pi, contact,
            std::asin(contact / 2 / root) * 180 / pi);
    }
}

// Parallel lines, the planner's default: over all slopes they are as long as levels, not π/2 shorter.
TEST(Shaping, ARasterIsLongerThanOffsetCurves) {
    EXPECT_NEAR(raster_length(pi / 2, kStep), pi * pi * kRho * kRho / 2 / kStep,
                1e-4 * raster_length(pi / 2, kStep));
    const Lengths projection = finish_lengths(FinishStrategy::projection, Projection::raster);
    expect_near(projection.projection, raster_length(pi / 2, kStep), "raster alone");
    const Lengths split = finish_lengths(FinishStrategy::split, Projection::raster);
    expect_near(split.levels, levels_length(kQuarter, kStep), "split, raster: levels");
    // A line goes on to one place beyond the last on the surface that it finishes: half their distance on an
    // average.
    const double places = to_mm(safe_step(kBall, Job{}.tolerances.gouge)) / std::cos(kQuarter);
    expect_near(split.projection, raster_length(kQuarter + places / 2 / kRho, kStep),
                "split, raster: raster");
}

}  // namespace
}  // namespace slabwright
