#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The page that a bake writes beside its bundle, and 'organbake report'.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ
[ -s organ_report.html ] || fail "no page"
expect 0 organbake verify organ

python3 - <<'PY' || fail "the page"
import base64, html.parser, re
text = open("organ_report.html", encoding="utf-8").read()
assert not re.search(r"https?://|src=\"(?!data:)|href=\"(?!data:)", text), "the page fetches something"
pictures = re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", text)
assert len(pictures) == 3 * 4 + 2, len(pictures)
for picture in pictures:
    assert base64.b64decode(picture, validate=True).startswith(b"\x89PNG")
stages = re.findall(r"<tr><td>(\w+)</td><td class=\"text\">", text[text.index("Stages"):text.index("Skipped")])
assert stages == ["phantom", "isosurface", "decimate", "mechanics", "place", "capture"], stages
assert text.index("arning") < text.index("Stages") < text.index("Skipped")
open_tags = []
class Check(html.parser.HTMLParser):
    void = {"meta", "img", "br", "rect", "image", "path"}
    def handle_starttag(self, tag, attributes):
        if tag not in self.void: open_tags.append(tag)
    def handle_startendtag(self, tag, attributes): pass
    def handle_endtag(self, tag):
        if tag in ("p", "html"): return
        while open_tags[-1] == "p": open_tags.pop()
        assert open_tags.pop() == tag, tag
Check().feed(text)
PY

# A bake that changes nothing keeps the page; one made anew, wherever the bundle is, is the same.
before=$(sha256sum organ_report.html)
expect 0 organbake bake r.yaml -o organ
expect_equal "$before" "$(sha256sum organ_report.html)"
expect 0 organbake report organ/
expect_equal "$before" "$(sha256sum organ_report.html)"
mkdir away && cp -r organ away/b
expect 0 organbake report away/b -o away/page.html
expect_same organ_report.html away/page.html
expect_gone away/b_report.html

expect 0 organbake bake r.yaml -o silent --no-report
expect_gone silent_report.html
expect 2 organbake report
expect 2 organbake report organ -o page.txt
expect_err ".html"
expect 66 organbake report nothing
printf x | dd of=organ/cam_001/depth.exr bs=1 seek=2000 conv=notrunc 2>/dev/null
expect 65 organbake report organ -o damaged.html
expect_err "depth.exr"
expect_gone damaged.html
expect_equal "" "$(leftovers .)"
