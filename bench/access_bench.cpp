// How many questions a second accessibility asks of Embree (nearest surface within the cutter, height over
// its axis), all of its own work counted, and how many Embree answers at best: the same places, in the same
// order, with float arithmetic and nothing around it.
#include <benchmark/benchmark.h>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "kernels/access/accessibility.h"
#include "kernels/geometry/triangle.h"
#include "kernels/mesh/morton.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tools/allocator.h"

namespace {

using namespace slabwright;

constexpr double kRadius = 3.175, kLow = 2, kHigh = 18, kInset = 0.02;

struct Place {
    Vec3f centre;
    std::uint64_t code;
};

/// A mesh, and the places of a ball in contact at the points that accessibility tests on it.
struct Model {
    Mesh mesh;
    std::vector<Place> places;
};

/// A closed relief of about `facets` facets, 290 mm wide: waves that the ball reaches everywhere.
Mesh make_relief(Context& context, std::uint64_t facets) {
    const auto n = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(facets) / 2));
    const std::uint32_t row = n + 1, foot = row * row;
    Mesh mesh;
    for (std::uint32_t j = 0; j < row; ++j)
        for (std::uint32_t i = 0; i < row; ++i) {
            const double x = 290.0 * i / n, y = 290.0 * j / n;
            mesh.vertices.push_back({static_cast<float>(x), static_cast<float>(y),
                                     static_cast<float>(10 + 5 * std::sin(x / 17) * std::cos(y / 19))});
        }
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * row + i, b = a + 1, c = b + row, d = a + row;
            mesh.facets.push_back({a, b, c});
            mesh.facets.push_back({a, c, d});
        }
    // The sides stand on the border's shadow on the ground, and the bottom is a fan about its middle.
    std::vector<std::uint32_t> border;
    for (std::uint32_t i = 0; i < n; ++i) border.push_back(i);
    for (std::uint32_t i = 0; i < n; ++i) border.push_back(i * row + n);
    for (std::uint32_t i = n; i > 0; --i) border.push_back(n * row + i);
    for (std::uint32_t i = n; i > 0; --i) border.push_back(i * row);
    for (const std::uint32_t v : border) mesh.vertices.push_back({mesh.vertices[v].x, mesh.vertices[v].y, 0});
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size()),
               count = static_cast<std::uint32_t>(border.size());
    mesh.vertices.push_back({145, 145, 0});
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t k = (i + 1) % count, a = foot + i, b = foot + k;
        mesh.facets.push_back({a, b, border[k]});
        mesh.facets.push_back({a, border[k], border[i]});
        mesh.facets.push_back({a, middle, b});
    }
    pair_edges(context, mesh);
    return mesh;
}

