// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/bake_words.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

TEST(BakeWords, OptionsAreNamedAsABakeTakesThem) {
  EXPECT_EQ(in_bake_words("isosurface", "42 % was left out; --largest 2 keeps one more, 0 all"),
            "42 % was left out; --set isosurface.largest=2 keeps one more, 0 all");
  EXPECT_EQ(in_bake_words("isosurface", "cut flat; --cap round closes it as organs end"),
            "cut flat; --set isosurface.cap=round closes it as organs end");
  EXPECT_EQ(in_bake_words("isosurface", "choose --iso inside it"),
            "choose --set isosurface.iso=… inside it");
  EXPECT_EQ(in_bake_words("place", "more cameras, or --coverage, show it"),
            "more cameras, or --set place.coverage=…, show it");
  EXPECT_EQ(in_bake_words("isosurface", "larger than --min-size-mm 5 mm (--label 2)."),
            "larger than --set isosurface.min_size_mm=5 mm (--set isosurface.label=2).");
}

TEST(BakeWords, TogglesAndInputs) {
  EXPECT_EQ(in_bake_words("isosurface", "--no-keep-volume"), "--set isosurface.keep_volume=false");
  EXPECT_EQ(in_bake_words("isosurface", "without --strict they are mended"),
            "without --set isosurface.strict=true they are mended");
  EXPECT_EQ(in_bake_words("isosurface", "give the mask (--mask FILE), too"),
            "give the mask (--set mask=FILE), too");
  EXPECT_EQ(in_bake_words("capture", "--exemplar a/b.png needs --exemplar-mm-per-pixel: the size"),
            "--set exemplar=a/b.png needs --set capture.exemplar_mm_per_pixel=…: the size");
}

TEST(BakeWords, WhatIsNoOptionOfTheStageStays) {
  for (const char* text : {"in centimetres (--unit cm; unit=cm)", "--set isosurface.largest=2",
                           "--repair auto mends it", "a -- b", "--", "x--largest 2", ""})
    EXPECT_EQ(in_bake_words("isosurface", text), text);
  EXPECT_EQ(in_bake_words("bundle", "--largest 2"), "--largest 2");
}

}  // namespace
}  // namespace organbake
