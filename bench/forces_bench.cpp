// Segments a second of the force kernel, on the OpenCL device that the self-test chooses and on C++ beside
// it, in one run on the same cuts with the same threads: the scalar double model; the kernel's integrals at
// every instant by hand in vectors of 8 and 16; and the obvious way, discs and angles with angle addition in
// vectors of 16, some 7200 evaluations a segment. This file is compiled with -O3 -march=native
// -fno-math-errno. GFLOP/s count the operations of the inner loops, without comparisons; the machine's peak
// is a loop of fused multiply-adds, which count twice.
//
// Every way's peak resultants are compared with the reference first; a benchmark of wrong forces stops the
// program.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "kernels/forces/forces.h"
#include "kernels/forces/turn.h"
#include "kernels/geometry/wide.h"
#include "kernels/parallel/parallel.h"

namespace {

using namespace slabwright;

enum Sort : int { flat_cuts, ball_cuts };

/// Cuts as a program holds them: 1/2 in flat end mill roughing, 1/4 in ball finishing, two flutes.
const std::vector<CutSegment>& cuts(int sort) {
    static std::vector<CutSegment> made[2];
    std::vector<CutSegment>& all = made[sort];
    if (!all.empty()) return all;
    std::mt19937_64 random(3);
    auto drawn = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    all.resize(1 << 17);
    for (CutSegment& s : all) {
        s.radius_mm = sort == ball_cuts ? 3.175 : 6.35;
        s.corner_mm = sort == ball_cuts ? s.radius_mm : 0;
        s.helix_rad = std::numbers::pi / 6;
        s.high_mm = sort == ball_cuts ? drawn(0.3, 3.0) : drawn(1, 4);
        s.arc = engagement_arc(s.radius_mm, drawn(0.1, 2.2) * s.radius_mm,
                               random() % 2 ? MillingSense::up : MillingSense::down);
        s.chip_load_mm = drawn(0.05, 0.3);
        s.spindle_rpm = 18000;
        s.coefficients = resolve_coefficients({8.8575, 1.1268, 0.6188, 2.4948}, s.helix_rad,
                                              CoefficientTransform::oblique);
    }
    return all;
}

/// Floating-point operations for these cuts: of the kernel, which takes what all instants with a whole tooth
/// share once, or of the same integrals taken at every instant.
double operations(const std::vector<CutSegment>& all, bool tooth_once) {
    double sum = 0;
    for (const CutSegment& s : all) {
        const forces::Turn t = forces::make_turn(s);
        const bool ball = s.ball();
        const double every = ball ? 15 + 6 * 61 : 84, whole = tooth_once ? 52 : every;
        if (tooth_once && t.lag_per_mm * (t.high - t.low) < t.exit - t.entry)
            sum += ball ? 8 * 90 + 12 * 7 : 60;
        for (int p = 0; p < t.count; ++p) {
            const forces::Turn::Piece& piece = t.pieces[static_cast<std::size_t>(p)];
            const forces::Teeth teeth = forces::teeth_in(t, piece);
            const int n = forces::samples_of(piece, forces::sample_angle(kForceAccuracy));
            sum += n * 8;
            for (int m = teeth.first; m <= teeth.last; ++m) {
                const double middle = piece.begin + piece.length / 2 + m * t.pitch;
                const bool changes = t.lag_per_mm > 0 && (middle - t.lag_per_mm * t.high < t.entry ||
                                                          middle - t.lag_per_mm * t.low > t.exit);
                sum += n * (changes ? every : whole);
            }
        }
    }
    return sum;
}

template <int W>
struct Lanes {
    typedef float Vector __attribute__((vector_size(W * sizeof(float))));
};

template <class V>
V larger(V a, V b) {
    return a > b ? a : b;
}
template <class V>
V smaller(V a, V b) {
    return a < b ? a : b;
}
template <class V>
V absolute(V a) {
    return a < 0 ? -a : a;
}
template <int W, class V>
V root(V a) {
    V r{};
    for (int i = 0; i < W; ++i) r[i] = std::sqrt(a[i]);
    return r;
}
template <class V>
V sinc(V x2) {
    return 1.0f + x2 * (-1.6666666e-1f + x2 * (8.3333333e-3f + x2 * (-1.9841270e-4f + x2 * 2.7180e-6f)));
}
template <class V>
V cosine(V x2) {
    return 1.0f + x2 * (-0.5f + x2 * (4.1666667e-2f +
                                      x2 * (-1.3888889e-3f + x2 * (2.4801587e-5f + x2 * -2.7152e-7f))));
}

/// Peaks of one lane set, gathered.
template <int W>
struct Peaks {
    using V = typename Lanes<W>::Vector;
    V x{}, y{}, z{}, plane{}, all{}, torque{}, mean{};
    void add(V fx, V fy, V fz, V ft, V share) {
        const V plane2 = fx * fx + fy * fy, in_plane = root<W>(plane2);
        x = larger(x, absolute(fx)), y = larger(y, absolute(fy)), z = larger(z, absolute(fz)),
        torque = larger(torque, absolute(ft));
        plane = larger(plane, in_plane), all = larger(all, plane2 + fz * fz);
        mean += share * in_plane;
    }
    static float most(V v) {
        float m = v[0];
        for (int i = 1; i < W; ++i) m = std::max(m, v[i]);
        return m;
    }
    void give(SegmentForces& f, double pitch) const {
        f.peak_x_n = most(x), f.peak_y_n = most(y), f.peak_z_n = most(z), f.peak_in_plane_n = most(plane);
        f.peak_resultant_n = std::sqrt(most(all)), f.peak_torque_nmm = most(torque);
        float sum = 0;
        for (int i = 0; i < W; ++i) sum += mean[i];
        f.mean_in_plane_n = sum / pitch;
    }
};

/// The kernel's integrals, taken at every instant, by hand in vectors of W.
template <int W>
void by_hand(const CutSegment& s, SegmentForces& out) {
    using V = typename Lanes<W>::Vector;
    const forces::Turn t = forces::make_turn(s);
    out = {};
    const double angle = forces::sample_angle(kForceAccuracy);
    const float c = static_cast<float>(s.chip_load_mm), tc = static_cast<float>(s.coefficients.ktc) * c,
                rc = static_cast<float>(s.coefficients.krc) * c,
                ac = static_cast<float>(s.coefficients.kac) * c, te = static_cast<float>(s.coefficients.kte),
                re = static_cast<float>(s.coefficients.kre), ae = static_cast<float>(s.coefficients.kae);
    const float radius = static_cast<float>(s.radius_mm), lag = static_cast<float>(t.lag_per_mm),
                inverse_lag = lag > 0 ? 1 / lag : 0;
    const float entry = static_cast<float>(t.entry), exit = static_cast<float>(t.exit),
                low = static_cast<float>(t.low), high = static_cast<float>(t.high);
    const bool ball = s.ball();
    constexpr float node[6] = {-0.93246951f, -0.66120939f, -0.23861919f,
                               0.23861919f,  0.66120939f,  0.93246951f};
    constexpr float weight[6] = {0.17132449f, 0.36076157f, 0.46791393f,
                                 0.46791393f, 0.36076157f, 0.17132449f};
    V lane;
    for (int i = 0; i < W; ++i) lane[i] = static_cast<float>(i);
    Peaks<W> peaks;
    for (int p = 0; p < t.count; ++p) {
        const forces::Turn::Piece& piece = t.pieces[static_cast<std::size_t>(p)];
        const forces::Teeth teeth = forces::teeth_in(t, piece);
        const int blocks = (forces::samples_of(piece, angle) + W - 1) / W;
        const float length = static_cast<float>(piece.length),
                    step = length / static_cast<float>(blocks * W - 1);
        for (int b = 0; b < blocks; ++b) {
            const V index = lane + static_cast<float>(b * W);
            V x{}, y{}, z{}, torque{};
            for (int m = teeth.first; m <= teeth.last; ++m) {
                const float begin = static_cast<float>(piece.begin + m * t.pitch),
                            middle = begin + 0.5f * length;
                const V u = begin + index * step;
                V zl = V{} + low, zh = V{} + high;
                if (lag > 0) {
                    if (middle - lag * high < entry)
                        zh = smaller(larger((u - entry) * inverse_lag, V{} + low), V{} + high);
                    if (middle - lag * low > exit)
                        zl = smaller(larger((u - exit) * inverse_lag, V{} + low), V{} + high);
                }
                zh = larger(zh, zl);
                if (ball && low < radius) {
                    const float half_inverse = 0.5f / radius;
                    const V qa = root<W>(smaller(zl, V{} + radius) * half_inverse),
                            qb = root<W>(smaller(zh, V{} + radius) * half_inverse);
                    const V half_q = 0.5f * (qb - qa), mid_q = 0.5f * (qb + qa);
                    V bx{}, by{}, bz{}, bt{};
                    for (int i = 0; i < 6; ++i) {
                        const V q = mid_q + half_q * node[i], q2 = q * q, r = root<W>(1.0f - q2),
                                sin_k = 2.0f * q * r, cos_k = 1.0f - 2.0f * q2;
                        const V a = u - 2.0f * radius * lag * q2 - 1.57079633f, a2 = a * a,
                                sin_p = cosine(a2), cos_p = -a * sinc(a2);
                        const V h = sin_p * sin_k, db = weight[i] / r, ft = (tc * h + te) * db,
                                fr = (rc * h + re) * db, fa = (ac * h + ae) * db;
                        const V inward = fr * sin_k + fa * cos_k;
                        bx -= ft * cos_p + inward * sin_p;
                        by += ft * sin_p - inward * cos_p;
                        bz += fa * sin_k - fr * cos_k;
                        bt += ft * sin_k;
                    }
                    const V edge = 2.0f * radius * half_q;
                    x += bx * edge, y += by * edge, z += bz * edge, torque += bt * edge;
                    zl = larger(zl, V{} + radius), zh = larger(zh, V{} + radius);
                }
                if (!ball || high > radius) {
                    const V edge = zh - zl, a = u - 0.5f * lag * (zh + zl) - 1.57079633f,
                            delta = 0.5f * lag * edge, a2 = a * a, d2 = delta * delta;
                    const V one = sinc(d2), two = one * cosine(d2), sin_p = cosine(a2), cos_p = -a * sinc(a2);
                    const V s1 = sin_p * one, c1 = cos_p * one, s2 = sin_p * cos_p * two,
                            ss = 0.5f - (0.5f - sin_p * sin_p) * two;
                    x -= edge * (tc * s2 + te * c1 + rc * ss + re * s1);
                    y += edge * (tc * ss + te * s1 - rc * s2 - re * c1);
                    z += edge * (ac * s1 + ae);
                    torque += edge * (tc * s1 + te);
                }
            }
            V share = V{} + step;
            if (b == 0) share[0] *= 0.5f;
            if (b + 1 == blocks) share[W - 1] *= 0.5f;
            peaks.add(x, y, z, torque * radius, share);
        }
    }
    if (t.count == 0) return;
    peaks.give(out, t.pitch);
    forces::set_means(s, t, out);
}

constexpr int kAngles = 96, kDiscs = 38;  ///< of a pitch, and of the edge: 96·38·2 = 7296 evaluations

/// Discs that cut whole or not at all; the tooth's sine and cosine go from disc to disc by angle addition.
void by_discs(const CutSegment& s, SegmentForces& out) {
    using V = Lanes<16>::Vector;
    out = {};
    const ForceCoefficients& k = s.coefficients;
    const float c = static_cast<float>(s.chip_load_mm), ktc = static_cast<float>(k.ktc),
                krc = static_cast<float>(k.krc), kac = static_cast<float>(k.kac),
                kte = static_cast<float>(k.kte), kre = static_cast<float>(k.kre),
                kae = static_cast<float>(k.kae);
    const float radius = static_cast<float>(s.radius_mm);
    const bool ball = s.ball();
    const double lag = std::tan(s.helix_rad) / s.radius_mm, pitch = 2 * std::numbers::pi / s.flutes;
    auto edge_at = [&](double z) {
        if (!ball) return z;
        return z < s.radius_mm ? s.radius_mm * std::acos(1 - z / s.radius_mm)
                               : s.radius_mm * (std::numbers::pi / 2 - 1) + z;
    };
    const double e0 = edge_at(s.low_mm), de = (edge_at(s.high_mm) - e0) / kDiscs;
    const float db = static_cast<float>(de);
    // Slope and lag of every disc, these by angle addition and polynomials too.
    float sin_k[kDiscs], cos_k[kDiscs], turn_s[kDiscs], turn_c[kDiscs], last = 0;
    const float dk = ball ? db / radius : 0, dk_s = std::sin(dk), dk_c = std::cos(dk);
    float sk = ball ? std::sin(static_cast<float>((e0 + de / 2) / s.radius_mm)) : 1,
          ck = ball ? std::cos(static_cast<float>((e0 + de / 2) / s.radius_mm)) : 0;
    for (int d = 0; d < kDiscs; ++d) {
        const float e = static_cast<float>(e0) + (static_cast<float>(d) + 0.5f) * db;
        const bool shank = !ball || e > radius * 1.57079633f;
        sin_k[d] = shank ? 1 : sk, cos_k[d] = shank ? 0 : ck;
        const float z = !ball   ? e
                        : shank ? e - radius * 0.57079633f
                                : radius * (1 - ck),
                    a = static_cast<float>(lag) * (z - last);
        turn_s[d] = a * sinc(a * a), turn_c[d] = cosine(a * a);
        last = z;
        const float next = sk * dk_c + ck * dk_s;
        ck = ck * dk_c - sk * dk_s;
        sk = next;
    }
    // The grid of angles is the same for all segments of two flutes.
    struct Grid {
        V sine[2][kAngles / 16], cosine[2][kAngles / 16];
    };
    static const Grid grid = [] {
        Grid g;
        for (int j = 0; j < 2; ++j)
            for (int a = 0; a < kAngles; ++a) {
                const double theta = std::numbers::pi * ((a + 0.5) / kAngles + j);
                g.sine[j][a / 16][a % 16] = static_cast<float>(std::sin(theta)),
                                      g.cosine[j][a / 16][a % 16] = static_cast<float>(std::cos(theta));
            }
        return g;
    }();
    const float entry = static_cast<float>(s.arc.entry_rad), exit = static_cast<float>(s.arc.exit_rad);
    const float cos_entry = std::cos(entry), cos_exit = std::cos(exit);
    Peaks<16> peaks;
    for (int b = 0; b < kAngles / 16; ++b) {
        V x{}, y{}, z{}, torque{};
        for (int j = 0; j < 2; ++j) {
            V sine = grid.sine[j][b], cosn = grid.cosine[j][b];
            for (int d = 0; d < kDiscs; ++d) {
                const V sn = sine * turn_c[d] - cosn * turn_s[d];
                cosn = cosn * turn_c[d] + sine * turn_s[d];
                sine = sn;
                // Within 0 … π the cosine falls: engaged while it lies between those of the limits.
                const V in = ((sine > 0.0f) & (cosn <= cos_entry) & (cosn >= cos_exit)) ? V{} + db : V{};
                const V h = c * sine * sin_k[d], ft = (ktc * h + kte) * in, fr = (krc * h + kre) * in,
                        fa = (kac * h + kae) * in;
                const V inward = fr * sin_k[d] + fa * cos_k[d];
                x -= ft * cosn + inward * sine;
                y += ft * sine - inward * cosn;
                z += fa * sin_k[d] - fr * cos_k[d];
                torque += ft * sin_k[d];
            }
        }
        peaks.add(x, y, z, torque * radius, V{} + static_cast<float>(pitch / kAngles));
    }
    peaks.give(out, pitch);
    const forces::Turn t = forces::make_turn(s);
    if (t.count > 0) forces::set_means(s, t, out);
}

void scalar(const CutSegment& s, SegmentForces& out) {
    out = s.flat() ? closed_form_forces(s) : reference_forces(s);
}

/// Stops the program unless the forces are right.
void check(const char* way, const std::vector<CutSegment>& all, const std::vector<SegmentForces>& found,
           double within) {
    double worst = 0;
    for (std::size_t i = 0; i < all.size(); i += 97) {
        const SegmentForces f = reference_forces(all[i]);
        worst =
            std::max(worst, std::abs(f.peak_resultant_n - found[i].peak_resultant_n) / f.peak_resultant_n);
    }
    if (!(worst <= within)) {
        std::fprintf(stderr, "forces_bench: %s is wrong by %.1e\n", way, worst);
        std::exit(1);
    }
}

void report(benchmark::State& state, const std::vector<CutSegment>& all, double operations) {
    state.counters["segments/s"] =
        benchmark::Counter(static_cast<double>(all.size()), benchmark::Counter::kIsIterationInvariantRate);
    if (operations > 0)
        state.counters["flop/s"] =
            benchmark::Counter(operations, benchmark::Counter::kIsIterationInvariantRate);
}

template <class Way>
void run(benchmark::State& state, const char* name, Way way, double within, double operations) {
    const std::vector<CutSegment>& all = cuts(static_cast<int>(state.range(0)));
    Context context({.threads = static_cast<int>(state.range(1))});
    std::vector<SegmentForces> out(all.size());
    auto solve = [&] {
        parallel_for(context, all.size(), 512, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) way(all[i], out[i]);
        });
    };
    solve();
    check(name, all, out, within);
    for (auto _ : state) solve();
    report(state, all, operations);
}

