#include "kernels/repair/bodies.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "kernels/parallel/parallel.h"
#include "kernels/repair/winding.h"

namespace slabwright {

namespace {

/// A body: facets that are paired across edges.
struct Body {
    std::uint32_t first = 0;  ///< its lowest facet
    std::size_t begin = 0, end = 0;
    double volume = 0;  ///< signed, mm³
    double area = 0;    ///< mm²
    Xyz low{}, high{};
    std::array<Xyz, 6> beside{};  ///< points just outside it, all around
    Xyz middle{};                 ///< of its first facet
    bool unsure = false, turned = false;
};

/// Facets body by body.
struct Bodies {
    std::vector<std::uint32_t> facets;
    std::vector<Body> list;
};

Bodies find_bodies(const FacetSoup& soup, std::span<const std::uint32_t> body_of,
                   const std::vector<bool>& unsure) {
    const std::size_t n = soup.facets.size();
    Bodies bodies;
    bodies.facets.resize(n);
    std::iota(bodies.facets.begin(), bodies.facets.end(), 0u);
    std::sort(bodies.facets.begin(), bodies.facets.end(), [&](std::uint32_t a, std::uint32_t b) {
        return body_of[a] != body_of[b] ? body_of[a] < body_of[b] : a < b;
    });
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t f = bodies.facets[i];
        if (i == 0 || body_of[f] != body_of[bodies.facets[i - 1]]) {
            Body& fresh = bodies.list.emplace_back();
            fresh.first = f;
            fresh.begin = i;
            fresh.low = fresh.high = soup.at(soup.facets[f][0]);
        }
        Body& body = bodies.list.back();
        body.end = i + 1;
        body.unsure = body.unsure || (f < unsure.size() && unsure[f]);
        const Xyz origin = soup.at(soup.facets[body.first][0]);
        const Xyz twice = soup.twice_area_of(f);
        body.volume += inner(twice, minus(soup.at(soup.facets[f][0]), origin)) / 6;
        body.area += length(twice) / 2;
        for (const std::uint32_t v : soup.facets[f]) {
            const Xyz p = soup.at(v);
            for (std::size_t k = 0; k < 3; ++k) {
                if (p[k] <= body.low[k]) body.beside[2 * k] = p;
                if (p[k] >= body.high[k]) body.beside[2 * k + 1] = p;
                body.low[k] = std::min(body.low[k], p[k]);
                body.high[k] = std::max(body.high[k], p[k]);
            }
        }
    }
    for (Body& body : bodies.list) {
        const double step = 1e-5 * length(minus(body.high, body.low)) + 1e-6;
        for (std::size_t k = 0; k < 3; ++k) {
            body.beside[2 * k][k] -= step;
            body.beside[2 * k + 1][k] += step;
        }
        for (const std::uint32_t v : soup.facets[body.first])
            body.middle = plus(body.middle, soup.at(v), 1.0 / 3);
    }
    return bodies;
}

/// The winding number of one body about a point.
double winding_of_body(const FacetSoup& soup, const Bodies& bodies, const Body& body, const Xyz& p) {
    for (std::size_t k = 0; k < 3; ++k)
        if (p[k] < body.low[k] || p[k] > body.high[k]) return 0;
    double sum = 0;
    for (std::size_t i = body.begin; i < body.end; ++i) {
        const Index3& f = soup.facets[bodies.facets[i]];
        sum += winding_of(soup.at(f[0]), soup.at(f[1]), soup.at(f[2]), p);
    }
    return sum;
}

/// Whether other bodies make material all around a body. Where its first facet lies on one of another's, they
/// do not. @param tree of all bodies
bool lies_in_others(const WindingTree& tree, const Body& body) {
    for (const Xyz& p : body.beside)
        if (std::abs(tree.at(p)) < 0.5) return false;
    // Of the body's own winding half is seen there.
    const double own = body.volume < 0 ? -0.5 : 0.5;
    return std::abs(tree.at(body.middle) - own) >= 0.75;
}

void turn(FacetSoup& soup, const Bodies& bodies, Body& body) {
    for (std::size_t i = body.begin; i < body.end; ++i) {
        Index3& f = soup.facets[bodies.facets[i]];
        std::swap(f[1], f[2]);
    }
    body.volume = -body.volume;
    body.turned = !body.turned;
}

/// Turns the bodies that lie in one that was turned, so that its cavities stay cavities.
void turn_inside(FacetSoup& soup, Bodies& bodies, std::size_t outer_body,
                 const std::vector<std::size_t>& by_size, const std::vector<bool>& settled) {
    constexpr std::size_t most = 2000;
    std::size_t found = 0;
    for (const std::size_t b : by_size) {
        Body& body = bodies.list[b];
        if (b == outer_body || body.unsure || settled[b] || found >= most) continue;
        if (std::abs(winding_of_body(soup, bodies, bodies.list[outer_body], body.beside[0])) < 0.5) continue;
        ++found;
        turn(soup, bodies, body);
    }
}

}  // namespace

