# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds a bill of materials against SPDX 2.3's rules, and against what the loader really loads.

usage: check_sbom.py DOCUMENT PROGRAM…
"""

import json
import re
import subprocess
import sys

ID = re.compile(r"SPDXRef-[A-Za-z0-9.-]+$")
KINDS = {"DESCRIBES", "CONTAINS", "DEPENDS_ON", "BUILD_DEPENDENCY_OF"}
WORD = re.compile(r"(LicenseRef-[A-Za-z0-9.-]+|[A-Za-z0-9.+-]+)$")
failures = []


def expect(holds, message):
    if not holds:
        failures.append(message)


with open(sys.argv[1], encoding="utf-8") as file:
    document = json.load(file)
packages = {package["SPDXID"]: package for package in document["packages"]}
names = {package["name"] for package in document["packages"]}
known_texts = {item["licenseId"] for item in document["hasExtractedLicensingInfos"]}

expect(document["spdxVersion"] == "SPDX-2.3" and document["dataLicense"] == "CC0-1.0", "header")
expect(document["SPDXID"] == "SPDXRef-DOCUMENT", "the document's identifier")
expect(re.match(r"https?://[^#\s]+$", document["documentNamespace"]), "namespace")
expect(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$", document["creationInfo"]["created"]), "created")
expect(all(re.match(r"(Tool|Person|Organization): \S", who)
           for who in document["creationInfo"]["creators"]), "creators")
expect(len(packages) == len(document["packages"]), "an identifier stands for two packages")

for identifier, package in packages.items():
    expect(ID.match(identifier), f"identifier {identifier}")
    for key in ("name", "versionInfo", "downloadLocation", "licenseDeclared", "copyrightText"):
        expect(package.get(key), f"{identifier} lacks {key}")
    for word in re.split(r" AND | OR ", package["licenseDeclared"]):
        expect(WORD.match(word), f"{identifier}: licence '{word}'")
        if word.startswith("LicenseRef-"):
            expect(word in known_texts, f"{identifier}: the text of {word} is missing")
    for reference in package.get("externalRefs", []):
        expect(re.match(r"pkg:deb/debian/[a-z0-9][a-z0-9+.-]+@\S+\?arch=\w+$",
                        reference["referenceLocator"]), f"{identifier}: {reference}")

ends = set(packages) | {"SPDXRef-DOCUMENT"}
for link in document["relationships"]:
    expect(link["relationshipType"] in KINDS, f"relationship {link}")
    expect(link["spdxElementId"] in ends and link["relatedSpdxElement"] in ends, f"loose end {link}")
reached = {link[end] for link in document["relationships"]
           for end in ("spdxElementId", "relatedSpdxElement")}
expect(set(packages) <= reached, f"related to nothing: {set(packages) - reached}")


def owner(path):
    """dpkg's own answer, for one file at a time."""
    for form in (path, path.removeprefix("/usr")):
        told = subprocess.run(["dpkg", "-S", form], capture_output=True, text=True, check=False).stdout
        if told:
            return told.split(":")[0]
    return None


# Each library that a program loads is of a package that is named, in the version that is installed.
for program in sys.argv[2:]:
    listed = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    libraries = re.findall(r"=> (/\S+)", listed)
    expect(libraries, f"{program} loads nothing")
    for library in libraries:
        name = owner(library)
        expect(name is None or name in names, f"{program} loads {library} of {name}")
for package in document["packages"]:
    if "externalRefs" not in package:
        continue
    version = subprocess.run(["dpkg-query", "-W", "-f", "${Version}\n", package["name"]],
                             capture_output=True, text=True, check=True).stdout.split("\n")[0]
    expect(version == package["versionInfo"], f"{package['name']}: {version} is installed")

print("\n".join(failures))
sys.exit(1 if failures else 0)