void opencl(benchmark::State& state) {
    const std::vector<CutSegment>& all = cuts(static_cast<int>(state.range(0)));
    Context context({.threads = static_cast<int>(state.range(1))});
    ForceSolver solver(context);
    if (!solver.on_device()) {
        state.SkipWithError(solver.note().c_str());
        return;
    }
    std::vector<SegmentForces> out(all.size());
    solver.solve(context, all, out);
    check("the OpenCL kernel", all, out, 1e-4);
    for (auto _ : state) solver.solve(context, all, out);
    report(state, all, operations(all, true));
    state.SetLabel(solver.device());
}

void every_instant_16(benchmark::State& state) {
    run(state, "the integrals at every instant", by_hand<16>, 2e-3,
        operations(cuts(static_cast<int>(state.range(0))), false));
}
void every_instant_8(benchmark::State& state) {
    run(state, "the integrals at every instant", by_hand<8>, 1e-4,
        operations(cuts(static_cast<int>(state.range(0))), false));
}
void discs_16(benchmark::State& state) {
    const std::vector<CutSegment>& all = cuts(static_cast<int>(state.range(0)));
    run(state, "angle addition over discs", by_discs, 0.05,
        static_cast<double>(all.size()) * kAngles * kDiscs * 2 * 29);
}
void double_model(benchmark::State& state) { run(state, "the double model", scalar, 1e-9, 0); }

