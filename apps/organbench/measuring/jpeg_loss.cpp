// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/jpeg_loss.h"

#include <turbojpeg.h>

namespace organbake {

Rgb8Image through_jpeg(const Rgb8Image& image, int quality, ChromaSampling chroma) {
  const int sampling = chroma == ChromaSampling::full ? TJSAMP_444 : TJSAMP_420;
  Rgb8Image back(image.width, image.height);
  unsigned char* bytes = nullptr;
  unsigned long count = 0;
  tjhandle handle = tjInitCompress();
  tjCompress2(handle, image.pixels.data(), image.width, 0, image.height, TJPF_RGB, &bytes, &count,
              sampling, quality, TJFLAG_ACCURATEDCT);
  tjDestroy(handle);
  handle = tjInitDecompress();
  tjDecompress2(handle, bytes, count, back.pixels.data(), image.width, 0, image.height, TJPF_RGB,
                TJFLAG_ACCURATEDCT);
  tjDestroy(handle);
  tjFree(bytes);
  return back;
}

}  // namespace organbake
