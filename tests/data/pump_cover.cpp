#include <cmath>
#include <numbers>

#include "tests/data/sweep.h"

namespace slabwright {

namespace {

constexpr double kChord = 0.04;  // mm
constexpr double kDraft = 2;     // degrees

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// 200 × 150 mm, its sides drawn in between the lugs.
Outline flange_outline() {
    std::vector<Corner> corners;
    const std::vector<Corner> quarter{{100, 40, 14}, {100, 75, 18}, {56, 75, 14}, {42, 67, 14}};
    // One quarter, mirrored into the others; every second one runs backwards.
    const auto add = [&](const Corner& c, double sx, double sy) {
        corners.push_back({sx * c.x, sy * c.y, c.radius});
    };
    const Corner side{90, 26, 14};
    add(side, 1, 1);
    for (const Corner& c : quarter) add(c, 1, 1);
    for (auto c = quarter.rbegin(); c != quarter.rend(); ++c) add(*c, -1, 1);
    add(side, -1, 1);
    add(side, -1, -1);
    for (const Corner& c : quarter) add(c, -1, -1);
    for (auto c = quarter.rbegin(); c != quarter.rend(); ++c) add(*c, 1, -1);
    add(side, 1, -1);
    return rounded_polygon(corners, kChord);
}

/// A round body with four ribs towards the lugs.
Outline body_outline() {
    constexpr double radius = 58, rib_end = 77, rib_half = 6.5;
    std::vector<Corner> corners;
    const auto polar = [&](double degrees, double r, double corner_radius) {
        corners.push_back({r * std::cos(radians(degrees)), r * std::sin(radians(degrees)), corner_radius});
    };
    const auto rib = [&](double degrees) {
        const double c = std::cos(radians(degrees)), s = std::sin(radians(degrees));
        const double root = std::sqrt(radius * radius - rib_half * rib_half);
        const auto at = [&](double along, double across, double r) {
            corners.push_back({along * c - across * s, along * s + across * c, r});
        };
        at(root, -rib_half, 7), at(rib_end, -rib_half, 5.5), at(rib_end, rib_half, 5.5),
            at(root, rib_half, 7);
    };
    for (const double side : {0.0, 180.0}) {
        for (int a = -14; a <= 14; a += 14) polar(side + a, radius, 40);
        rib(side + 35);
        for (int a = 54; a <= 126; a += 12) polar(side + a, radius, 40);
        rib(side + 145);
    }
    return rounded_polygon(corners, kChord);
}

/// A spiral from 33 to 46 mm with a tongue where it closes.
Outline volute_outline() {
    std::vector<Corner> corners;
    for (int i = 0; i <= 22; ++i) {
        const double a = radians(25 + 15.0 * i), r = 33 + 13.0 * i / 22;
        corners.push_back({r * std::cos(a), r * std::sin(a), i == 0 ? 7 : i == 22 ? 9 : 20.0});
    }
    return rounded_polygon(corners, kChord);
}

}  // namespace

std::vector<Facet> pump_cover() {
    constexpr double flange_top = 14, lug_top = 20, body_top = 28, volute_top = 44, hub_top = 52,
                     print_top = 60, pocket_floor = 8;
    std::vector<Facet> facets;
    const Outline flange = flange_outline(), body = body_outline(), volute = volute_outline();
    const Profile flange_wall = drafted_wall(0, flange_top, kDraft, 0, 2, kChord);
    const Profile body_wall = drafted_wall(flange_top, body_top, kDraft, 4.5, 3, kChord);
    const Profile volute_wall = drafted_wall(body_top, volute_top, kDraft, 4, 4, kChord);

    // The flange with what stands on it and is sunk into it.
    flat(facets, ring(flange, flange_wall.front()), {}, false);
    const Ring flange_rim = sweep(facets, flange, flange_wall);
    std::vector<Ring> on_flange{ring(body, body_wall.front())};
    const Profile lug_wall = drafted_wall(flange_top, lug_top, kDraft, 3.5, 1.5, kChord);
    const Profile pocket_wall = drafted_pocket(flange_top, pocket_floor, kDraft, 4, kChord);
    for (const double sx : {-1.0, 1.0}) {
        for (const double sy : {-1.0, 1.0}) {
            const Outline lug = circle(sx * 82, sy * 57, 9, kChord);
            on_flange.push_back(ring(lug, lug_wall.front()));
            flat(facets, sweep(facets, lug, lug_wall), {}, true);
        }
        const Outline pocket = circle(sx * 75, 0, 8.5, kChord);
        on_flange.push_back(ring(pocket, pocket_wall.front()));
        flat(facets, sweep(facets, pocket, pocket_wall), {}, true);
    }
    flat(facets, flange_rim, on_flange, true);

    // The body carries the volute.
    flat(facets, sweep(facets, body, body_wall), {ring(volute, volute_wall.front())}, true);

    // The volute carries the hub and, where the spiral is wide, a vent boss under a spherical cap.
    const Outline hub = circle(0, 0, 16, kChord);
    const Profile hub_wall = drafted_wall(volute_top, hub_top, kDraft, 4, 1.5, kChord);
    const double vent_angle = radians(330), vent_x = 30 * std::cos(vent_angle),
                 vent_y = 30 * std::sin(vent_angle);
    constexpr double vent_radius = 5, cap_z = volute_top + 5;
    const Outline vent = circle(vent_x, vent_y, vent_radius, kChord);
    Profile vent_wall = drafted_wall(volute_top, cap_z, kDraft, 3.5, 0, kChord);
    // A cap that meets the wall at 45°: its radius follows from the wall's top.
    const double rim = vent_radius + vent_wall.back().offset, cap_radius = rim * std::numbers::sqrt2;
    constexpr int cap_rings = 7;
    for (int k = 1; k < cap_rings; ++k) {
        const double slope = std::numbers::pi / 4 * (1 - static_cast<double>(k) / cap_rings);
        vent_wall.push_back(
            {cap_radius * std::sin(slope) - vent_radius, cap_z + cap_radius * std::cos(slope) - rim});
    }
    flat(facets, sweep(facets, volute, volute_wall),
         {ring(hub, hub_wall.front()), ring(vent, vent_wall.front())}, true);
    fan(facets, sweep(facets, vent, vent_wall),
        {on_grid(vent_x), on_grid(vent_y), on_grid(cap_z + cap_radius - rim)});

    // The core print on the hub, with the larger taper that seats a core.
    const Outline print = circle(0, 0, 10, kChord);
    const Profile print_wall = drafted_wall(hub_top, print_top, 7, 0, 2, kChord);
    flat(facets, sweep(facets, hub, hub_wall), {ring(print, print_wall.front())}, true);
    flat(facets, sweep(facets, print, print_wall), {}, true);
    return facets;
}

}  // namespace slabwright
