// Cutting forces: the double reference against brute-force discs and against the closed form, OpenCL against
// both, seams between teeth, ranges, the overhang and the deflection of a cutter.
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <system_error>
#include <thread>

#include "engine/forces/op_forces.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"
#include "kernels/forces/forces.h"
#include "kernels/forces/hardest.h"
#include "tests/support/seed.h"

// PoCL never frees its compiler.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libpocl\nleak:libLLVM\nleak:libOpenCL\nleak:libclang\n";
}

namespace slabwright {
namespace {

constexpr double kPi = std::numbers::pi;

// PoCL shows no device unless it may write its cache somewhere.
const bool kCacheSet = [] {
    const auto folder = std::filesystem::temp_directory_path() / "slabwright-pocl";
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    setenv("POCL_CACHE_DIR", folder.c_str(), 0);
    return true;
}();

double drawn(std::mt19937_64& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

CutSegment random_cut(std::mt19937_64& random, CutterForm form) {
    CutSegment s;
    s.flutes = 1 + static_cast<int>(random() % 6);
    s.radius_mm = drawn(random, 1, 26);
    if (form == CutterForm::bull_nose) s.corner_mm = drawn(random, 0.05, 1) * s.radius_mm;
    if (form == CutterForm::ball) s.corner_mm = s.radius_mm;
    if (form == CutterForm::tapered_ball) s.corner_mm = drawn(random, 0.05, 0.9) * s.radius_mm;
    if (form == CutterForm::tapered_ball || form == CutterForm::cone) s.taper_rad = drawn(random, 0.03, 1.2);
    s.helix_rad = random() % 5 == 0 ? 0 : drawn(random, 0, kPi / 3);
    s.high_mm = std::exp(drawn(random, std::log(0.01), std::log(3.0))) * s.radius_mm;
    s.low_mm = random() % 3 == 0 ? drawn(random, 0, 0.9) * s.high_mm : 0;
    s.arc = engagement_arc(s.radius_mm, drawn(random, 0.01, 2.3) * s.radius_mm,
                           random() % 2 ? MillingSense::up : MillingSense::down);
    s.chip_load_mm = drawn(random, 0, 0.7);
    s.spindle_rpm = drawn(random, 1000, 18000);
    s.coefficients = {drawn(random, 2, 12), drawn(random, 0.2, 9), drawn(random, 0, 6),
                      drawn(random, 0, 4),  drawn(random, 0, 4),   drawn(random, 0, 1)};
    return s;
}

// LUO's own cut: 3 mm deep slot, 0.635 mm a tooth, two flutes, 30°, 1/2 in.
CutSegment slot_of_luo(double helix_lag = kPi / 6) {
    CutSegment s;
    s.radius_mm = 6.35;
    s.helix_rad = helix_lag;
    s.high_mm = 3;
    s.arc = engagement_arc(6.35, 12.7, MillingSense::up);
    s.chip_load_mm = 0.635;
    s.spindle_rpm = 4000;
    s.coefficients =
        resolve_coefficients({8.8575, 1.1268, 0.6188, 2.4948}, kPi / 6, CoefficientTransform::printed);
    return s;
}

struct Discs {
    double x = 0, y = 0, z = 0, torque = 0;
};

// What the edge runs along from the tip: a rounding up to the slope of the flank, the flank, the upright
// side.
struct EdgeRun {
    explicit EdgeRun(const CutSegment& s)
        : corner(s.corner_mm),
          taper(s.taper_rad),
          radius(s.radius_mm),
          disc(s.taper_rad > 0 ? 0 : s.radius_mm - s.corner_mm),
          turned(kPi / 2 - s.taper_rad),
          round_mm(s.corner_mm * turned),
          round_high(s.corner_mm * (1 - std::sin(s.taper_rad))) {
        const double across = taper > 0 ? std::max(0.0, radius - corner * std::cos(taper)) : 0;
        flank_mm = taper > 0 ? across / std::sin(taper) : 0;
    }
    double corner, taper, radius, disc, turned, round_mm, round_high, flank_mm = 0;

    // Length of edge up to a height.
    [[nodiscard]] double length(double h) const {
        if (h < round_high) return corner * std::acos(1 - h / corner);
        const double flank = (h - round_high) / std::cos(taper);
        if (flank < flank_mm) return round_mm + flank;
        return round_mm + flank_mm + h - round_high - flank_mm * std::cos(taper);
    }
    struct At {
        double z, kappa, from_axis;
    };
    [[nodiscard]] At at(double e) const {
        if (e < round_mm)
            return {corner * (1 - std::cos(e / corner)), e / corner, disc + corner * std::sin(e / corner)};
        const double flank = e - round_mm;
        if (flank < flank_mm)
            return {round_high + flank * std::cos(taper), turned,
                    corner * std::cos(taper) + flank * std::sin(taper)};
        return {round_high + flank_mm * std::cos(taper) + flank - flank_mm, kPi / 2, radius};
    }
};
// Disc i of n of equal lengths of edge.
EdgeRun::At disc_at(const CutSegment& s, int i, int n, double& db) {
    const EdgeRun run(s);
    const double low = run.length(s.low_mm), high = run.length(s.high_mm);
    db = (high - low) / n;
    return run.at(low + (high - low) * (i + 0.5) / n);
}
void add_disc(Discs& f, const CutSegment& s, double phi, const EdgeRun::At& at, double db) {
    const double kappa = at.kappa;
    const double h = s.chip_load_mm * std::sin(phi) * std::sin(kappa);
    const ForceCoefficients& k = s.coefficients;
    const double t = (k.ktc * h + k.kte) * db, r = (k.krc * h + k.kre) * db, a = (k.kac * h + k.kae) * db;
    f.x += -t * std::cos(phi) - (r * std::sin(kappa) + a * std::cos(kappa)) * std::sin(phi);
    f.y += t * std::sin(phi) - (r * std::sin(kappa) + a * std::cos(kappa)) * std::cos(phi);
    f.z += a * std::sin(kappa) - r * std::cos(kappa);
    f.torque += t * at.from_axis;
}

// Discs in z, each tooth wrapped into one turn and engaged or not by its angle: as a first implementation
// would have it.
Discs discs(const CutSegment& s, double theta, int n) {
    Discs f;
    for (int i = 0; i < n; ++i) {
        double db = 0;
        const EdgeRun::At at = disc_at(s, i, n, db);
        for (int j = 0; j < s.flutes; ++j) {
            double phi = theta + 2 * kPi * j / s.flutes - at.z * std::tan(s.helix_rad) / s.radius_mm;
            phi -= 2 * kPi * std::floor(phi / (2 * kPi));
            if (phi >= s.arc.entry_rad && phi <= s.arc.exit_rad) add_disc(f, s, phi, at, db);
        }
    }
    return f;
}

constexpr double SegmentForces::*kMembers[] = {
    &SegmentForces::peak_x_n,        &SegmentForces::peak_y_n,         &SegmentForces::peak_z_n,
    &SegmentForces::peak_in_plane_n, &SegmentForces::peak_resultant_n, &SegmentForces::mean_x_n,
    &SegmentForces::mean_y_n,        &SegmentForces::mean_z_n,         &SegmentForces::mean_in_plane_n};

// The largest difference of any force, as a share of the peak resultant; torque as a share of that times the
// radius.
double difference(const SegmentForces& a, const SegmentForces& b, double radius) {
    if (b.peak_resultant_n == 0) return a.peak_resultant_n;
    double worst = 0;
    for (const auto member : kMembers) worst = std::max(worst, std::abs(a.*member - b.*member));
    worst = std::max(worst, std::abs(a.peak_torque_nmm - b.peak_torque_nmm) / radius);
    worst = std::max(worst, std::abs(a.mean_torque_nmm - b.mean_torque_nmm) / radius);
    return worst / b.peak_resultant_n;
}

TEST(Forces, ReferenceAgreesWithDiscs) {
    const unsigned seed = 20260;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    double worst = 0;
    for (int i = 0; i < 40; ++i) {
        const CutSegment s = random_cut(random, static_cast<CutterForm>(i % 5));
        const SegmentForces f = reference_forces(s, 1e-4);
        Discs peak, mean;
        double plane = 0, all = 0, mean_plane = 0;
        const bool bull_nose = !s.flat() && !s.ball();
        const int angles = bull_nose ? 2880 : 720;
        for (int k = 0; k < angles; ++k) {
            const Discs d = discs(s, 2 * kPi * (k + 0.37) / angles, bull_nose ? 1000 : 500);
            peak.x = std::max(peak.x, std::abs(d.x)), peak.y = std::max(peak.y, std::abs(d.y)),
            peak.z = std::max(peak.z, std::abs(d.z));
            peak.torque = std::max(peak.torque, std::abs(d.torque));
            plane = std::max(plane, std::hypot(d.x, d.y)), all = std::max(all, std::hypot(d.x, d.y, d.z));
            mean.x += d.x / angles, mean.y += d.y / angles, mean.z += d.z / angles,
                mean.torque += d.torque / angles;
            mean_plane += std::hypot(d.x, d.y) / angles;
        }
        // Discs miss a peak at an engagement limit by up to half a step, and count a disc in or out whole. A
        // bull-nose's corner may be a small part of its edge, and comes in and out at once.
        const double within = 0.012 * all;
        EXPECT_NEAR(f.peak_x_n, peak.x, within) << i;
        EXPECT_NEAR(f.peak_y_n, peak.y, within) << i;
        EXPECT_NEAR(f.peak_z_n, peak.z, within) << i;
        EXPECT_NEAR(f.peak_in_plane_n, plane, within) << i;
        EXPECT_NEAR(f.peak_resultant_n, all, within) << i;
        EXPECT_NEAR(f.peak_torque_nmm, peak.torque, within * s.radius_mm) << i;
        EXPECT_NEAR(f.mean_x_n, mean.x, 0.3 * within) << i;
        EXPECT_NEAR(f.mean_y_n, mean.y, 0.3 * within) << i;
        EXPECT_NEAR(f.mean_z_n, mean.z, 0.3 * within) << i;
        EXPECT_NEAR(f.mean_in_plane_n, mean_plane, 0.3 * within) << i;
        EXPECT_NEAR(f.mean_torque_nmm, mean.torque, 0.3 * within * s.radius_mm) << i;
        EXPECT_NEAR(f.mean_power_w, f.mean_torque_nmm / 1000 * s.spindle_rpm * 2 * kPi / 60, 1e-9);
        worst = std::max(worst, std::abs(f.peak_resultant_n - all) / all);
    }
    std::printf("reference and discs: peak resultants differ by at most %.2e\n", worst);
}

// Every disc sees the whole arc once a tooth.
TEST(Forces, MeansAreTheIntegralsOverArcAndEdge) {
    std::mt19937_64 random(12);
    for (int i = 0; i < 50; ++i) {
        const CutSegment s = random_cut(random, static_cast<CutterForm>(i % 5));
        const int n = 400;
        Discs mean;
        // Section by section of the edge, for at their ends its slope may jump.
        const EdgeRun run(s);
        const double low = run.length(s.low_mm), high = run.length(s.high_mm);
        std::array<double, 4> ends{low, run.round_mm, run.round_mm + run.flank_mm, high};
        for (double& end : ends) end = std::clamp(end, low, high);
        for (std::size_t k = 0; k + 1 < ends.size(); ++k)
            for (int d = 0; d < n && ends[k + 1] > ends[k]; ++d) {
                const double db = (ends[k + 1] - ends[k]) / n;
                const EdgeRun::At at = run.at(ends[k] + (d + 0.5) * db);
                const double arc = s.arc.exit_rad - s.arc.entry_rad, share = arc / n * s.flutes / (2 * kPi);
                for (int a = 0; a < n; ++a)
                    add_disc(mean, s, s.arc.entry_rad + arc * (a + 0.5) / n, at, db * share);
            }
        const SegmentForces f = reference_forces(s);
        const double within = 2e-5 * f.peak_resultant_n;
        EXPECT_NEAR(f.mean_x_n, mean.x, within) << i;
        EXPECT_NEAR(f.mean_y_n, mean.y, within) << i;
        EXPECT_NEAR(f.mean_z_n, mean.z, within) << i;
        EXPECT_NEAR(f.mean_torque_nmm, mean.torque, within * s.radius_mm) << i;
    }
}

TEST(Forces, ReferenceIsTheClosedFormWithoutHelix) {
    const unsigned seed = 7;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 300; ++i) {
        CutSegment s = random_cut(random, CutterForm::flat);
        s.helix_rad = 0;
        const SegmentForces a = reference_forces(s, 1e-4), b = closed_form_forces(s, 1e-4);
        for (const auto member :
             {&SegmentForces::peak_x_n, &SegmentForces::peak_y_n, &SegmentForces::peak_z_n,
              &SegmentForces::peak_in_plane_n, &SegmentForces::peak_resultant_n})
            EXPECT_NEAR(a.*member, b.*member, 1e-6 * b.peak_resultant_n) << i;
        EXPECT_NEAR(a.peak_torque_nmm, b.peak_torque_nmm, 1e-6 * b.peak_torque_nmm) << i;
    }
}

TEST(Forces, ReferenceIsTheClosedFormWithHelix) {
    std::mt19937_64 random(8);
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
        const CutSegment s = random_cut(random, CutterForm::flat);
        const SegmentForces a = reference_forces(s, 1e-3), b = closed_form_forces(s, 1e-3);
        for (const auto member : {&SegmentForces::peak_x_n, &SegmentForces::peak_y_n,
                                  &SegmentForces::peak_z_n, &SegmentForces::peak_resultant_n})
            worst = std::max(worst, std::abs(a.*member - b.*member) / b.peak_resultant_n);
    }
    EXPECT_LT(worst, 1e-9);
}

TEST(Forces, PeaksAreFoundToTheStatedAccuracy) {
    std::mt19937_64 random(9);
    for (int i = 0; i < 100; ++i) {
        const CutSegment s = random_cut(random, i % 2 ? CutterForm::ball : CutterForm::flat);
        const SegmentForces exact = reference_forces(s, 1e-7);
        for (const double accuracy : {1e-2, 1e-3, 1e-4}) {
            const SegmentForces f = reference_forces(s, accuracy);
            EXPECT_LE(f.peak_resultant_n, exact.peak_resultant_n * (1 + 1e-6)) << i;
            EXPECT_GE(f.peak_resultant_n, exact.peak_resultant_n * (1 - accuracy)) << i;
        }
    }
}

// Two flutes in a slot: one enters at the very instant the other leaves. Both at once would double Fz.
TEST(Forces, SeamOfTwoTeethCountsOne) {
    CutSegment s = slot_of_luo(0);
    s.chip_load_mm = 0;
    EXPECT_NEAR(closed_form_forces(s).peak_z_n, 3 * s.coefficients.kae, 1e-12);
    EXPECT_NEAR(reference_forces(s).peak_z_n, 3 * s.coefficients.kae, 1e-12);
    EXPECT_NEAR(closed_form_forces(s).mean_z_n, 3 * s.coefficients.kae, 1e-12);
    s.flutes = 4;  // two at a time, always
    EXPECT_NEAR(closed_form_forces(s).peak_z_n, 6 * s.coefficients.kae, 1e-12);
}

TEST(Forces, HelixTooSmallToMatterChangesNothing) {
    for (const double helix : {1e-12, 1e-7, 1e-5, 1e-4, 1e-3}) {
        const SegmentForces a = closed_form_forces(slot_of_luo(0)),
                            b = closed_form_forces(slot_of_luo(helix));
        EXPECT_NEAR(a.peak_resultant_n, b.peak_resultant_n, 2e-3 * a.peak_resultant_n) << helix;
        EXPECT_NEAR(a.mean_z_n, b.mean_z_n, 1e-9) << helix;
    }
}

TEST(Forces, NothingEngagedIsNoForce) {
    CutSegment s = slot_of_luo();
    s.high_mm = 0;
    EXPECT_EQ(reference_forces(s).peak_resultant_n, 0);
    s = slot_of_luo();
    s.arc = {1, 1};
    EXPECT_EQ(closed_form_forces(s).peak_resultant_n, 0);
}

TEST(Forces, EngagementArcOfWidths) {
    EXPECT_NEAR(engagement_arc(5, 5, MillingSense::up).exit_rad, kPi / 2, 1e-12);
    EXPECT_NEAR(engagement_arc(5, 5, MillingSense::down).entry_rad, kPi / 2, 1e-12);
    EXPECT_NEAR(engagement_arc(5, 10, MillingSense::down).entry_rad, 0, 1e-12);
    EXPECT_NEAR(engagement_arc(5, 99, MillingSense::up).exit_rad, kPi, 1e-12);
    EXPECT_THROW((void)engagement_arc(0, 1, MillingSense::up), Error);
    EXPECT_THROW((void)engagement_arc(1, std::nan(""), MillingSense::up), Error);
}

// Why a slot is cut in rings and not in the loops of a trochoid (METHOD.md section 9): where it has to bear
// less, several passes, each as deep, take a shorter way than ever narrower ones, whatever the wood.
TEST(Forces, OfASlotFallFasterByDepthThanByWidth) {
    std::mt19937_64 random(24);
    for (int trial = 0; trial < 300; ++trial) {
        CutSegment slot = random_cut(random, CutterForm::flat);
        slot.low_mm = 0;
        slot.arc = {0, kPi};
        const double diameter = 2 * slot.radius_mm, depth = slot.high_mm;
        for (const double share : {0.7, 0.5, 0.3, 0.2, 0.1, 0.05}) {
            CutSegment narrow = slot;
            narrow.arc = engagement_arc(slot.radius_mm, share * diameter, MillingSense::down);
            const double bears = closed_form_forces(narrow).peak_in_plane_n;
            int passes = 1;
            for (CutSegment shallow = slot; passes < 1000; ++passes) {
                shallow.high_mm = depth / passes;
                if (closed_form_forces(shallow).peak_in_plane_n <= bears * (1 + 1e-3)) break;
            }
            // A loop for each `share` of the diameter, each at least half a turn about a slot's middle.
            EXPECT_LE(passes, std::max(1.0, std::ceil(1 / share))) << "trial " << trial << " width " << share;
        }
    }
    // In MDF, by a shop's 1/2 in flat end mill.
    CutSegment slot = slot_of_luo();
    slot.high_mm = 19;
    slot.chip_load_mm = 0.2;
    slot.coefficients =
        resolve_coefficients({8.8575, 1.1268, 0.6188, 2.4948}, kPi / 6, CoefficientTransform::oblique);
    const double most = closed_form_forces(slot).peak_in_plane_n;
    for (const auto& [share, bears] : {std::pair{0.5, 0.9}, std::pair{0.2, 0.5}, std::pair{0.1, 0.35}}) {
        slot.arc = engagement_arc(slot.radius_mm, share * 2 * slot.radius_mm, MillingSense::down);
        EXPECT_NEAR(closed_form_forces(slot).peak_in_plane_n / most, bears, 0.02) << share;
    }
}

TEST(Forces, SegmentsOutOfRangeAreRefused) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    auto refused = [](auto&& spoil) {
        CutSegment s = slot_of_luo();
        spoil(s);
        try {
            (void)reference_forces(s);
        } catch (const Error& e) {
            return e.code() == "forces.segment" && e.kind() == ErrorKind::usage;
        }
        return false;
    };
    EXPECT_TRUE(refused([](CutSegment& s) { s.flutes = 0; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.radius_mm = 0; }));
    EXPECT_TRUE(refused([&](CutSegment& s) { s.radius_mm = nan; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.helix_rad = 1.5; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.low_mm = 4; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.high_mm = 1e9; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.arc.exit_rad = 4; }));
    EXPECT_TRUE(refused([&](CutSegment& s) { s.chip_load_mm = nan; }));
    EXPECT_TRUE(refused([](CutSegment& s) { s.spindle_rpm = -1; }));
    EXPECT_TRUE(refused([&](CutSegment& s) { s.coefficients.kae = nan; }));
    CutSegment ball = slot_of_luo();
    ball.corner_mm = ball.radius_mm;
    EXPECT_THROW((void)closed_form_forces(ball), Error);
}

