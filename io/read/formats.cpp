#include "io/read/mesh_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/read/words.h"
#include "kernels/errors.h"

namespace slabwright {

// One line for each format; each is defined in the .cpp of its name.
extern const MeshFormat kStlFormat, kPlyFormat, kObjFormat, kThreeMfFormat, kStepFormat;

namespace {

constexpr std::array kFormats{&kStlFormat, &kThreeMfFormat, &kPlyFormat, &kStepFormat, &kObjFormat};

bool ends_in(std::string_view name, std::string_view ending) {
    return !ending.empty() && name.size() >= ending.size() &&
           is_word(name.substr(name.size() - ending.size()), ending);
}

}  // namespace

std::span<const MeshFormat* const> mesh_formats() { return kFormats; }

const MeshFormat& format_of_ending(std::string_view name) {
    for (const MeshFormat* format : kFormats)
        for (const std::string_view ending : format->endings)
            if (ends_in(name, ending)) return *format;
    return kStlFormat;
}

const MeshFormat& format_of(std::string_view head, std::uint64_t size, std::string_view name) {
    for (const MeshFormat* format : kFormats)
        if (format->recognise(head, size, name)) return *format;
    return format_of_ending(name);
}

void refuse_mesh(std::string_view family, std::string_view code, const std::string& message,
                 const std::string& place, std::string_view remedy) {
    throw Error(ErrorKind::input, fmt::format("{}.{}", family, code), message, place, std::string(remedy));
}

bool is_absurd(double value, double mm_per_unit) { return !(std::abs(value * mm_per_unit) <= kAbsurdMm); }

void refuse_coordinate(std::string_view family, double value, double mm_per_unit, const std::string& place) {
    if (!std::isfinite(value))
        refuse_mesh(family, "non_finite", fmt::format("a corner has the coordinate {}", value), place,
                    "repair the mesh in the program that made it");
    refuse_mesh(family, "absurd",
                fmt::format("a corner has the coordinate {:.6g} mm, over the limit of {:.0f} mm",
                            value * mm_per_unit, kAbsurdMm),
                place, "check the unit (--units) and the file, which may be damaged");
}

}  // namespace slabwright
