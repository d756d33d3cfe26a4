"""PEP 517 backend: builds the module by CMake and packs it into a wheel; needs nothing but the standard library.

The folder of the build is build-python, or $TORSIO_PYTHON_BUILD; a second call builds what has changed. Arguments for
CMake: pip install . --config-settings=cmake-args="-DNAME=VALUE ...".
"""

import base64
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def _version() -> str:
    text = (ROOT / "include/torsio/core/version.hpp").read_text()
    return re.search(r'kVersion = "([0-9.]+)"', text)[1]


def _metadata() -> str:
    return (
        f"Metadata-Version: 2.1\nName: torsio\nVersion: {_version()}\n"
        "Summary: Joint torque of series-elastic actuators: learned from recordings, estimated in real time\n"
        "License: BSD-3-Clause\nRequires-Python: >=3.9\nRequires-Dist: numpy>=1.22\n"
    )


def _tag() -> str:
    interpreter = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{interpreter}-{interpreter}-{platform}"


def _build(folder: pathlib.Path, settings: dict) -> None:
    """Configures, builds, and installs the package torsio into the folder."""
    build = pathlib.Path(os.environ.get("TORSIO_PYTHON_BUILD", ROOT / "build-python"))
    configure = ["cmake", "-S", str(ROOT), "-B", str(build), "-DCMAKE_BUILD_TYPE=Release", "-DTORSIO_BUILD_PYTHON=ON"]
    configure += [f"-DTORSIO_BUILD_{part}=OFF" for part in ("TESTS", "EXAMPLES", "C")]
    configure += [f"-DPython_EXECUTABLE={sys.executable}", "-DTORSIO_PYTHON_DIR=."]
    if shutil.which("ninja") and not (build / "CMakeCache.txt").exists():
        configure += ["-G", "Ninja"]
    configure += shlex.split(settings.get("cmake-args", ""))
    subprocess.run(configure, check=True)
    jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count() or 1))
    subprocess.run(["cmake", "--build", str(build), "--target", "torsio_python", "-j", jobs], check=True)
    install = ["cmake", "--install", str(build), "--component", "python", "--strip", "--prefix", str(folder)]
    subprocess.run(install, check=True)


def get_requires_for_build_wheel(config_settings=None):
    """pybind11 where CMake cannot find that of the system."""
    prefixes = ["/usr", "/usr/local", sys.prefix, *filter(None, os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep))]
    folders = ("share/cmake/pybind11", "lib/cmake/pybind11")
    found = any((pathlib.Path(prefix) / folder).is_dir() for prefix in prefixes for folder in folders)
    return [] if found else ["pybind11>=2.10"]


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    version = _version()
    name = f"torsio-{version}-{_tag()}.whl"
    info = f"torsio-{version}.dist-info"
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        _build(folder, config_settings or {})
        (folder / info).mkdir()
        (folder / info / "METADATA").write_text(_metadata())
        (folder / info / "WHEEL").write_text(
            f"Wheel-Version: 1.0\nGenerator: torsio_backend\nRoot-Is-Purelib: false\nTag: {_tag()}\n"
        )
        shutil.copy(ROOT / "LICENSE", folder / info / "LICENSE")
        record = []
        with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
            for file in sorted(path for path in folder.rglob("*") if path.is_file()):
                data = file.read_bytes()
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                record.append(f"{file.relative_to(folder)},sha256={digest},{len(data)}")
                wheel.write(file, file.relative_to(folder))
            record.append(f"{info}/RECORD,,")
            wheel.writestr(f"{info}/RECORD", "\n".join(record) + "\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise SystemExit("torsio has no source package yet: install it from its repository, pip install .")