TEST(ForceSolver, DeviceIsTheReferenceWithin1e4OfThePeak) {
    const unsigned seed = 10000;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    Context context;
    ForceSolver solver(context);
    std::printf("device: %s%s%s\n", solver.device().c_str(), solver.note().empty() ? "" : ", ",
                solver.note().c_str());
    if (!solver.on_device()) {
        EXPECT_EQ(solver.device(), "reference");
        EXPECT_FALSE(solver.note().empty());
        // None at all is a machine's right; one that is there and computes wrongly is an error of ours.
        EXPECT_EQ(solver.note().rfind("no OpenCL device (", 0), 0u) << solver.note();
        std::printf("skipped: no OpenCL device\n");
        return;
    }
    std::vector<CutSegment> cuts(10000);
    for (std::size_t i = 0; i < cuts.size(); ++i)
        cuts[i] = random_cut(random, i % 50 == 49 ? CutterForm::bull_nose
                                     : i % 2      ? CutterForm::ball
                                                  : CutterForm::flat);
    std::vector<SegmentForces> found(cuts.size());
    solver.solve(context, cuts, found);
    double worst[2] = {0, 0};
    for (std::size_t i = 0; i < cuts.size(); ++i) {
        const double d = difference(found[i], reference_forces(cuts[i]), cuts[i].radius_mm);
        ASSERT_LE(d, 1e-4) << "cut " << i;
        worst[i % 2] = std::max(worst[i % 2], d);
        EXPECT_NEAR(found[i].mean_power_w, found[i].mean_torque_nmm * 2 * kPi * cuts[i].spindle_rpm / 60000,
                    1e-9 * (1 + found[i].mean_power_w));
    }
    std::printf("device and reference differ by at most %.1e (flat), %.1e (ball) of the peak resultant\n",
                worst[0], worst[1]);
}

