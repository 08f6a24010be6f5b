// Strips of irregular pieces packed by this engine and by libnest2d (Debian's libnest2d-dev, LGPL), one after
// the other in one run. Prints a Markdown table; every layout is proven free of overlap by intersection.
//     libnest2d_peer [SECONDS]        SECONDS of this engine on each strip; as long as libnest2d if not given
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "bench/peers/libnest2d_strip.h"
#include "bench/peers/strips.h"
#include "engine/nesting/nesting.h"

namespace {

using slabwright::Loops;
using slabwright::NestPlace;
using slabwright::NestRules;
using slabwright::Point2;

struct Strip {
    std::string name;
    double width = 0;  ///< mm; the strip is as long as it must be
    std::vector<int> turns;
    std::vector<Loops> pieces;
};

struct Packed {
    double seconds = 0, length = 0;  ///< mm of the strip
    double overlap_mm2 = 0;  ///< of pairs of pieces, each 2 um smaller all around, and beside the strip
    bool fits = true;        ///< on one strip
};

Loops polygon(const std::vector<std::array<double, 2>>& points, double scale) {
    Loops loops;
    for (const auto& p : points)
        loops.points.push_back({slabwright::to_units(p[0] * scale), slabwright::to_units(p[1] * scale)});
    loops.close_loop();
    if (slabwright::area(loops) < 0) std::reverse(loops.points.begin(), loops.points.end());
    return loops;
}

/// A published instance in millimetres.
Strip published(const slabwright::bench::PublishedStrip& from) {
    Strip strip{from.name, from.width * from.scale, {0, 180}, {}};
    for (const slabwright::bench::StripKind& kind : from.kinds)
        for (int i = 0; i < kind.count; ++i) strip.pieces.push_back(polygon(kind.points, from.scale));
    return strip;
}

/// Pieces as sections of parts are: rings of 10 to 60 points around a middle, more or less smooth.
Strip random_parts(const std::string& name, int count, double roughness, unsigned seed) {
    std::mt19937 random(seed);
    const auto unit = [&] { return double(random()) / 4294967296.0; };
    Strip strip{name, 800, {0, 90, 180, 270}, {}};
    for (int i = 0; i < count; ++i) {
        const int n = 10 + static_cast<int>(random() % 50);
        const double size = 25 + 90 * unit(), flat = 0.3 + 0.7 * unit();
        double waves[4][2];
        for (auto& wave : waves) wave[0] = roughness * unit(), wave[1] = 2 * std::numbers::pi * unit();
        std::vector<std::array<double, 2>> points;
        for (int k = 0; k < n; ++k) {
            const double a = 2 * std::numbers::pi * k / n;
            double r = 1;
            for (int w = 0; w < 4; ++w) r += waves[w][0] / (w + 1) * std::sin((w + 2) * a + waves[w][1]);
            r = std::max(r, 0.2);
            points.push_back({size * r * std::cos(a), size * flat * r * std::sin(a)});
        }
        strip.pieces.push_back(polygon(points, 1));
    }
    return strip;
}

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double area_of(const Strip& strip) {
    double sum = 0;
    for (const Loops& piece : strip.pieces) sum += slabwright::area(piece);
    return sum;
}

/// Fills what a layout is from where pieces lie; 2 µm of contact is no overlap.
void prove(const Strip& strip, const std::vector<Loops>& lying, Packed& packed) {
    std::int32_t low = INT32_MAX, high = INT32_MIN;
    std::vector<Loops> shrunk;
    for (const Loops& piece : lying) {
        for (const Point2 p : piece.points) {
            low = std::min(low, p.y), high = std::max(high, p.y);
            packed.fits = packed.fits && slabwright::to_mm(p.x) > -0.002 &&
                          slabwright::to_mm(p.x) < strip.width + 0.002;
        }
        shrunk.push_back(slabwright::offset(piece, -0.001, 0.001));
    }
    packed.length = slabwright::to_mm(high) - slabwright::to_mm(low);
    for (std::size_t i = 0; i < lying.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            packed.overlap_mm2 += slabwright::area(slabwright::intersect(shrunk[i], shrunk[j]));
}

Packed pack_ours(slabwright::Context& context, const Strip& strip, int tries) {
    NestRules rules;
    rules.spacing = rules.margin = 0;
    rules.turns = strip.turns;
    rules.tries = tries;
    double longest = 0;
    for (const Loops& piece : strip.pieces) longest += std::sqrt(slabwright::area(piece)) * 2;
    const auto begin = std::chrono::steady_clock::now();
    const slabwright::Nest nest =
        slabwright::nest_pieces(context, strip.pieces, {strip.width, std::min(longest, 15000.0)}, {}, rules);
    Packed packed{seconds_since(begin)};
    std::vector<Loops> lying;
    for (std::size_t i = 0; i < strip.pieces.size(); ++i)
        lying.push_back(slabwright::placed(strip.pieces[i], nest.places[i]));
    prove(strip, lying, packed);
    packed.fits = packed.fits && nest.stock.size() == 1;
    return packed;
}

Packed pack_theirs(const Strip& strip, bool along_strip, bool as_hulls) {
    std::vector<PeerPolygon> pieces;
    for (const Loops& piece : strip.pieces) {
        pieces.emplace_back();
        for (const Point2 p : piece.points) pieces.back().push_back({p.x, p.y});
    }
    const PeerStrip peer =
        pack_by_libnest2d(pieces, slabwright::to_units(strip.width), strip.turns, along_strip, as_hulls);
    Packed packed{peer.seconds};
    std::vector<Loops> lying;
    for (const PeerPolygon& polygon : peer.pieces) {
        Loops piece;
        for (const auto& p : polygon)
            piece.points.push_back({static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1])});
        piece.close_loop();
        lying.push_back(std::move(piece));
    }
    prove(strip, lying, packed);
    packed.fits = packed.fits && peer.fits;
    return packed;
}

