#include "engine/keep_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kFarthest = 1e5;        // mm from the programs' zero
constexpr double kLeastSize = 0.1;       // mm
constexpr double kLeastClearance = 0.5;  // mm
constexpr std::size_t kMostPoints = 1000;

using Place = std::array<double, 2>;

/// Refuses one keep-out by its key.
class KeepOutKeys {
public:
    explicit KeepOutKeys(std::size_t position) : prefix_(fmt::format("machine.keep_out[{}].", position)) {}

    [[noreturn]] void refuse(const char* key, const std::string& what, const std::string& remedy) const {
        throw Error(ErrorKind::usage, "job.range", fmt::format("{}{} {}", prefix_, key, what), prefix_ + key,
                    remedy);
    }
    void require(const char* key, double value, double low, double high) const {
        if (value >= low && value <= high) return;  // a NaN fails both
        refuse(key, fmt::format("is {}, out of range", value),
               fmt::format("give a number from {} up to {}", low, high));
    }

private:
    std::string prefix_;
};

double turn(const Place& a, const Place& b, const Place& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Whether c, which lies on the line through a and b, lies between them.
bool is_between(const Place& a, const Place& b, const Place& c) {
    return std::min(a[0], b[0]) <= c[0] && c[0] <= std::max(a[0], b[0]) && std::min(a[1], b[1]) <= c[1] &&
           c[1] <= std::max(a[1], b[1]);
}

bool meet(const Place& a, const Place& b, const Place& c, const Place& d) {
    const double abc = turn(a, b, c), abd = turn(a, b, d), cda = turn(c, d, a), cdb = turn(c, d, b);
    if (((abc > 0 && abd < 0) || (abc < 0 && abd > 0)) && ((cda > 0 && cdb < 0) || (cda < 0 && cdb > 0)))
        return true;
    return (abc == 0 && is_between(a, b, c)) || (abd == 0 && is_between(a, b, d)) ||
           (cda == 0 && is_between(c, d, a)) || (cdb == 0 && is_between(c, d, b));
}

void validate_polygon(const std::vector<Place>& polygon, const KeepOutKeys& keys) {
    const std::size_t n = polygon.size();
    if (n < 3 || n > kMostPoints)
        keys.refuse(
            "polygon", fmt::format("has {} points", n),
            fmt::format("give from 3 up to {} points [x, y], the last not the first again", kMostPoints));
    for (const Place& p : polygon)
        for (const double v : p) keys.require("polygon", v, -kFarthest, kFarthest);
    double area = 0;
    for (std::size_t i = 0; i < n; ++i) area += turn(polygon[0], polygon[i], polygon[(i + 1) % n]) / 2;
    if (!(std::abs(area) >= kLeastSize * kLeastSize))
        keys.refuse("polygon", "has no area", "give its corners one after another, either way round");
    for (std::size_t i = 0; i < n; ++i)
        if (const Place& a = polygon[i]; a == polygon[(i + 1) % n])
            keys.refuse("polygon", fmt::format("has the point {} {} twice in a row", a[0], a[1]),
                        "give each corner once");
    for (std::size_t i = 0; i < n; ++i) {
        const Place &a = polygon[i], &b = polygon[(i + 1) % n];
        for (std::size_t j = i + 1; j < n; ++j) {
            const Place &c = polygon[j], &d = polygon[(j + 1) % n];
            const bool follows = j == i + 1, closes = (j + 1) % n == i;
            // Neighbours share a corner; they may not fold back onto each other.
            const bool crossing = follows ? turn(a, b, d) == 0 && (is_between(a, b, d) || is_between(c, d, a))
                                  : closes
                                      ? turn(c, d, b) == 0 && (is_between(c, d, b) || is_between(a, b, c))
                                      : meet(a, b, c, d);
            if (crossing)
                keys.refuse("polygon",
                            fmt::format("meets itself: its side from {} {} and that from {} {}", a[0], a[1],
                                        c[0], c[1]),
                            "give its corners one after another, or several keep-outs");
        }
    }
}

void validate_rectangle(const std::vector<double>& r, const KeepOutKeys& keys) {
    if (r.size() != 4)
        keys.refuse("rectangle", fmt::format("has {} numbers", r.size()), "give [x0, y0, x1, y1]");
    for (const double v : r) keys.require("rectangle", v, -kFarthest, kFarthest);
    if (!(r[2] - r[0] >= kLeastSize) || !(r[3] - r[1] >= kLeastSize))
        keys.refuse("rectangle", "has no area", "give its least x and y first: [x0, y0, x1, y1]");
}

void validate_circle(const std::vector<double>& c, const KeepOutKeys& keys) {
    if (c.size() != 3) keys.refuse("circle", fmt::format("has {} numbers", c.size()), "give [x, y, radius]");
    keys.require("circle", c[0], -kFarthest, kFarthest);
    keys.require("circle", c[1], -kFarthest, kFarthest);
    keys.require("circle", c[2], kLeastSize / 2, kFarthest);
}

}  // namespace

void validate_keep_outs(const std::vector<KeepOut>& keep_outs) {
    for (std::size_t i = 0; i < keep_outs.size(); ++i) {
        const KeepOut& k = keep_outs[i];
        const KeepOutKeys keys(i + 1);
        if (k.name.empty()) keys.refuse("name", "is empty", "give a name of its own, as messages use it");
        for (std::size_t j = 0; j < i; ++j)
            if (keep_outs[j].name == k.name)
                keys.refuse("name", fmt::format("is \"{}\", as that of machine.keep_out[{}]", k.name, j + 1),
                            "give each keep-out a name of its own");
        const int shapes =
            (k.rectangle.empty() ? 0 : 1) + (k.polygon.empty() ? 0 : 1) + (k.circle.empty() ? 0 : 1);
        if (shapes != 1)
            keys.refuse(
                "name",
                fmt::format("\"{}\" has {}", k.name, shapes == 0 ? "no shape" : "more than one shape"),
                "give one of rectangle, polygon and circle");
        if (!k.rectangle.empty()) validate_rectangle(k.rectangle, keys);
        if (!k.polygon.empty()) validate_polygon(k.polygon, keys);
        if (!k.circle.empty()) validate_circle(k.circle, keys);
        keys.require("height", k.height, kLeastSize, 10000);
        keys.require("clearance", k.clearance, kLeastClearance, 1000);
    }
}

}  // namespace slabwright