// More segments than are on the way at once, an odd number, on one thread and on all, on the device and by
// reference.
TEST(ForceSolver, StreamsAnyNumberInOrder) {
    std::mt19937_64 random(11);
    std::vector<CutSegment> few(97);
    for (std::size_t i = 0; i < few.size(); ++i)
        few[i] = random_cut(random, i % 2 ? CutterForm::ball : CutterForm::flat);
    std::vector<CutSegment> cuts(100003);
    for (std::size_t i = 0; i < cuts.size(); ++i) cuts[i] = few[i % few.size()];
    Context all, one({.threads = 1});
    ForceSolver solver(all), narrow(one), reference(all, "reference");
    EXPECT_FALSE(reference.on_device());
    std::vector<SegmentForces> found(cuts.size()), again(cuts.size()), expected(few.size());
    reference.solve(all, few, expected);
    solver.solve(all, cuts, found, 1e-2);
    narrow.solve(one, cuts, again, 1e-2);
    reference.solve(one, few, expected, 1e-2);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
        ASSERT_LE(difference(found[i], expected[i % few.size()], cuts[i].radius_mm),
                  solver.on_device() ? 1e-4 : 0.0)
            << i;
        ASSERT_EQ(found[i].peak_resultant_n, again[i].peak_resultant_n) << i;
        ASSERT_EQ(found[i].mean_x_n, found[i % few.size()].mean_x_n) << i;
    }
    solver.solve(all, {}, {});
}

