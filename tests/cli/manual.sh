#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Manual pages and completions tell every option that the commands take, as the linters of man pages
# want them, and the chapters of the manual name none that there isn't.
source "$(dirname "$0")/assert.sh"
missing() { command -v "$1" >/dev/null || { echo "SKIPPED: $1 is not installed"; return 0; } && return 1; }
flags_of() { sed -nE 's/^  (-., )?(--[a-z0-9-]+).*/\2/p' "$1" | sort -u; }

organbake --help >help
commands=$(sed -n 's/^  \([a-z]*\)  .*/\1/p' help)
[ "$(wc -w <<<"$commands")" -ge 22 ] || fail "only these commands are listed: $commands"
expect 0 organbake man -o man
for program in organplay organbench; do
  expect 0 "$BIN/$program" --man
  cp out man/$program.1
done
expect_equal "$(ls man/*.1 | wc -l)" "$(($(wc -w <<<"$commands") + 3))"

# What help lists, the page and the completions tell, too. The page as people see it.
organbake completions bash >in_bash
organbake completions zsh >in_zsh
bash -n in_bash || fail "bash refuses its completions"
missing zsh || zsh -n in_zsh || fail "zsh refuses its completions"
expect_equal "$(diff in_bash in_zsh | grep -c '^<')" 0
for command in $commands; do
  organbake $command --help >help.$command
  man -l --no-hyphenation man/organbake-$command.1 2>/dev/null | col -b >page
  in_bash=$(sed -n "s/^    '$command') flags='\(.*\)' ;;/\1/p" in_bash)
  [ "$(flags_of help.$command | wc -l)" -ge 6 ] || fail "no flags in the help of $command"
  for flag in $(flags_of help.$command); do
    grep -qE -- "^ +(-., )?$flag( |,|\$)" page || fail "man organbake-$command lacks $flag"
    [[ " $in_bash " == *" $flag "* ]] || fail "the completions lack $command $flag"
  done
done
for program in organplay organbench; do
  "$BIN/$program" --help >help.$program
  man -l --no-hyphenation man/$program.1 2>/dev/null | col -b >page
  "$BIN/$program" --completions bash >bash.$program
  "$BIN/$program" --completions zsh >zsh.$program
  missing zsh || zsh -n zsh.$program || fail "zsh refuses the completions of $program"
  for flag in $(flags_of help.$program); do
    [ $flag = --help ] || grep -qE -- "^ +(-., )?$flag( |,|\$)" page || fail "man $program lacks $flag"
    grep -qE -- "[' ]$flag[' ]" bash.$program || fail "the completions of $program lack $flag"
  done
done

for page in man/*; do
  warnings=$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 -Z $page 2>&1 >/dev/null)
  expect_equal "$warnings" ""
  missing mandoc || expect_equal "$(mandoc -T lint -W style $page)" ""
done

# Bash really completes.
completed() { bash -c '
  source ./in_bash
  COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _organbake; echo "${COMPREPLY[*]}"' _ "$@"; }
expect_equal "$(completed organbake dec)" decimate
expect_equal "$(completed organbake decimate --fac)" --faces
expect_equal "$(completed organbake decimate --method lin)" lindstrom-turk
expect_equal "$(completed organbake decimate --method = fit)" fitted
expect_equal "$(completed organbake --threads 2 bake --qual)" --quality
expect_equal "$(completed organbake bake --quality dr)" draft
expect_equal "$(completed organbake decimate surf)" ""
# So does zsh, by the same script.
missing zsh || zsh -fc 'autoload -U compinit; compinit -u -D; source ./in_zsh
  COMP_WORDS=(organbake decimate --fac) COMP_CWORD=2; words=($COMP_WORDS) CURRENT=3
  compgen -F _organbake -- --fac' | grep -qx -- --faces || fail "zsh does not complete"

# Chapters and README: each flag behind a command's name is one that the command takes.
grep -hv 'cmake --install' "$SOURCE"/README.md "$SOURCE"/apps/manual/*.md |
  grep -oE 'organ(bake [a-z]+|play)( [^`|#]*)' | sed 's/ && .*//' >examples
[ "$(wc -l <examples)" -gt 60 ] || fail "only $(wc -l <examples) examples were found"
while read -r program command words; do
  known=help.$command
  [ $program = organplay ] && known=help.organplay
  [ -f $known ] || continue  # a sentence, no command
  for flag in $(grep -oE -- '(^| )--[a-z][a-z0-9-]*' <<<"$command $words"); do
    grep -qE -- "(^|[ ,-])(--no)?$flag( |\$|,)" $known || grep -qF -- "${flag/--no-/--}" $known ||
      fail "$flag is no flag of $program $command: $words"
  done
