#include "core/io/image_format.h"

#include <array>

#include "core/io/tiff_file.h"

namespace tessera {
namespace {

constexpr std::uint32_t kInt = 0x7FFFFFFF;
constexpr std::uint64_t kAny = ~std::uint64_t{0};

// In the order of ImageFormat. JPEG ends where libjpeg does (JPEG_MAX_DIMENSION), short of its 16 bits. OpenEXR keeps
// coordinates below half an int's range, and the bytes of a block of rows, which may be a single row, in an int. TIFF
// counts all bytes of a file in 32 bits.
constexpr std::array kLimits{
    FormatLimits{ImageFormat::png, kInt, kInt, kAny, kAny, PixelValues::display, true},
    FormatLimits{ImageFormat::jpeg, 65500, 65500, kAny, kAny, PixelValues::display, false},
    FormatLimits{ImageFormat::exr, kInt / 2, kInt / 2, kInt, kAny, PixelValues::exact, true},
    FormatLimits{ImageFormat::hdr, kInt, kInt, kAny, kAny, PixelValues::rgbe, false},
    FormatLimits{ImageFormat::tiff, kInt, kInt, kAny, 0xFFFFFFFF - kTiffHeader, PixelValues::single, false},
};

}  // namespace

const FormatLimits& limits_of(ImageFormat format) { return kLimits.at(static_cast<std::size_t>(format)); }

}  // namespace tessera