/// Seconds of the processor that each thread of this process has had, as the system tells them; nothing where
/// it tells none.
std::map<std::string, double> seconds_by_thread() {
    std::map<std::string, double> seconds;
    std::error_code none;
    for (std::filesystem::directory_iterator at("/proc/self/task", none), end; !none && at != end;
         at.increment(none)) {
        std::ifstream file(at->path() / "schedstat");
        if (double ns = 0; file >> ns) seconds[at->path().filename().string()] = ns * 1e-9;
    }
    return seconds;
}

// A device that is the processor would take all of its cores.
TEST(ForceSolver, ADeviceTakesNoMoreCoresThanTheContextHasThreads) {
    std::mt19937_64 random(test::seed());
    std::vector<CutSegment> cuts(4000);
    for (CutSegment& cut : cuts) cut = random_cut(random, CutterForm::ball);
    std::vector<SegmentForces> found(cuts.size());
    Context one({.threads = 1});
    ForceSolver solver(one);
    solver.solve(one, cuts, found);  // whatever is yet to be compiled
    const std::map<std::string, double> before = seconds_by_thread();
    solver.solve(one, cuts, found, 1e-7);
    std::vector<double> busy{0, 0};
    for (const auto& [thread, seconds] : seconds_by_thread()) {
        const auto known = before.find(thread);
        if (thread != std::to_string(gettid()))
            busy.push_back(seconds - (known == before.end() ? 0 : known->second));
    }
    std::sort(busy.rbegin(), busy.rend());
    std::printf("the busiest of the device's threads took %.3f s, the next %.3f s\n", busy[0], busy[1]);
    EXPECT_LE(busy[1], 0.002 + 0.1 * busy[0]) << solver.device();
}

