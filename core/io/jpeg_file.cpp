#include "core/io/jpeg_file.h"

#include <array>
#include <csetjmp>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>

#include <jerror.h>
#include <jpeglib.h>

#include "core/io/memory_file.h"

namespace tessera {
namespace {

/// libjpeg's state, and what its callbacks need.
struct Writer {
  Writer();
  ~Writer() { jpeg_destroy_compress(&jpeg); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_destination_mgr target{};
  std::jmp_buf back{};
  MemoryFile file;
  std::array<JOCTET, 1 << 16> piece{};  ///< On its way to the file.
  bool out_of_memory = false;
  char error[JMSG_LENGTH_MAX] = "";
};

Writer& writer_of(j_common_ptr jpeg) { return *static_cast<Writer*>(jpeg->client_data); }
Writer& writer_of(j_compress_ptr jpeg) { return *static_cast<Writer*>(jpeg->client_data); }

void fail(j_common_ptr jpeg) {
  Writer& writer = writer_of(jpeg);
  writer.out_of_memory = jpeg->err->msg_code == JERR_OUT_OF_MEMORY || writer.file.out_of_memory();
  jpeg->err->format_message(jpeg, writer.error);
  std::longjmp(writer.back, 1);
}

void ignore(j_common_ptr) {}

void begin(j_compress_ptr jpeg) {
  Writer& writer = writer_of(jpeg);
  writer.target.next_output_byte = writer.piece.data();
  writer.target.free_in_buffer = writer.piece.size();
}

boolean append(j_compress_ptr jpeg) {
  Writer& writer = writer_of(jpeg);
  if (!writer.file.append(writer.piece.data(), writer.piece.size())) ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
  begin(jpeg);
  return TRUE;
}

void end(j_compress_ptr jpeg) {
  Writer& writer = writer_of(jpeg);
  const std::size_t rest = writer.piece.size() - writer.target.free_in_buffer;
  if (!writer.file.append(writer.piece.data(), rest)) ERREXIT1(jpeg, JERR_OUT_OF_MEMORY, 0);
}

Writer::Writer() {
  jpeg.err = jpeg_std_error(&errors);
  errors.error_exit = fail;
  errors.output_message = ignore;
  target.init_destination = begin;
  target.empty_output_buffer = append;
  target.term_destination = end;
  jpeg.client_data = this;
}

enum class Outcome { written, stopped, failed };

/// libjpeg comes back here by longjmp: nothing with a destructor lives in this function. `row` has a row's bytes.
Outcome write_rows(Writer& writer, const Raster& raster, const JpegOptions& options, std::byte* row,
                   const std::stop_token& stop) {
  jpeg_compress_struct& jpeg = writer.jpeg;
  if (setjmp(writer.back) != 0) return Outcome::failed;
  jpeg_create_compress(&jpeg);
  jpeg.dest = &writer.target;
  jpeg.image_width = static_cast<JDIMENSION>(raster.width);
  jpeg.image_height = static_cast<JDIMENSION>(raster.height);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, options.quality, TRUE);
  jpeg.comp_info[0].h_samp_factor = options.subsampling == Subsampling::s444 ? 1 : 2;
  jpeg.comp_info[0].v_samp_factor = options.subsampling == Subsampling::s420 ? 2 : 1;
  jpeg_start_compress(&jpeg, TRUE);
  for (std::int32_t y = 0; y < raster.height; ++y) {
    if (stop.stop_requested()) return Outcome::stopped;
    raster.read_row(y, row);
    auto* scanline = reinterpret_cast<JSAMPROW>(row);
    jpeg_write_scanlines(&jpeg, &scanline, 1);
  }
  jpeg_finish_compress(&jpeg);
  return Outcome::written;
}

}  // namespace

std::optional<std::vector<std::byte>> write_jpeg(const Raster& raster, const JpegOptions& options,
                                                 const std::stop_token& stop) {
  Writer writer;
  std::vector<std::byte> row(raster.row_bytes());
  switch (write_rows(writer, raster, options, row.data(), stop)) {
    case Outcome::written:
      return std::move(writer.file).take();
    case Outcome::stopped:
      return std::nullopt;
    case Outcome::failed:
      break;
  }
  if (writer.out_of_memory) throw std::bad_alloc();
  throw std::runtime_error(std::string("libjpeg: ") + writer.error);
}

}  // namespace tessera