/// The shortest of its layouts that are none over the other; where there is none, the shortest of all.
Packed best_of_theirs(const Strip& strip) {
    Packed best, overlapping;
    for (const bool as_hulls : {false, true})
        for (const bool along_strip : {true, false}) {
            const Packed packed = pack_theirs(strip, along_strip, as_hulls);
            if (!packed.fits) continue;
            Packed& kept = packed.overlap_mm2 < 1 ? best : overlapping;
            if (kept.length == 0 || packed.length < kept.length) kept = packed;
        }
    return best.length > 0 ? best : overlapping;
}

}  // namespace

int main(int count, char** arguments) {
    const double given = count > 1 ? std::atof(arguments[1]) : 0;
    slabwright::Context context;
    std::vector<Strip> strips{published(slabwright::bench::shirts()), published(slabwright::bench::swim()),
                              published(slabwright::bench::trousers())};
    strips.push_back(random_parts("random, smooth, 40", 40, 0.15, 1));
    strips.push_back(random_parts("random, rough, 40", 40, 0.45, 2));
    std::printf(
        "| strip | pieces | libnest2d: utilisation | overlap, mm2 | s | slabwright: utilisation | overlap, "
        "mm2 | s | orders |\n|---|---|---|---|---|---|---|---|---|\n");
    bool good = true;
    for (const Strip& strip : strips) {
        const double area = area_of(strip);
        const auto share = [&](const Packed& packed) { return area / strip.width / packed.length; };
        const Packed theirs = best_of_theirs(strip);
        // As many orders as the same time lets be tried.
        constexpr int few = 16;
        const double time = given > 0 ? given : theirs.seconds;
        Packed ours = pack_ours(context, strip, few);
        const int tries = std::clamp(static_cast<int>(0.9 * few * time / ours.seconds), 1, 100000);
        ours = pack_ours(context, strip, tries);
        std::printf("| %s | %zu | %.3f | %.1f | %.2f | %.3f | %.1f | %.2f | %d |\n", strip.name.c_str(),
                    strip.pieces.size(), share(theirs), theirs.overlap_mm2, theirs.seconds, share(ours),
                    ours.overlap_mm2, ours.seconds, tries);
        std::fflush(stdout);
        good = good && ours.fits && ours.overlap_mm2 == 0 &&
               share(ours) >= share(theirs) - (theirs.overlap_mm2 < 1 ? 0 : 1);
    }
    if (!good)
        std::fprintf(
            stderr,
            "libnest2d_peer: a layout of this engine overlaps, leaves its strip, or uses less of it\n");
    return good ? 0 : 1;
}
