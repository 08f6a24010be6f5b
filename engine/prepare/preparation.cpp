#include "engine/prepare/preparation.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::string_view kChart = "calculatoredge.com, Shrinkage of Materials";
constexpr std::string_view kRules = "Kindt-Collins, shrink rules, in 1/32 in a foot";
constexpr std::array kContractions{
    Contraction{"grey_iron", 1.0, kChart}, Contraction{"malleable_iron", 1.6, kChart},
    Contraction{"steel", 2.0, kChart},     Contraction{"aluminium", 1.3, kRules},
    Contraction{"magnesium", 1.3, kRules}, Contraction{"copper", 1.6, kRules},
    Contraction{"brass", 1.5, kChart},     Contraction{"bronze", 1.5, kChart},
};
constexpr double kMostContraction = 20;  // %

/// Sine of an angle in degrees, exact in multiples of 90: a base that is turned onto its side stays flat.
double sine(double degrees) {
    const double turn = std::remainder(degrees, 360);
    if (turn == 0 || std::abs(turn) == 180) return 0;
    if (std::abs(turn) == 90) return turn > 0 ? 1 : -1;
    return std::sin(turn * std::numbers::pi / 180);
}
double cosine(double degrees) { return sine(degrees + 90); }

AffineMap turned_about(std::size_t axis, double degrees) {
    AffineMap map;
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    map.rows[u][u] = map.rows[v][v] = cosine(degrees);
    map.rows[v][u] = sine(degrees);
    map.rows[u][v] = -map.rows[v][u];
    return map;
}

AffineMap scaled_by(const std::array<double, 3>& factors) {
    AffineMap map;
    for (std::size_t k = 0; k < 3; ++k) map.rows[k][k] = factors[k];
    return map;
}

std::array<double, 3> three(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

bool are(const std::vector<double>& values, double value) {
    return std::all_of(values.begin(), values.end(), [&](double v) { return v == value; });
}

}  // namespace

std::span<const Contraction> contractions() { return kContractions; }

double contraction_of(const std::string& shrink) {
    for (const Contraction& c : kContractions)
        if (shrink == c.metal) return c.percent / 100;
    std::string_view text = shrink;
    if (text.ends_with('%')) text.remove_suffix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    double percent = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), percent);
    if (error == std::errc() && end == text.data() + text.size() && percent >= 0 &&
        percent <= kMostContraction)
        return percent / 100;
    std::string metals;
    for (const Contraction& c : kContractions)
        metals += fmt::format("{}{} ({:g} %)", metals.empty() ? "" : ", ", c.metal, c.percent);
    throw Error(ErrorKind::usage, "job.shrink", fmt::format("\"{}\" is no contraction", shrink.substr(0, 40)),
                "prepare.shrink",
                fmt::format("give a percentage from 0 to {:g}, or one of {}", kMostContraction, metals));
}

AffineMap turned(const std::array<double, 3>& degrees) {
    return turned_about(2, degrees[2]).after(turned_about(1, degrees[1])).after(turned_about(0, degrees[0]));
}

Preparation preparation_of(const PrepareJob& job) {
    const double contraction = 1 + contraction_of(job.shrink);
    std::array<double, 3> mirror{1, 1, 1};
    if (job.mirror != MirrorAxis::none) mirror[static_cast<std::size_t>(job.mirror) - 1] = -1;
    Preparation result;
    result.map = scaled_by(mirror)
                     .after(scaled_by({contraction, contraction, contraction}))
                     .after(scaled_by(three(job.scale)))
                     .after(turned(three(job.turn)));
    for (auto& row : result.map.rows)
        for (double& value : row) value += 0.0;  // no -0, which would be written
    for (std::size_t r = 0; r < 3; ++r) result.map.rows[r][3] = job.shift[r];
    result.skin.mm = job.skin;
    if (job.skin == 0) return result;
    if (!job.skin_normal.empty()) {
        result.skin.normal = three(job.skin_normal);
        result.skin.angle_deg = job.skin_angle_deg;
    }
    if (!job.skin_box.empty()) {
        std::array<double, 6> box{};
        for (std::size_t k = 0; k < 6; ++k) box[k] = job.skin_box[k] + job.shift[k % 3];
        result.skin.box = box;
    }
    return result;
}

std::string told(const PrepareJob& job) {
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    if (!are(job.turn, 0))
        add(fmt::format("turned by {:g}, {:g}, {:g} degrees", job.turn[0], job.turn[1], job.turn[2]));
    if (!are(job.scale, 1))
        add(fmt::format("scaled by {:g}, {:g}, {:g}", job.scale[0], job.scale[1], job.scale[2]));
    if (const double share = contraction_of(job.shrink); share != 0) {
        const auto metal = std::find_if(kContractions.begin(), kContractions.end(),
                                        [&](const Contraction& c) { return c.metal == job.shrink; });
        add(metal == kContractions.end()
                ? fmt::format("made {:g} % larger", 100 * share)
                : fmt::format("made {:g} % larger for {} ({})", 100 * share, metal->metal, metal->source));
    }
    if (job.mirror != MirrorAxis::none)
        add(fmt::format("mirrored in {}", "xyz"[static_cast<std::size_t>(job.mirror) - 1]));
    if (job.skin != 0)
        add(fmt::format("given {:g} mm of skin{}", job.skin,
                        job.skin_normal.empty() && job.skin_box.empty() ? "" : " on some facets"));
    if (!are(job.shift, 0))
        add(fmt::format("shifted by {:g}, {:g}, {:g} mm", job.shift[0], job.shift[1], job.shift[2]));
    return text;
}

}  // namespace slabwright