EmptyBodies find_empty_bodies(const FacetSoup& soup, std::span<const std::uint32_t> body_of) {
    EmptyBodies result;
    const Bodies bodies = find_bodies(soup, body_of, {});
    for (const Body& body : bodies.list) {
        if (std::abs(body.volume) > kEmptyMm * body.area / 2) continue;
        if (result.count == 0) result.facets.assign(soup.facets.size(), false);
        for (std::size_t i = body.begin; i < body.end; ++i) result.facets[bodies.facets[i]] = true;
        if (result.count++ > 0 && body.area <= result.area_mm2) continue;
        result.area_mm2 = body.area;
        result.where = soup.at(soup.facets[body.first][0]);
    }
    return result;
}

TurnedBodies turn_bodies(Context& context, FacetSoup& soup, std::span<const std::uint32_t> body_of,
                         const std::vector<bool>& unsure) {
    constexpr int nests = 8;  // bodies in bodies, at most
    TurnedBodies result;
    Bodies bodies = find_bodies(soup, body_of, unsure);
    std::vector<Body>& list = bodies.list;
    std::vector<std::size_t> by_size(list.size());
    std::iota(by_size.begin(), by_size.end(), std::size_t{0});
    std::sort(by_size.begin(), by_size.end(), [&](std::size_t a, std::size_t b) {
        const double va = std::abs(list[a].volume), vb = std::abs(list[b].volume);
        return va != vb ? va > vb : a < b;
    });
    std::vector<bool> settled(list.size(), false);
    for (int nest = 0; nest < nests; ++nest) {
        std::vector<std::size_t> asked;
        for (const std::size_t b : by_size)
            if (!settled[b] && (list[b].volume < 0 || list[b].unsure)) asked.push_back(b);
        if (asked.empty()) break;
        const WindingTree tree(context, soup.vertices, soup.facets);
        std::vector<char> in_material(asked.size());
        parallel_for(context, asked.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) in_material[i] = lies_in_others(tree, list[asked[i]]);
        });
        std::vector<std::size_t> now;  // turned with what lies in them; what lies in one is asked again
        for (std::size_t i = 0; i < asked.size(); ++i) {
            context.throw_if_cancelled();
            Body& body = list[asked[i]];
            const bool wrong = in_material[i] != 0 ? body.unsure && body.volume > 0 : body.volume < 0;
            if (!wrong || std::any_of(now.begin(), now.end(), [&](std::size_t b) {
                    return std::abs(winding_of_body(soup, bodies, list[b], body.beside[0])) >= 0.5;
                }))
                continue;
            now.push_back(asked[i]);
            settled[asked[i]] = true;
            turn(soup, bodies, body);
            if (in_material[i] == 0) turn_inside(soup, bodies, asked[i], by_size, settled);
        }
        if (now.empty()) break;
    }
    for (const Body& body : list) {
        if (!body.turned) continue;
        if (result.count++ > 0 && std::abs(body.volume) <= result.volume_mm3) continue;
        result.volume_mm3 = std::abs(body.volume);
        result.where = {};
        for (const std::uint32_t v : soup.facets[body.first])
            result.where = plus(result.where, soup.at(v), 1.0 / 3);
    }
    return result;
}

}  // namespace slabwright
