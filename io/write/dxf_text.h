// Drawings as DXF R12 (AC1009), millimetres: closed polylines and words on layers.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "kernels/polygons/loops.h"

namespace slabwright {

class DxfText {
public:
    /// @param low, high corners of all that is drawn. @param layers in the order of their colours, from 1
    DxfText(Point2 low, Point2 high, std::span<const std::string_view> layers);
    void loop(std::string_view layer, std::span<const Point2> points);
    void open_line(std::string_view layer, std::span<const Point2> points);
    void circle(std::string_view layer, Point2 middle, double diameter_mm);
    /// Words at a place, 8 mm high unless told otherwise.
    void label(Point2 at, const std::string& words, double height_mm = 8);
    /// The whole text; nothing can be added after it.
    [[nodiscard]] std::string take();

private:
    void polyline(std::string_view layer, std::span<const Point2> points, bool is_closed);
    void group(int code, std::string_view value);
    void words(std::initializer_list<std::pair<int, std::string_view>> groups);
    std::string text_;
};

}  // namespace slabwright
