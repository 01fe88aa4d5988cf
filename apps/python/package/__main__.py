# SPDX-License-Identifier: Apache-2.0
"""python3 -m organplay BUNDLE …: the program organplay, the wheel's own where it has one."""
import os
import pathlib
import shutil
import sys


def program():
    own = pathlib.Path(__file__).parent / "program" / "bin" / "organplay"
    return str(own) if own.exists() else shutil.which("organplay")


def main():
    found = program()
    if not found:
        sys.exit("organplay: error: the program organplay is neither in this package nor in PATH; "
                 "install the wheel of scripts/package, or the Debian package organplay")
    os.execv(found, [found, *sys.argv[1:]])


if __name__ == "__main__":
    main()
