#include "core/io/png_file.h"

#include <bit>
#include <csetjmp>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include <png.h>

#include "core/io/memory_file.h"

namespace tessera {
namespace {

/// libpng's state, and what its callbacks need.
struct Writer {
  Writer();
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  png_structp png = nullptr;
  png_infop info = nullptr;
  MemoryFile file;
  char error[128] = "";
};

void fail(png_structp png, png_const_charp why) {
  auto& writer = *static_cast<Writer*>(png_get_error_ptr(png));
  std::snprintf(writer.error, sizeof writer.error, "%s", why);
  png_longjmp(png, 1);
}

void ignore(png_structp, png_const_charp) {}

void append(png_structp png, png_bytep data, png_size_t count) {
  if (!static_cast<Writer*>(png_get_io_ptr(png))->file.append(data, count)) png_error(png, "no memory");
}

void flush(png_structp) {}

Writer::Writer() {
  png = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, fail, ignore);
  info = png ? png_create_info_struct(png) : nullptr;
  if (info) return;
  png_destroy_write_struct(&png, nullptr);
  throw std::bad_alloc();
}

enum class Outcome { written, stopped, failed };

/// libpng comes back here by longjmp: nothing with a destructor lives in this function. `row` has a row's bytes.
Outcome write_rows(Writer& writer, const Raster& raster, std::byte* row, const std::stop_token& stop) {
  png_structp png = writer.png;
  if (setjmp(png_jmpbuf(png)) != 0) return Outcome::failed;
  png_set_write_fn(png, &writer, append, flush);
  png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // Its own are 1,000,000 of each.
  // No filters and level 3: all filters and the usual 6 cost three to five times as much for 5% fewer bytes.
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
  png_set_compression_level(png, 3);
  const bool is_grey = raster.channels.size() == 1;
  const int colors = is_grey                       ? PNG_COLOR_TYPE_GRAY
                     : raster.channels.size() == 4 ? PNG_COLOR_TYPE_RGBA
                                                   : PNG_COLOR_TYPE_RGB;
  png_set_IHDR(png, writer.info, static_cast<png_uint_32>(raster.width), static_cast<png_uint_32>(raster.height),
               is_grey ? 16 : 8, colors, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
  if (!is_grey) png_set_sRGB(png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png, writer.info);
  if (is_grey && std::endian::native == std::endian::little) png_set_swap(png);
  for (std::int32_t y = 0; y < raster.height; ++y) {
    if (stop.stop_requested()) return Outcome::stopped;
    raster.read_row(y, row);
    png_write_row(png, reinterpret_cast<png_const_bytep>(row));
  }
  png_write_end(png, writer.info);
  return Outcome::written;
}

}  // namespace

std::optional<std::vector<std::byte>> write_png(const Raster& raster, const std::stop_token& stop) {
  Writer writer;
  std::vector<std::byte> row(raster.row_bytes());
  switch (write_rows(writer, raster, row.data(), stop)) {
    case Outcome::written:
      return std::move(writer.file).take();
    case Outcome::stopped:
      return std::nullopt;
    case Outcome::failed:
      break;
  }
  const bool lacks_memory = std::string_view(writer.error).find("memory") != std::string_view::npos;
  if (writer.file.out_of_memory() || lacks_memory) throw std::bad_alloc();
  throw std::runtime_error(std::string("libpng: ") + writer.error);
}

}  // namespace tessera