TEST(ForceSolver, NamesTheBadSegmentAndCanBeCancelled) {
    Context context;
    ForceSolver solver(context);
    std::vector<CutSegment> cuts(5000, slot_of_luo());
    std::vector<SegmentForces> found(cuts.size());
    cuts[3456].chip_load_mm = -1;
    cuts[4999].chip_load_mm = -1;
    try {
        solver.solve(context, cuts, found);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.place(), "segment 3456");
    }
    found.resize(3);
    EXPECT_THROW(solver.solve(context, cuts, found), Error);
    found.resize(cuts.size());
    context.cancel();
    try {
        solver.solve(context, cuts, found);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::cancelled);
    }
}

TEST(ForceSolver, UnknownDeviceIsAnError) {
    Context context;
    try {
        ForceSolver solver(context, "no such device");
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "forces.device");
        EXPECT_FALSE(e.remedy().empty());
    }
}

// What a device screens and what the double model finds alone are the same cuts, also where many are nearly
// as hard.
TEST(HardestCuts, AreTheSameWithADeviceAndWithout) {
    const unsigned seed = test::seed();
    std::mt19937_64 random(seed);
    std::vector<CutSegment> cuts;
    std::vector<std::size_t> starts{0};
    for (int g = 0; g < 40; ++g) {
        const CutSegment like = random_cut(random, g % 2 ? CutterForm::ball : CutterForm::flat);
        const std::size_t n = random() % 300;
        for (std::size_t i = 0; i < n; ++i) {
            cuts.push_back(g % 3 ? like : random_cut(random, g % 2 ? CutterForm::ball : CutterForm::flat));
            if (g % 3) cuts.back().chip_load_mm *= 1 - drawn(random, 0, 1e-4);
            if (g % 3 == 2 && i % 2) cuts.back() = cuts[starts.back()];
        }
        starts.push_back(cuts.size());
    }
    Context context;
    SolverAhead ahead(context, 0);
    ahead.expect(cuts);
    ASSERT_NE(ahead.solver(), nullptr);
    const HardestSearch with = hardest_cuts(context, cuts, starts, ahead.solver()),
                        without = hardest_cuts(context, cuts, starts, nullptr);
    std::printf("device: %s\n", with.device.c_str());
    EXPECT_TRUE(without.device.empty());
    ASSERT_EQ(with.groups.size(), starts.size() - 1);
    EXPECT_EQ(with.groups, without.groups);
    // A solver that has no device leaves all of it to the double model, and says why.
    ForceSolver reference(context, "reference");
    const HardestSearch fallen_back = hardest_cuts(context, cuts, starts, &reference);
    EXPECT_EQ(fallen_back.groups, without.groups);
    EXPECT_EQ(fallen_back.device, "reference");
    EXPECT_EQ(fallen_back.note, reference.note());
    EXPECT_EQ(with.note, ahead.solver()->on_device() ? "" : ahead.solver()->note());
    for (std::size_t g = 0; g + 1 < starts.size(); ++g) {
        double most = 0;
        for (std::size_t i = starts[g]; i < starts[g + 1]; ++i)
            most = std::max(most, reference_forces(cuts[i]).peak_y_n);
        if (starts[g] == starts[g + 1]) EXPECT_EQ(with.groups[g].across, kNoCut);
        else EXPECT_NEAR(reference_forces(cuts[with.groups[g].across]).peak_y_n, most, 1e-9 * most);
    }
}

