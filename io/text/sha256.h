// SHA-256 (FIPS 180-4), so that a plan names the very bytes it was made from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace slabwright {

/// Hashes bytes given piece by piece. Uses the processor's SHA instructions where it has them.
class Sha256 {
public:
    Sha256() noexcept;
    void update(std::span<const std::byte> bytes) noexcept;
    /// The digest as 64 lower-case hexadecimal digits. Ends the hash: call once.
    [[nodiscard]] std::string hex();

private:
    friend std::string sha256_portable(std::span<const std::byte> bytes);
    void (*compress_)(std::uint32_t*, const std::byte*, std::size_t) noexcept;
    std::array<std::uint32_t, 8> state_;
    std::array<std::byte, 64> block_{};
    std::size_t filled_ = 0;
    std::uint64_t length_ = 0;
};

/// The digest of `bytes` in one call.
[[nodiscard]] std::string sha256(std::span<const std::byte> bytes);
/// The same without SHA instructions, to test one against the other.
[[nodiscard]] std::string sha256_portable(std::span<const std::byte> bytes);

}  // namespace slabwright
