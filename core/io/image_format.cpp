#include "core/io/image_format.h"

#include <array>

namespace tessera {
namespace {

constexpr std::uint32_t kInt = 0x7FFFFFFF;
constexpr std::uint64_t kAny = ~std::uint64_t{0};

// In the order of ImageFormat. JPEG ends where libjpeg does (JPEG_MAX_DIMENSION), short of its 16 bits. OpenEXR keeps
// coordinates below half an int's range, and the bytes of a block of rows, which may be a single row, in an int.
constexpr std::array kLimits{
    FormatLimits{ImageFormat::png, kInt, kInt, kAny, PixelValues::display, true},
    FormatLimits{ImageFormat::jpeg, 65500, 65500, kAny, PixelValues::display, false},
    FormatLimits{ImageFormat::exr, kInt / 2, kInt / 2, kInt, PixelValues::exact, true},
    FormatLimits{ImageFormat::hdr, kInt, kInt, kAny, PixelValues::rgbe, false},
};

}  // namespace

const FormatLimits& limits_of(ImageFormat format) { return kLimits.at(static_cast<std::size_t>(format)); }

}  // namespace tessera