// Cuts of different geometry whose peaks differ by less than a device can tell, each the hardest of its group
// by the device's errors as likely as not.
TEST(HardestCuts, AreNotADevicesChoiceAmongEquals) {
    const unsigned seed = test::seed();
    std::mt19937_64 random(seed);
    std::vector<CutSegment> cuts;
    std::vector<std::size_t> starts{0};
    for (int g = 0; g < 40; ++g) {
        for (int i = 0; i < 8; ++i) {
            CutSegment cut = random_cut(random, CutterForm::flat);
            // Forces are proportional to the coefficients, all of them together.
            const double scale =
                100 * (1 - drawn(random, 0, 1e-7)) / closed_form_forces(cut).peak_resultant_n;
            for (double* k : {&cut.coefficients.ktc, &cut.coefficients.krc, &cut.coefficients.kac,
                              &cut.coefficients.kte, &cut.coefficients.kre, &cut.coefficients.kae})
                *k *= scale;
            cuts.push_back(cut);
        }
        starts.push_back(cuts.size());
    }
    Context context;
    ForceSolver solver(context);
    if (!solver.on_device()) std::printf("no device to be doubted: %s\n", solver.note().c_str());
    const HardestSearch with = hardest_cuts(context, cuts, starts, &solver),
                        without = hardest_cuts(context, cuts, starts, nullptr);
    ASSERT_EQ(with.groups.size(), without.groups.size());
    for (std::size_t g = 0; g < with.groups.size(); ++g)
        EXPECT_EQ(with.groups[g].all(), without.groups[g].all()) << "group " << g;
}

