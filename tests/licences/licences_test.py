"""python3 licences_test.py TOOL: what tools/licences reports of packages that every Debian has."""
import importlib.machinery
import importlib.util
import sys

loader = importlib.machinery.SourceFileLoader("licences", sys.argv[1])
spec = importlib.util.spec_from_loader("licences", loader)
licences = importlib.util.module_from_spec(spec)
loader.exec_module(licences)

GPL = "bash"  # GPL-3+, nothing else
assert "is not in the table" in licences.complaint(GPL, {})
assert "is under GPL-3.0" in licences.complaint(GPL, {GPL: "GPL-3.0"})
assert "does not mention" in licences.complaint(GPL, {GPL: "Zlib"})
assert "mentions the GPL" in licences.complaint(GPL, {GPL: "3"})
assert licences.complaint("libc6", {"libc6": "LGPL-2.1"}) is None
assert licences.complaint("zlib1g", {"zlib1g": "Zlib"}) is None
