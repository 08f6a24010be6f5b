#include "engine/sheets/majorant.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

namespace {

/// On or over 0 where b lies on or over the line from a to c.
double over(const ProfilePoint& a, const ProfilePoint& b, const ProfilePoint& c) {
    return (b.r - a.r) * (c.z - a.z) - (c.r - a.r) * (b.z - a.z);
}

double distance(const ProfilePoint& p, const ProfilePoint& a, const ProfilePoint& b) {
    const double dz = b.z - a.z, dr = b.r - a.r, length2 = dz * dz + dr * dr;
    const double t = std::clamp(((p.z - a.z) * dz + (p.r - a.r) * dr) / length2, 0.0, 1.0);
    return std::hypot(p.z - a.z - t * dz, p.r - a.r - t * dr);
}

double distance(const ProfilePoint& p, std::span<const ProfilePoint> majorant) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < majorant.size(); ++i)
        least = std::min(least, distance(p, majorant[i], majorant[i + 1]));
    return least;
}

/// The greatest x in [low, high] for which holds(x), which holds at low.
template <class Holds>
double last_that_holds(double low, double high, Holds&& holds) {
    if (holds(high)) return high;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (holds(middle) ? low : high) = middle;
    }
    return low;
}

/// From bottom to top: each cut starts `leave` over the majorant where the one before ends, touches it, and
/// goes on until it is `leave` away again.
std::vector<StraightCut> greedy(std::span<const ProfilePoint> majorant, double leave, std::size_t most) {
    std::vector<StraightCut> cuts;
    const double z0 = majorant.front().z, z1 = majorant.back().z;
    const double height = z1 - z0;
    const auto over_by = [&](double z) {
        const double r = majorant_at(majorant, z);
        double reach = leave;
        while (distance({z, r + 2 * reach}, majorant) < leave) reach *= 2;
        return r + last_that_holds(0, 2 * reach, [&](double up) {
                   return distance({z, r + up}, majorant) <= leave;
               });
    };
    double z = z0;
    while (z < z1 - 1e-9 * height && cuts.size() < most) {
        const double r = over_by(z);
        double slope = -std::numeric_limits<double>::infinity();
        for (const ProfilePoint& p : majorant)
            if (p.z > z + 1e-12 * height) slope = std::max(slope, (p.r - r) / (p.z - z));
        cuts.push_back({r + slope * (z0 - z), r + slope * (z1 - z)});
        // Beyond the touching point the cut leaves the majorant for good.
        double touch = z;
        for (const ProfilePoint& p : majorant)
            if (p.z > z && std::abs(p.r - r - slope * (p.z - z)) < 1e-12 * (1 + std::abs(p.r))) touch = p.z;
        z = last_that_holds(std::max(z, touch), z1, [&](double at) {
            return distance({at, r + slope * (at - z)}, majorant) <= leave * (1 + 1e-9);
        });
    }
    return cuts;
}

}  // namespace

std::vector<ProfilePoint> concave_majorant(std::span<const ProfilePoint> profile) {
    std::vector<ProfilePoint> hull;
    for (const ProfilePoint& p : profile) {
        if (!hull.empty() && hull.back().z == p.z) {
            if (p.r <= hull.back().r) continue;
            hull.pop_back();
        }
        while (hull.size() > 1 && over(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
        hull.push_back(p);
    }
    return hull;
}

double majorant_at(std::span<const ProfilePoint> majorant, double z) {
    std::size_t i = 1;
    while (i + 1 < majorant.size() && majorant[i].z < z) ++i;
    const ProfilePoint &a = majorant[i - 1], &b = majorant[i];
    return a.r + (b.r - a.r) * (z - a.z) / (b.z - a.z);
}

StraightCut supporting_cut(std::span<const ProfilePoint> majorant, double z, double most_slope) {
    const auto slope_of = [&](std::size_t i) {
        return (majorant[i + 1].r - majorant[i].r) / (majorant[i + 1].z - majorant[i].z);
    };
    const double z0 = majorant.front().z, z1 = majorant.back().z, same = 1e-9 * (z1 - z0);
    std::size_t left = 0;  // the edge that holds z, or ends there
    while (left + 2 < majorant.size() && majorant[left + 1].z < z - same) ++left;
    const bool is_corner = left + 2 < majorant.size() && std::abs(majorant[left + 1].z - z) <= same;
    double slope = is_corner ? (slope_of(left) + slope_of(left + 1)) / 2 : slope_of(left);
    slope = std::clamp(slope, -most_slope, most_slope);
    // With a slope that was limited it touches elsewhere.
    double base = -std::numeric_limits<double>::infinity();
    for (const ProfilePoint& p : majorant) base = std::max(base, p.r - slope * (p.z - z0));
    return {base, base + slope * (z1 - z0)};
}

std::vector<StraightCut> cuts_along(std::span<const ProfilePoint> majorant, double leave) {
    constexpr std::size_t most = 1000;
    const std::vector<StraightCut> fewest = greedy(majorant, leave, most);
    double low = 0, high = leave;
    std::vector<StraightCut> best = fewest;
    for (int i = 0; i < 40; ++i) {
        const double middle = (low + high) / 2;
        if (middle < 1e-9) break;
        std::vector<StraightCut> cuts = greedy(majorant, middle, fewest.size() + 1);
        if (cuts.size() <= fewest.size()) best = std::move(cuts), high = middle;
        else low = middle;
    }
    return best;
}

double left_over(std::span<const ProfilePoint> profile, std::span<const StraightCut> cuts) {
    const double z0 = profile.front().z, height = profile.back().z - z0;
    double most = -std::numeric_limits<double>::infinity();
    for (const ProfilePoint& p : profile) {
        double r = std::numeric_limits<double>::infinity();
        for (const StraightCut& cut : cuts)
            r = std::min(r, cut.bottom + (cut.top - cut.bottom) * (p.z - z0) / height);
        most = std::max(most, r - p.r);
    }
    return most;
}

}  // namespace slabwright