Model make_model(std::uint64_t facets, bool relief) {
    Context context;
    Model model;
    if (relief) {
        model.mesh = make_relief(context, facets);
    } else {
        std::vector<Facet> corners;
        metre_pattern({.size_mm = 290, .height_mm = 29, .facets = facets},
                      [&](const Facet& f) { corners.push_back(f); });
        model.mesh = weld(context, corners);
    }
    const MortonGrid grid(bounds(model.mesh.view()));
    for (const Index3& f : model.mesh.facets) {
        Point3 t[3];
        for (int k = 0; k < 3; ++k)
            t[k] = {model.mesh.vertices[f[k]].x, model.mesh.vertices[f[k]].y, model.mesh.vertices[f[k]].z};
        const auto [low, high] = std::minmax({t[0][2], t[1][2], t[2][2]});
        if (low < kLow || high > kHigh) continue;
        const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
        const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
        double n[3] = {uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
        const double l = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (!(l > 0) || n[2] < 0) continue;
        auto middle = [&](int k) { return (t[0][k] + t[1][k] + t[2][k]) / 3; };
        const std::uint64_t code = grid.code(middle(0), middle(1), middle(2));
        for (int i = 0; i < 4; ++i) {
            double w[3] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
            if (i > 0) {
                for (double& v : w) v = kInset / 2;
                w[i - 1] = 1 - kInset;
            }
            float p[3];
            for (int c = 0; c < 3; ++c)
                p[c] = static_cast<float>(w[0] * t[0][c] + w[1] * t[1][c] + w[2] * t[2][c] +
                                          (kRadius + 0.01) * n[c] / l);
            model.places.push_back({{p[0], p[1], p[2]}, code});
        }
    }
    std::stable_sort(model.places.begin(), model.places.end(),
                     [](const Place& a, const Place& b) { return a.code < b.code; });
    if (model.places.empty()) {
        std::fprintf(stderr, "access_bench: the pattern has no facets in the layer\n");
        std::exit(1);
    }
    return model;
}

const Model& model(std::int64_t facets, std::int64_t relief) {
    static std::map<std::pair<std::int64_t, std::int64_t>, Model> made;
    const std::pair key(facets, relief);
    const auto it = made.find(key);
    return it != made.end()
               ? it->second
               : made.emplace(key, make_model(static_cast<std::uint64_t>(facets), relief != 0)).first->second;
}

struct Closest {
    const Mesh* mesh;
    Vec3f p;
    float squared;
};

/// The nearest point of a triangle by regions, as Embree's own tutorial computes it.
bool closest(RTCPointQueryFunctionArguments* args) {
    auto& state = *static_cast<Closest*>(args->userPtr);
    const Index3& f = state.mesh->facets[args->primID];
    auto sub = [](Vec3f a, Vec3f b) { return Vec3f{a.x - b.x, a.y - b.y, a.z - b.z}; };
    auto dot = [](Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    const Vec3f a = state.mesh->vertices[f[0]], b = state.mesh->vertices[f[1]],
                c = state.mesh->vertices[f[2]];
    const Vec3f ab = sub(b, a), ac = sub(c, a), ap = sub(state.p, a), bp = sub(state.p, b),
                cp = sub(state.p, c);
    const float d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
                d6 = dot(ac, cp);
    float v = 0, w = 0;
    const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (d1 <= 0 && d2 <= 0) v = w = 0;
    else if (d3 >= 0 && d4 <= d3) v = 1;
    else if (vc <= 0 && d1 >= 0 && d3 <= 0) v = d1 / (d1 - d3);
    else if (d6 >= 0 && d5 <= d6) w = 1;
    else if (vb <= 0 && d2 >= 0 && d6 <= 0) w = d2 / (d2 - d6);
    else if (va <= 0 && d4 >= d3 && d5 >= d6) w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - w;
    else v = vb / (va + vb + vc), w = vc / (va + vb + vc);
    const Vec3f q{ap.x - v * ab.x - w * ac.x, ap.y - v * ab.y - w * ac.y, ap.z - v * ab.z - w * ac.z};
    const float d = dot(q, q);
    if (d >= state.squared) return false;
    state.squared = d;
    args->query->radius = std::sqrt(d);
    return true;
}

/// Embree's tree over a mesh, with nothing around it.
class Bare {
public:
    explicit Bare(const Model& m) : model_(m), device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
        rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        std::copy(m.mesh.vertices.begin(), m.mesh.vertices.end(),
                  static_cast<Vec3f*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                              RTC_FORMAT_FLOAT3, sizeof(Vec3f),
                                                              m.mesh.vertices.size())));
        std::copy(
            m.mesh.facets.begin(), m.mesh.facets.end(),
            static_cast<Index3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                         sizeof(Index3), m.mesh.facets.size())));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    Bare(const Bare&) = delete;
    Bare& operator=(const Bare&) = delete;
    ~Bare() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    /// Two questions a place.
    [[nodiscard]] double questions() const { return static_cast<double>(2 * model_.places.size()); }
    /// How many of the questions met something.
    [[nodiscard]] std::uint64_t ask() const {
        std::uint64_t met = 0;
        for (const Place& place : model_.places) {
            const auto radius = static_cast<float>(kRadius - 0.01);
            Closest nearest{&model_.mesh, place.centre, radius * radius};
            RTCPointQuery query{place.centre.x, place.centre.y, place.centre.z, 0, radius};
            RTCPointQueryContext stack;
            rtcInitPointQueryContext(&stack);
            rtcPointQuery(scene_, &query, &stack, &closest, &nearest);
            met += nearest.squared < radius * radius;
            RTCRayHit ray{};
            ray.ray.org_x = place.centre.x, ray.ray.org_y = place.centre.y,
            ray.ray.org_z = static_cast<float>(kHigh);
            ray.ray.dir_z = -1;
            ray.ray.tfar = std::numeric_limits<float>::infinity();
            ray.ray.mask = 0xFFFFFFFFu;
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
            rtcIntersect1(scene_, &ray);
#else
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            rtcIntersect1(scene_, &context, &ray);
#endif
            met += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
        return met;
    }

private:
    const Model& model_;
    RTCDevice device_;
    RTCScene scene_;
};

/// Arguments: facets, and whether of the relief or of the pattern. One thread.
void bare_embree(benchmark::State& state) {
    const Bare bare(model(state.range(0), state.range(1)));
    for (auto _ : state) benchmark::DoNotOptimize(bare.ask());
    state.counters["asked"] = bare.questions();
    state.counters["asked/s"] =
        benchmark::Counter(bare.questions(), benchmark::Counter::kIsIterationInvariantRate);
}