TEST(SolverAhead, OpensOneWhenAllThatIsExpectedIsWorthIt) {
    Context context, without({.device = "reference"});
    std::vector<CutSegment> cuts(1000, slot_of_luo());
    SolverAhead ahead(context), never(without);
    const auto flats =
        static_cast<std::size_t>(kDeviceWorthSeconds / 8e-6 / static_cast<double>(cuts.size()));
    for (std::size_t i = 0; i + 2 < flats; ++i) ahead.expect(cuts), never.expect(cuts);
    EXPECT_EQ(ahead.solver(), nullptr);
    for (std::size_t i = 0; i < 4; ++i) ahead.expect(cuts), never.expect(cuts);
    ForceSolver* const solver = ahead.solver();
    ASSERT_NE(solver, nullptr);
    ahead.expect(cuts);
    EXPECT_EQ(ahead.solver(), solver);
    EXPECT_EQ(never.solver(), nullptr);
    ForceSolver device(context);
    EXPECT_EQ(solver->device(), device.device());
}

TEST(SolverAhead, ThrowsWhatOpeningOneThrew) {
    Context context({.device = "no such device"});
    SolverAhead ahead(context, 0);
    ahead.expect(std::vector<CutSegment>(1, slot_of_luo()));
    EXPECT_THROW((void)ahead.solver(), Error);
    SolverAhead unasked(context, 0);  // what was opened and not asked for is let go
    unasked.expect(std::vector<CutSegment>(1, slot_of_luo()));
}

// Threads of the default size cannot begin while this lives: their stacks would be larger than memory can be.
class NoThreadBegins {
public:
    NoThreadBegins() {
        pthread_getattr_default_np(&kept_);
        pthread_attr_t vast;
        pthread_attr_init(&vast);
        pthread_attr_setstacksize(&vast, std::size_t{1} << 50);
        pthread_setattr_default_np(&vast);
        pthread_attr_destroy(&vast);
    }
    ~NoThreadBegins() {
        pthread_setattr_default_np(&kept_);
        pthread_attr_destroy(&kept_);
    }
    NoThreadBegins(const NoThreadBegins&) = delete;
    NoThreadBegins& operator=(const NoThreadBegins&) = delete;

private:
    pthread_attr_t kept_{};
};

TEST(SolverAhead, OpensOneWhereItIsAskedForIfThereIsNoThread) {
    const std::vector<CutSegment> cuts(1, slot_of_luo());
    Context context, wrong({.device = "no such device"});
    SolverAhead ahead(context, 0), fails(wrong, 0);
    {
        const NoThreadBegins none;
        ASSERT_THROW(std::thread([] {}).join(), std::system_error);
        ASSERT_NO_THROW(ahead.expect(cuts));
        ASSERT_NO_THROW(fails.expect(cuts));
    }
    ForceSolver* const solver = ahead.solver();
    ASSERT_NE(solver, nullptr);
    EXPECT_EQ(solver->device(), ForceSolver(context).device());
    EXPECT_THROW((void)fails.solver(), Error);
}

TEST(PeakForce, IsThatOfTheClosedFormOrTheReference) {
    CutSegment s = slot_of_luo();
    EXPECT_EQ(peak_force(s).peak_resultant_n, closed_form_forces(s, 1e-5).peak_resultant_n);
    EXPECT_EQ(peak_force(s).peak_axial_n, closed_form_forces(s, 1e-5).peak_z_n);
    s.corner_mm = s.radius_mm;
    EXPECT_EQ(peak_force(s).peak_resultant_n, reference_forces(s, 1e-5).peak_resultant_n);
    EXPECT_GT(peak_force(s).power_w, 0);
}

