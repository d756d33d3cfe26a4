"""Which files of this repository a source includes, as the CMakeLists.txt of the targets find them."""
import os
import pathlib
import re

INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]', re.MULTILINE)
FOLDERS = ("include", "src", "apps/torsio", "")


def includes_of(name, tracked, root="."):
    """The tracked files that the file includes directly, in its order. Paths are relative to the root."""
    found = []
    for included in INCLUDE.findall(pathlib.Path(root, name).read_text(errors="replace")):
        for folder in (os.path.dirname(name), *FOLDERS):
            path = os.path.normpath(os.path.join(folder, included))
            if path in tracked:
                found.append(path)
                break
    return found