done <examples

# The HTML manual: clean for tidy, every link leads somewhere, every option of a stage is in it.
missing lowdown || missing mandoc && exit
expect 0 "$SOURCE/apps/manual/build_manual" "$BIN" made
for page in made/html/*.html; do
  missing tidy || expect_equal "$(tidy -q -e $page 2>&1)" ""
done
python3 - <<'PY' || fail "links"
import html.parser, json, pathlib, re, sys
folder, ids, links = pathlib.Path("made/html"), {}, []
class Page(html.parser.HTMLParser):
    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if "id" in values: ids[name].add(values["id"])
        target = values.get("href", values.get("src", ""))
        if target and "://" not in target: links.append((name, target))
for file in folder.glob("*.html"):
    name = file.name
    ids[name] = set()
    Page().feed(file.read_text())
assert len(ids) > 35 and len(links) > 400, (len(ids), len(links))
for page, target in links:
    file, _, part = target.partition("#")
    if not (folder / (file or page)).is_file(): sys.exit(f"{page}: {target} leads nowhere")
    if part and part not in ids[file or page]: sys.exit(f"{page}: {target} has no such part")
told = folder.joinpath("organbake-decimate.1.html").read_text()
assert "--tool-radius" in told and "lindstrom-turk" in told
index = folder.joinpath("search.js").read_text()  # what the search looks through, and no page asks for more
index = json.loads(index[index.index("["):index.rindex(";")].rstrip("] \n").rstrip(",") + "]")
assert len(index) > 500, len(index)
for place, title, text in index:
    page, _, part = place.partition("#")
    if part not in ids[page]: sys.exit(f"the search leads to {place}, which is not there")
assert any(place == "organbake-decimate.1.html#tool-radius-mm" or "--tool-radius" in title for place, title, _ in index)
for file in folder.glob("*.html"):
    asked = re.findall(r'(?:src|rel="stylesheet" href)="([^"]*)"', file.read_text())
    assert not [a for a in asked if "//" in a], (file, asked)
chapter, chapters = "index.html", []  # "Next" leads through all that the first page lists
while chapter:
    chapters.append(chapter)
    following = re.search(r'<a href="([^"]*)">Next: ', folder.joinpath(chapter).read_text())
    chapter = following and following[1]
assert len(chapters) == len(set(chapters)) > 50, chapters
reached, waiting = set(), ["index.html"]  # all pages can be found from the first
while waiting:
    at = waiting.pop()
    if at in reached: continue
    reached.add(at)
    waiting += [t.partition("#")[0] for p, t in links if p == at and t.partition("#")[0] in ids]
assert reached == ids.keys(), ids.keys() - reached
PY

# The messages that the manual explains are ones that the programs still say.
python3 - "$SOURCE" <<'PY' || fail "messages"
import pathlib, re, sys
source = pathlib.Path(sys.argv[1])
code = "".join(f.read_text() for d in ("lib", "pipelines", "apps") for f in source.glob(f"{d}/**/*.cpp"))
code = re.sub(r'"\s*"', "", code)  # a text over several lines
table = source.joinpath("apps/manual/troubleshooting.md").read_text().split("## Results")[0]
messages = [m for row in re.findall(r"^\| (.*?) \|", table, re.M) for m in re.findall(r"`([^`]+)`", row)]
parts = [p.strip(" ;'\"?") for m in messages for p in re.split("…|'schema.*", m)]
assert len(messages) >= 25, messages
gone = [p for p in parts if len(p) > 5 and p not in code]
if gone: sys.exit(f"nobody says {gone}")
PY

# Links of the pages as the repository shows them; and the README stays one screen and a half.
python3 - "$SOURCE" <<'PY' || fail "links of the Markdown files"
import pathlib, re, sys
source, count = pathlib.Path(sys.argv[1]), 0
heading = lambda text: re.sub(r"[^a-z0-9 -]", "", text.lower()).replace(" ", "-")
for page in [*source.glob("*.md"), *source.glob("apps/manual/*.md"), *source.glob("data-schemas/*.md")]:
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text()):
        if re.match(r"[a-z]+:", target): continue
        name, _, part = target.partition("#")
        file = page.parent / name if name else page
        if not file.exists(): sys.exit(f"{page}: {target} is not there")
        headings = re.findall(r"^#+ (.*)", file.read_text(), re.M) if part else []
        if part and part not in map(heading, headings): sys.exit(f"{page}: {target} has no such heading")
        count += 1
assert count > 40, count
size = source.joinpath("README.md").stat().st_size
if size > 6000: sys.exit(f"README.md has {size} bytes; the manual has room")
PY