/// Fused multiply-adds of vectors on every thread: the machine's peak in single precision.
void peak(benchmark::State& state) {
    Context context({.threads = static_cast<int>(state.range(0))});
    constexpr int vectors = 10, turns = 4096, tasks = 64;
    for (auto _ : state)
        parallel_each(context, tasks, [&](std::size_t task) {
            Lanes<16>::Vector v[vectors];
            for (int i = 0; i < vectors; ++i)
                v[i] = Lanes<16>::Vector{} + static_cast<float>(task + static_cast<std::size_t>(i));
            const float a = 0.999f, b = 0.001f;
            for (int t = 0; t < turns; ++t)
                for (int i = 0; i < vectors; ++i)
                    for (int l = 0; l < 16; ++l) v[i][l] = __builtin_fmaf(v[i][l], a, b);
            for (int i = 0; i < vectors; ++i) benchmark::DoNotOptimize(v[i]);
        });
    state.counters["flop/s"] =
        benchmark::Counter(2.0 * 16 * vectors * turns * tasks, benchmark::Counter::kIsIterationInvariantRate);
}

void arguments(benchmark::internal::Benchmark* b) {
    b->ArgNames({"ball", "threads"});
    for (const int sort : {flat_cuts, ball_cuts})
        for (const int threads : {1, 2}) b->Args({sort, threads});
    b->UseRealTime()->Unit(benchmark::kMillisecond);
}

}  // namespace

BENCHMARK(opencl)->Apply(arguments);
BENCHMARK(every_instant_8)->Apply(arguments);
BENCHMARK(every_instant_16)->Apply(arguments);
BENCHMARK(discs_16)->Apply(arguments);
BENCHMARK(double_model)->Apply(arguments);
BENCHMARK(peak)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

int main(int argc, char** argv) {
    // PoCL shows no device unless it may write its cache somewhere.
    const auto cache = std::filesystem::temp_directory_path() / "slabwright-pocl";
    std::error_code error;
    std::filesystem::create_directories(cache, error);
    setenv("POCL_CACHE_DIR", cache.c_str(), 0);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    if (benchmark::RunSpecifiedBenchmarks() == 0) {
        std::fprintf(stderr, "forces_bench: nothing ran\n");
        return 1;
    }
    return 0;
}
