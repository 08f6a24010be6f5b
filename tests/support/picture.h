// Pictures of height maps for the eye: PNG with stored (uncompressed) blocks, so that nothing but this header
// is needed.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace slabwright::picture {

/// Writes 8-bit RGB pixels, rows from the top, as PNG.
inline void write_png(const std::string& path, const std::vector<std::uint8_t>& rgb, int width, int height) {
    static const auto table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t i = 0; i < 256; ++i) {
            std::uint32_t c = i;
            for (int k = 0; k < 8; ++k) c = (c & 1) != 0 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
            t[i] = c;
        }
        return t;
    }();
    auto big = [](std::vector<std::uint8_t>& out, std::uint32_t v) {
        for (int k = 3; k >= 0; --k) out.push_back(static_cast<std::uint8_t>(v >> (8 * k)));
    };
    std::vector<std::uint8_t> raw;
    for (int y = 0; y < height; ++y) {
        raw.push_back(0);
        const auto row = rgb.begin() + static_cast<std::ptrdiff_t>(y) * width * 3;
        raw.insert(raw.end(), row, row + static_cast<std::ptrdiff_t>(width) * 3);
    }
    std::vector<std::uint8_t> zlib{0x78, 0x01};
    std::uint32_t a = 1, b = 0;
    for (const std::uint8_t v : raw) {
        a = (a + v) % 65521;
        b = (b + a) % 65521;
    }
    for (std::size_t at = 0; at < raw.size();) {
        const std::size_t n = std::min<std::size_t>(65535, raw.size() - at);
        zlib.push_back(at + n == raw.size() ? 1 : 0);
        for (const std::size_t v : {n, ~n}) {
            zlib.push_back(static_cast<std::uint8_t>(v & 255));
            zlib.push_back(static_cast<std::uint8_t>(v >> 8 & 255));
        }
        zlib.insert(zlib.end(), raw.begin() + static_cast<std::ptrdiff_t>(at),
                    raw.begin() + static_cast<std::ptrdiff_t>(at + n));
        at += n;
    }
    big(zlib, b << 16 | a);
    std::vector<std::uint8_t> png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    auto chunk = [&](const char* name, const std::vector<std::uint8_t>& data) {
        big(png, static_cast<std::uint32_t>(data.size()));
        const std::size_t start = png.size();
        for (int k = 0; k < 4; ++k) png.push_back(static_cast<std::uint8_t>(name[k]));
        png.insert(png.end(), data.begin(), data.end());
        std::uint32_t crc = 0xFFFFFFFFu;
        for (std::size_t i = start; i < png.size(); ++i) crc = table[(crc ^ png[i]) & 255] ^ (crc >> 8);
        big(png, ~crc);
    };
    std::vector<std::uint8_t> header;
    big(header, static_cast<std::uint32_t>(width));
    big(header, static_cast<std::uint32_t>(height));
    header.insert(header.end(), {8, 2, 0, 0, 0});
    chunk("IHDR", header);
    chunk("IDAT", zlib);
    chunk("IEND", {});
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}

/// A map with rows from the bottom: 0 grey, positive (left over) to red, negative (gouge) to blue, saturated
/// at ± full mm.
inline void write_signed(const std::string& path, std::span<const float> map, int width, int height,
                         double full) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
    for (int y = height - 1; y >= 0; --y)
        for (int x = 0; x < width; ++x) {
            const double v = std::clamp(map[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                            static_cast<std::size_t>(x)] /
                                            full,
                                        -1.0, 1.0);
            const auto level = [](double t) {
                return static_cast<std::uint8_t>(t < 0 ? 0 : t > 255 ? 255 : t);
            };
            rgb.push_back(level(v >= 0 ? 200 + 55 * v : 200 * (1 + v)));
            rgb.push_back(level(200 * (1 - std::abs(v))));
            rgb.push_back(level(v <= 0 ? 200 - 55 * v : 200 * (1 - v)));
        }
    write_png(path, rgb, width, height);
}

/// A height map, dark at `low`, light at `high`.
inline void write_heights(const std::string& path, std::span<const float> map, int width, int height,
                          double low, double high) {
    std::vector<std::uint8_t> rgb;
    for (int y = height - 1; y >= 0; --y)
        for (int x = 0; x < width; ++x) {
            const double v = (map[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x)] -
                              low) /
                             (high - low);
            const auto grey = static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255);
            rgb.insert(rgb.end(), 3, grey);
        }
    write_png(path, rgb, width, height);
}

}  // namespace slabwright::picture