TEST(Deflection, LengthAndDeflectionAreInverse) {
    for (const double f : {1.0, 33.0, 200.0})
        for (const double d : {3.175, 6.35, 25.4})
            EXPECT_NEAR(cutter_deflection(f, allowed_tool_length(f, 0.0508, d), d), 0.0508, 1e-12);
    // L ∝ d^(4/3) at one force.
    EXPECT_NEAR(allowed_tool_length(10, 0.05, 8) / allowed_tool_length(10, 0.05, 1), 16, 1e-9);
    EXPECT_TRUE(std::isinf(allowed_tool_length(0, 0.05, 8)));
    EXPECT_THROW((void)cutter_deflection(1, 1, 0), Error);
    EXPECT_THROW((void)least_overhang_thickness({}), Error);
    // A steel-like beam worked by hand: d 10, J = π·8⁴/64 = 201.06 mm⁴; 100 N at 50 mm: 12.5e6 /
    // (3·200e3·201.06) = 0.10362 mm.
    EXPECT_NEAR(cutter_deflection(100, 50, 10), 0.10362, 1e-5);
    // Of carbide it bends by as much less as that is stiffer, and may be longer by the cube root of it.
    EXPECT_NEAR(cutter_deflection(100, 50, 10, 550e3), 0.10362 * 200 / 550, 1e-5);
    EXPECT_NEAR(allowed_tool_length(100, 0.10362, 10, 550e3), 50 * std::cbrt(550.0 / 200), 1e-3);
    EXPECT_THROW((void)cutter_deflection(1, 1, 1, 0), Error);
}

// An operation of one straight move at `feed`.
Operation straight(OperationKind kind, double stepdown, double stepover, std::uint32_t feed) {
    Operation op;
    op.kind = kind;
    op.stepdown = stepdown;
    op.stepover = stepover;
    op.spindle_rpm = 18000;
    op.moves = {{0, 0, 100000, 0}, {0, 0, 0, 1000}, {500000, 0, 0, feed}, {500000, 0, 100000, 0}};
    return op;
}

TEST(RateOperation, GrowsWithFeedDepthAndStickout) {
    Job job;
    Tool flat = job.tools[1];
    flat.flute_length = flat.stickout;
    Operation slow = straight(OperationKind::rough, 3, 6.35, 3000),
              fast = straight(OperationKind::rough, 3, 6.35, 9000),
              deep = straight(OperationKind::rough, 6, 6.35, 3000);
    for (Operation* op : {&slow, &fast, &deep}) rate_operation(*op, flat, job);
    EXPECT_GT(fast.peak_force_n, slow.peak_force_n);
    EXPECT_GT(deep.peak_force_n, 1.8 * slow.peak_force_n);
    // By hand: the closed form of the same cut.
    CutSegment s;
    s.radius_mm = 6.35;
    s.helix_rad = flat.helix_rad;
    s.high_mm = 3;
    s.arc = {0, kPi};
    s.chip_load_mm = 3000.0 / 18000 / 2;
    s.coefficients =
        resolve_coefficients({8.8575, 1.1268, 0.6188, 2.4948}, flat.helix_rad, CoefficientTransform::oblique);
    const SegmentForces f = closed_form_forces(s, 1e-5);
    EXPECT_NEAR(slow.peak_force_n, f.peak_resultant_n, 1e-12);
    EXPECT_NEAR(slow.deflection_mm, cutter_deflection(f.peak_in_plane_n, flat.stickout, flat.diameter),
                1e-12);
    Tool longer = flat;
    longer.flute_length = longer.stickout *= 2;
    Operation op = straight(OperationKind::rough, 3, 6.35, 3000);
    rate_operation(op, longer, job);
    EXPECT_NEAR(op.deflection_mm, 8 * slow.deflection_mm, 1e-9);
}

TEST(RateOperation, FinishingIsLighterThanRoughing) {
    Job job;
    Operation rough = straight(OperationKind::rough, 3, 0, 5000),
              levels = straight(OperationKind::finish, 1, 0, 5000),
              raster = straight(OperationKind::finish, 0, 0.8, 5000);
    rate_operation(rough, job.tools[1], job);
    rate_operation(levels, job.tools[2], job);
    rate_operation(raster, job.tools[2], job);
    EXPECT_GT(levels.peak_force_n, 0);
    EXPECT_GT(raster.peak_force_n, 0);
    EXPECT_LT(levels.peak_force_n, rough.peak_force_n);
    EXPECT_LT(raster.peak_force_n, rough.peak_force_n);
}

TEST(RateOperation, PlungesAndRapidsAreNoMilling) {
    Job job;
    Operation op = straight(OperationKind::rough, 3, 0, 5000);
    op.moves = {{0, 0, 100000, 0}, {0, 0, 0, 9000}, {0, 0, 100000, 0}};
    rate_operation(op, job.tools[1], job);
    EXPECT_EQ(op.peak_force_n, 0);
    EXPECT_EQ(op.deflection_mm, 0);
    op = straight(OperationKind::rough, 3, 0, 5000);
    op.spindle_rpm = 0;
    EXPECT_THROW(rate_operation(op, job.tools[1], job), Error);
}

}  // namespace
}  // namespace slabwright
