// SPDX-License-Identifier: GPL-3.0-or-later
// Frames of a video file by libav itself and not a wrapper: only it tells a damaged packet and a
// cut file from the end, and it says the frame's colour matrix and range.
//   A file is opened for what its bytes are, whatever its name. Playlists, lists of files, patterns
// of names and descriptions of streams lead to other files, which nobody gave and no cache looks
// at: only containers that hold their own pictures are opened, and no protocol but `file`.
#include "video_module.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/log.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "organbake/core/error.h"

namespace organbake {
namespace {

template <class T, void (*Free)(T**)>
struct Freed {
  void operator()(T* pointer) const { Free(&pointer); }
};
using Format = std::unique_ptr<AVFormatContext, Freed<AVFormatContext, avformat_close_input>>;
using Codec = std::unique_ptr<AVCodecContext, Freed<AVCodecContext, avcodec_free_context>>;
using Decoded = std::unique_ptr<AVFrame, Freed<AVFrame, av_frame_free>>;
using Packet = std::unique_ptr<AVPacket, Freed<AVPacket, av_packet_free>>;

std::string reason(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

// Demuxers, by libav's names, of files that hold their own pictures.
constexpr const char* kOwnPictures =
    "mov,matroska,avi,mpegts,mpeg,mpegvideo,m4v,h264,hevc,obu,av1,vc1,ivf,asf,flv,ogg,mxf,gxf,dv,"
    "nut,"
    "nuv,rm,wtv,swf,gif,apng,mjpeg,yuv4mpegpipe,bmp_pipe,dpx_pipe,gif_pipe,j2k_pipe,jpeg_pipe,"
    "pam_pipe,pgm_pipe,png_pipe,ppm_pipe,sgi_pipe,tiff_pipe,webp_pipe";

// By the first of a demuxer's names.
bool has_own_pictures(const AVInputFormat& format) {
  const std::string_view names = format.name;
  const std::string name = "," + std::string(names.substr(0, names.find(','))) + ",";
  return ("," + std::string(kOwnPictures) + ",").find(name) != std::string::npos;
}

// What is in a file by its first bytes, or its name, where that is nothing that is opened; else "".
std::string named_if_refused(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes(std::size_t{1} << 16);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto read = static_cast<int>(file.gcount());
  bytes.resize(static_cast<std::size_t>(read) + AVPROBE_PADDING_SIZE, 0);
  AVProbeData probe{};
  probe.filename = path.c_str();
  probe.buf = bytes.data();
  probe.buf_size = read;
  const AVInputFormat* format = av_probe_input_format(&probe, 1);
  if (!format) format = av_probe_input_format(&probe, 0);
  if (!format || has_own_pictures(*format)) return "";
  struct Told {
    const char *name, *words;
  };
  constexpr std::array kTold = {
      Told{"hls", "an HLS playlist"},
      Told{"concat", "a list of files (ffconcat)"},
      Told{"dash", "a DASH manifest"},
      Told{"webm_dash_manifest", "a DASH manifest"},
      Told{"imf", "an IMF composition playlist"},
      Told{"sdp", "the description of a stream (SDP)"},
      Told{"image2", "a pattern of file names"},
  };
  const auto* told = std::find_if(kTold.begin(), kTold.end(), [&](const Told& one) {
    return std::string_view(format->name) == one.name;
  });
  return told != kTold.end() ? told->words : std::string("of the format '") + format->name + "'";
}

// Curves that 8-bit sRGB stands for well enough; others would give a wrong radiance in silence.
bool is_screen_light(const AVFrame& picture) {
  const AVPixFmtDescriptor* format =
      av_pix_fmt_desc_get(static_cast<AVPixelFormat>(picture.format));
  if (format && (format->flags & AV_PIX_FMT_FLAG_FLOAT)) return false;
  switch (picture.color_trc) {
    case AVCOL_TRC_LINEAR:
    case AVCOL_TRC_LOG:
    case AVCOL_TRC_LOG_SQRT:
    case AVCOL_TRC_SMPTE2084:
    case AVCOL_TRC_SMPTE428:
    case AVCOL_TRC_ARIB_STD_B67:
      return false;
    default:
      return true;
  }
}

// Of a display matrix, in quarter turns; other angles are no camera's.
Turn turn_of(const std::int32_t* m) {
  const auto sign = [](std::int32_t value) { return (value > 0) - (value < 0); };
  const int a = sign(m[0]), b = sign(m[1]), c = sign(m[3]), d = sign(m[4]);
  if (b == 0 && c == 0) {
    if (a < 0) return d < 0 ? Turn::half : Turn::mirror;
    return d < 0 ? Turn::flip : Turn::none;
  }
  if (a != 0 || d != 0) return Turn::none;
  if (b > 0) return c > 0 ? Turn::transpose : Turn::clockwise;
  return c > 0 ? Turn::counterclockwise : Turn::transverse;
}

struct OpenVideo {
  std::filesystem::path path;
  Format format;
  Codec codec;
  Decoded picture{av_frame_alloc()};
  Packet packet{av_packet_alloc()};
  SwsContext* scaler = nullptr;
  int stream = -1;
  bool drained = false;
  std::string damage;  // found in the data; told when the frames before it are out
  std::size_t count = 0;
  int width = 0, height = 0;

  ~OpenVideo() { sws_freeContext(scaler); }

  [[noreturn]] void fail(const std::string& why) const {
    throw BadDataError(path, "frame " + std::to_string(count) + ": " + why +
                                 (count > 0 ? "; the frames before it are good" : ""));
  }

  void open() {
    std::error_code unknown;
    if (std::filesystem::file_size(path, unknown) == 0) {
      throw BadDataError(path, "is empty (0 bytes); copy the video again");
    }
    AVFormatContext* raw = nullptr;
    AVDictionary* options = nullptr;
    av_dict_set(&options, "format_whitelist", kOwnPictures, 0);
    av_dict_set(&options, "protocol_whitelist", "file", 0);
    // Without it what stands before a colon in a file's name is taken for a protocol.
    const std::string url = "file:" + path.string();
    int error = avformat_open_input(&raw, url.c_str(), nullptr, &options);
    av_dict_free(&options);
    if (error < 0) {
      if (const std::string named = named_if_refused(path); !named.empty())
        throw BadDataError(path, "is " + named +
                                     ", not a file that holds its own pictures; give the video "
                                     "itself, or copy it into one: ffmpeg -i IN -c copy OUT.mp4");
      throw BadDataError(path, "is no video that can be read: " + reason(error) +
                                   "; see whether it plays, or copy it again");
    }
    format.reset(raw);
    error = avformat_find_stream_info(format.get(), nullptr);
    const AVCodec* decoder = nullptr;
    if (error >= 0)
      stream = av_find_best_stream(format.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
    if (error < 0 || stream < 0 || !decoder)
      throw BadDataError(path, "holds no video that can be decoded");
    codec.reset(avcodec_alloc_context3(decoder));
    avcodec_parameters_to_context(codec.get(), format->streams[stream]->codecpar);
    codec->thread_count = 2;
    error = avcodec_open2(codec.get(), decoder, nullptr);
    if (error < 0) throw BadDataError(path, "cannot be decoded: " + reason(error));
  }

  // Hands the decoder one more packet, or tells it that there are none.
  void feed() {
    while (true) {
      const int error = damage.empty() ? av_read_frame(format.get(), packet.get()) : AVERROR_EOF;
      if (error < 0) {
        if (error != AVERROR_EOF) damage = "the file is damaged or cut off (" + reason(error) + ")";
        if (damage.empty() && format->pb && format->pb->error < 0)
          damage = "the file cannot be read on (" + reason(format->pb->error) + ")";
        drained = true;
        avcodec_send_packet(codec.get(), nullptr);
        return;
      }
      const bool ours = packet->stream_index == stream;
      if (ours && (packet->flags & AV_PKT_FLAG_CORRUPT)) damage = "its data are cut off";
      if (ours && damage.empty()) {
        const int sent = avcodec_send_packet(codec.get(), packet.get());
        if (sent < 0) damage = "it cannot be decoded (" + reason(sent) + ")";
      }
      av_packet_unref(packet.get());
      if (ours && damage.empty()) return;
    }
  }

  bool receive() {
    while (true) {
      const int error = avcodec_receive_frame(codec.get(), picture.get());
      if (error >= 0) return true;
      if (error == AVERROR_EOF || (error == AVERROR(EAGAIN) && drained)) return false;
      if (error != AVERROR(EAGAIN)) fail("it cannot be decoded (" + reason(error) + ")");
      feed();
    }
  }

  Turn turn() const {
#if LIBAVFORMAT_VERSION_MAJOR >= 61  // FFmpeg 7 (Debian 13)
    const AVCodecParameters& coded = *format->streams[stream]->codecpar;
    const AVPacketSideData* matrix = av_packet_side_data_get(
        coded.coded_side_data, coded.nb_coded_side_data, AV_PKT_DATA_DISPLAYMATRIX);
    const std::uint8_t* side = matrix ? matrix->data : nullptr;
#else
    const std::uint8_t* side =
        av_stream_get_side_data(format->streams[stream], AV_PKT_DATA_DISPLAYMATRIX, nullptr);
#endif
    return side ? turn_of(reinterpret_cast<const std::int32_t*>(side)) : Turn::none;
  }

  double pixel_aspect() const {
    const AVRational aspect =
        av_guess_sample_aspect_ratio(format.get(), format->streams[stream], picture.get());
    return aspect.num > 0 && aspect.den > 0 ? av_q2d(aspect) : 1;
  }

  void convert(Rgb8Image& frame) {
    if (!is_screen_light(*picture))
      fail(
          "its light is linear, logarithmic, PQ or HLG; convert the video to BT.709 first, or "
          "give EXR frames");
    const auto source = static_cast<AVPixelFormat>(picture->format);
    const AVPixFmtDescriptor* format_of_pixels = av_pix_fmt_desc_get(source);
    const bool transparent =
        format_of_pixels && (format_of_pixels->flags & AV_PIX_FMT_FLAG_ALPHA) != 0;
    scaler = sws_getCachedContext(scaler, width, height, source, width, height,
                                  transparent ? AV_PIX_FMT_RGBA : AV_PIX_FMT_RGB24,
                                  SWS_BILINEAR | SWS_ACCURATE_RND, nullptr, nullptr, nullptr);
    if (!scaler) fail("its pixel format is unknown");
    const bool high_definition = picture->colorspace == AVCOL_SPC_BT709 ||
                                 (picture->colorspace == AVCOL_SPC_UNSPECIFIED && height >= 720);
    const int* matrix = sws_getCoefficients(high_definition ? SWS_CS_ITU709 : SWS_CS_ITU601);
    sws_setColorspaceDetails(scaler, matrix, picture->color_range == AVCOL_RANGE_JPEG, matrix, 1, 0,
                             1 << 16, 1 << 16);
    frame = Rgb8Image(width, height);
    if (!transparent) return scale_into(frame.pixels.data(), 3);
    // As of a PNG: a pixel keeps its colour, and is black where it is wholly transparent.
    std::vector<std::uint8_t> pixels(4 * frame.pixels.size() / 3);
    scale_into(pixels.data(), 4);
    for (std::size_t k = 0; k < pixels.size() / 4; ++k)
      if (pixels[4 * k + 3] > 0) std::copy_n(&pixels[4 * k], 3, &frame.pixels[3 * k]);
  }

  void scale_into(std::uint8_t* pixels, int channels) const {
    std::uint8_t* target[1] = {pixels};
    const int stride[1] = {channels * width};
    sws_scale(scaler, picture->data, picture->linesize, 0, height, target, stride);
  }
};

class LibavDecoder final : public VideoDecoder {
 public:
  explicit LibavDecoder(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error))
      throw NoInputError(path, "there is no such file");
    av_log_set_level(AV_LOG_QUIET);
    video_.path = path;
    video_.open();
  }
  bool next(StoredPicture& frame) override;
  std::size_t frames_read() const override { return video_.count; }

 private:
  OpenVideo video_;
};

bool LibavDecoder::next(StoredPicture& frame) {
  OpenVideo& r = video_;
  if (!r.receive()) {
    if (!r.damage.empty()) r.fail(r.damage);
    if (r.count == 0) throw BadDataError(r.path, "frame 0: the video holds no frame");
    return false;
  }
  const AVFrame& picture = *r.picture;
  if (picture.decode_error_flags || (picture.flags & AV_FRAME_FLAG_CORRUPT))
    r.fail("its data are damaged");
  if (r.count == 0) {
    r.width = picture.width;
    r.height = picture.height;
  } else if (picture.width != r.width || picture.height != r.height) {
    r.fail("it is " + std::to_string(picture.width) + "x" + std::to_string(picture.height) +
           ", the frames before are " + std::to_string(r.width) + "x" + std::to_string(r.height));
  }
  frame = StoredPicture();
  r.convert(frame.color);
  frame.turn = r.turn();
  frame.pixel_aspect = r.pixel_aspect();
  if (picture.best_effort_timestamp != AV_NOPTS_VALUE)
    frame.time_s = static_cast<double>(picture.best_effort_timestamp) *
                   av_q2d(r.format->streams[r.stream]->time_base);
  ++r.count;
  return true;
}

}  // namespace

}  // namespace organbake

organbake::VideoDecoder* organbake_open_video(const std::filesystem::path& path) {
  return new organbake::LibavDecoder(path);
}
