#include "tests/data/luo_layer_sample.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

namespace slabwright {

namespace {

using Triangle = std::array<Vec3f, 3>;

struct ProfileCorner {
    double x, z;  // inches
};

constexpr double kDepth = 2.0;  // inches, along y

Vec3f place(double x, double y, double z) {
    constexpr double mm = 25.4;
    return {static_cast<float>(x * mm), static_cast<float>(y * mm), static_cast<float>(z * mm)};
}

double turn(const ProfileCorner& a, const ProfileCorner& b, const ProfileCorner& c) {
    return (b.x - a.x) * (c.z - a.z) - (b.z - a.z) * (c.x - a.x);
}

// Counter-clockwise in x and z: along the base, then back over the top from right to left.
std::vector<ProfileCorner> profile() {
    std::vector<ProfileCorner> p = {
        {0, 0},       {4.3, 0},     {4.3, .700},                                             //
        {3.5, .700},  {3.5, 1.200}, {3.9, 1.200}, {3.9, 1.500}, {3.2, 1.500},                // the tee
        {3.2, 1.180}, {2.9, 1.180}, {2.9, 1.000}, {2.3, 1.000}, {2.3, .700},  {2.08, .700},  // steps
        {2.08, .805}, {2.02, .744}, {1.6, .652},  {1.6, .300},  // sharp ridge and ramp of 12.4°
    };
    // The round ridge: 15° down its side it has fallen by .026, which fixes the radius. From there on down
    // facets are steeper.
    constexpr double degree = std::numbers::pi / 180;
    const double radius = .026 / (1 - std::cos(15 * degree)), left = std::acos(1 - (.650 - .523) / radius);
    const double middle = .64 + radius * std::sin(left), right = middle + radius * std::sin(25 * degree);
    p.push_back({right, .300});
    for (int angle = 25; angle >= -30; angle -= 5) {
        double z = .650 - radius * (1 - std::cos(angle * degree));
        if (angle == 15 || angle == -15) z = .624;
        p.push_back({middle + radius * std::sin(angle * degree), z});
    }
    p.insert(p.end(), {{.64, .523}, {.60, .516}, {.50, .300}, {0, .300}});  // ramp of 9.9°
    return p;
}

void cap(std::vector<Triangle>& triangles, std::vector<ProfileCorner> rest, double y,
         bool facing_negative_y) {
    auto add = [&](const ProfileCorner& a, const ProfileCorner& b, const ProfileCorner& c) {
        if (facing_negative_y)
            triangles.push_back({place(a.x, y, a.z), place(b.x, y, b.z), place(c.x, y, c.z)});
        else triangles.push_back({place(a.x, y, a.z), place(c.x, y, c.z), place(b.x, y, b.z)});
    };
    while (rest.size() > 3) {  // ears, cut one by one
        bool found = false;
        for (std::size_t i = 0; i < rest.size() && !found; ++i) {
            const ProfileCorner a = rest[(i + rest.size() - 1) % rest.size()], b = rest[i],
                                c = rest[(i + 1) % rest.size()];
            if (turn(a, b, c) <= 1e-12) continue;
            bool empty = true;
            for (std::size_t j = 0; j < rest.size() && empty; ++j) {
                if (j == i || j == (i + 1) % rest.size() || (j + 1) % rest.size() == i) continue;
                empty = !(turn(a, b, rest[j]) >= 0 && turn(b, c, rest[j]) >= 0 && turn(c, a, rest[j]) >= 0);
            }
            if (!empty) continue;
            add(a, b, c);
            rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
            found = true;
        }
        if (!found) throw std::logic_error("the profile crosses itself");
    }
    add(rest[0], rest[1], rest[2]);
}

// The flat at 1.000, x 2.3 to 2.9, with a pit whose four sides meet in a short line at .755.
void flat_with_pit(std::vector<Triangle>& triangles) {
    const std::array<Vec3f, 4> outer = {place(2.3, 0, 1), place(2.9, 0, 1), place(2.9, kDepth, 1),
                                        place(2.3, kDepth, 1)};
    const std::array<Vec3f, 4> rim = {place(2.45, .6, 1), place(2.75, .6, 1), place(2.75, 1.4, 1),
                                      place(2.45, 1.4, 1)};
    const Vec3f near = place(2.6, .85, .755), far = place(2.6, 1.15, .755);
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t j = (i + 1) % 4;
        triangles.push_back({outer[i], outer[j], rim[j]});
        triangles.push_back({outer[i], rim[j], rim[i]});
    }
    triangles.push_back({rim[0], rim[1], near});
    triangles.push_back({rim[1], rim[2], far});
    triangles.push_back({rim[1], far, near});
    triangles.push_back({rim[2], rim[3], far});
    triangles.push_back({rim[3], rim[0], near});
    triangles.push_back({rim[3], near, far});
}

}  // namespace

std::vector<std::array<Vec3f, 3>> luo_layer_sample() {
    const std::vector<ProfileCorner> p = profile();
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < p.size(); ++i) {
        const ProfileCorner a = p[i], b = p[(i + 1) % p.size()];
        if (a.z == 1.000 && b.z == 1.000) {
            flat_with_pit(triangles);
            continue;
        }
        triangles.push_back({place(a.x, 0, a.z), place(a.x, kDepth, a.z), place(b.x, kDepth, b.z)});
        triangles.push_back({place(a.x, 0, a.z), place(b.x, kDepth, b.z), place(b.x, 0, b.z)});
    }
    cap(triangles, p, 0, true);
    cap(triangles, p, kDepth, false);
    return triangles;
}

}  // namespace slabwright
