"""Packs a folder as a wheel (PEP 427):   wheel.py STAGE VERSION OUT

STAGE has the package `duet`. The wheel is for the Python that runs this program and for its kind of machine.
"""

import base64
import hashlib
import sys
import sysconfig
import zipfile
from pathlib import Path

ABOUT = """Metadata-Version: 2.1
Name: duet
Version: {version}
Summary: Two-way coupled rigid and deformable bodies
Requires-Python: >=3.11
Requires-Dist: numpy
"""
WHEEL = """Wheel-Version: 1.0
Generator: tools/python
Root-Is-Purelib: false
Tag: {tag}
"""
SCRIPTS = """[console_scripts]
duet = duet.__main__:main
"""


def main() -> None:
    stage, version, out = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"{python}-{python}-{machine}"
    about = f"duet-{version}.dist-info"
    files = {path.relative_to(stage).as_posix(): path for path in sorted(stage.rglob("*")) if path.is_file()}
    record = []
    with zipfile.ZipFile(out / f"duet-{version}-{tag}.whl", "w", zipfile.ZIP_DEFLATED) as wheel:

        def add(name: str, content: bytes, mode: int = 0o644) -> None:
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))  # the same bytes for the same content
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(content)}\n")

        for name, path in files.items():
            add(name, path.read_bytes(), 0o755 if path.stat().st_mode & 0o100 else 0o644)
        add(f"{about}/METADATA", ABOUT.format(version=version).encode())
        add(f"{about}/WHEEL", WHEEL.format(tag=tag).encode())
        add(f"{about}/entry_points.txt", SCRIPTS.encode())
        record.append(f"{about}/RECORD,,\n")
        wheel.writestr(zipfile.ZipInfo(f"{about}/RECORD", (1980, 1, 1, 0, 0, 0)), "".join(record))


if __name__ == "__main__":
    main()