/// Accessibility of a ball, bull nose or flat on a model; without refinement on borders, so that points are
/// those of the facets.
class Kernel {
public:
    Kernel(const Model& m, int threads, std::int64_t form)
        : context_({.threads = threads}), scene_(context_, m.mesh.view()) {
        constexpr double corners[] = {0, kRadius, 1};  // of a flat, a ball, a bull-nose
        tool_.cutter = {kRadius, corners[form], 0};
        options_.spacing = 1000;
        options_.shares = true;  // every facet by itself
        options_.accuracy = 1;
    }
    [[nodiscard]] Accessibility ask() {
        Accessibility result = scene_.accessible(context_, kLow, kHigh, tool_, options_);
        if (!(result.area > 0)) {
            std::fprintf(stderr, "access_bench: nothing is to be machined\n");
            std::exit(1);
        }
        return result;
    }

    [[nodiscard]] double bytes() const { return static_cast<double>(context_.memory_charged()); }

private:
    Context context_;
    AccessScene scene_;
    ToolShape tool_;
    AccessOptions options_;
};

/// Arguments: facets, relief, threads, profile (0 flat, 1 ball, 2 bull nose).
void accessibility(benchmark::State& state) {
    Kernel kernel(model(state.range(0), state.range(1)), static_cast<int>(state.range(2)), state.range(3));
    Accessibility result;
    for (auto _ : state) result = kernel.ask();
    const double asked = static_cast<double>(result.queries + result.rays);
    state.counters["AR"] = result.ratio();
    state.counters["points/s"] =
        benchmark::Counter(static_cast<double>(result.points), benchmark::Counter::kIsIterationInvariantRate);
    state.counters["asked/point"] = asked / static_cast<double>(result.points);
    state.counters["asked/s"] = benchmark::Counter(asked, benchmark::Counter::kIsIterationInvariantRate);
}

/// Of the bare rate, the kernel's: the median of rounds in which the two take turns, in processor time, for a
/// machine that others use meanwhile. Arguments: facets, relief. A ball, one thread.
void share_of_bare(benchmark::State& state) {
    constexpr std::size_t rounds = 9;
    const Model& m = model(state.range(0), state.range(1));
    const Bare bare(m);
    Kernel kernel(m, 1, 1);
    auto seconds = [](auto&& work) {
        const std::clock_t begin = std::clock();
        work();
        return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    };
    Accessibility result = kernel.ask();  // what both need is in memory from here on
    benchmark::DoNotOptimize(bare.ask());
    const double asked = static_cast<double>(result.queries + result.rays);
    std::vector<double> shares, bare_rates, rates;
    for (auto _ : state)
        for (std::size_t i = 0; i < rounds; ++i) {
            bare_rates.push_back(bare.questions() / seconds([&] { benchmark::DoNotOptimize(bare.ask()); }));
            rates.push_back(asked / seconds([&] { result = kernel.ask(); }));
            shares.push_back(rates.back() / bare_rates.back());
        }
    for (std::vector<double>* row : {&shares, &bare_rates, &rates}) std::sort(row->begin(), row->end());
    const std::size_t middle = shares.size() / 2;
    state.counters["share"] = shares[middle];
    state.counters["lowest"] = shares.front();
    state.counters["highest"] = shares.back();
    state.counters["bare/s"] = bare_rates[middle];
    state.counters["asked/s"] = rates[middle];
    state.counters["points/s"] = rates[middle] * static_cast<double>(result.points) / asked;
    state.counters["asked/point"] = asked / static_cast<double>(result.points);
    state.counters["AR"] = result.ratio();
    state.counters["bytes/facet"] = kernel.bytes() / static_cast<double>(m.mesh.facets.size());
}

}  // namespace

BENCHMARK(bare_embree)
    ->ArgNames({"facets", "relief"})
    ->Args({200'000, 1})
    ->Args({200'000, 0})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(share_of_bare)
    ->ArgNames({"facets", "relief"})
    ->Args({200'000, 1})
    ->Args({200'000, 0})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(accessibility)
    ->ArgNames({"facets", "relief", "threads", "profile"})
    ->Args({200'000, 1, 1, 1})
    ->Args({200'000, 0, 1, 1})
    ->Args({200'000, 1, 1, 0})
    ->Args({200'000, 1, 1, 2})
    ->Args({200'000, 1, 2, 1})
    ->Unit(benchmark::kMillisecond);

// Memory as the command has it: what one question gives back the next one takes.
int main(int argc, char** argv) {
#ifdef SLABWRIGHT_JEMALLOC
    const slabwright::KeptWithin kept(std::uint64_t{1} << 32);
#endif
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
