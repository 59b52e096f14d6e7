"""Is what will be published whole and no more? `python .ci/contents.py DIST`, a folder with one wheel and one sdist."""

import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
LARGEST = 8_000_000  # bytes
PRIVATE = ("/work/", "/root/", "/tmp/")  # nothing of the machine that built it

dist = Path(sys.argv[1])
(wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
for file in (wheel, sdist):
    size = file.stat().st_size
    print(f"{file.name}: {size / 1e6:.1f} MB")
    assert size < LARGEST, f"{file.name} is larger than {LARGEST / 1e6:.0f} MB"

with zipfile.ZipFile(wheel) as opened:
    names = set(opened.namelist())
    foreign = [n for n in names if not n.startswith("upright/") and ".dist-info/" not in n]
    assert not foreign, f"the wheel also has {foreign[:5]}"
    text = b"".join(opened.read(n) for n in names if ".dist-info/" in n).decode(errors="replace")
package = {p.relative_to(ROOT / "src").as_posix() for p in (ROOT / "src" / "upright").rglob("*") if p.is_file()}
package = {n for n in package if "__pycache__" not in n}
assert package <= names, f"the wheel lacks {sorted(package - names)[:5]}"
sources = {f"upright/rigs/firmware/source/{n}" for n in ("rig.c", "law.c", "frame.c", "ceilings.h", "Makefile")}
assert sources <= names, f"the wheel lacks {sorted(sources - names)}"
assert not any(folder in text for folder in PRIVATE), "the wheel's metadata name a folder of this machine"

with tarfile.open(sdist) as opened:
    inside = {n.partition("/")[2] for n in opened.getnames()}
needed = {
    "README.md",
    "CHANGELOG.md",
    "LICENSE",
    "CITATION.cff",
    "docs/index.md",
    "tests/conftest.py",
    "firmware/rig.c",
}
assert needed <= inside, f"the sdist lacks {sorted(needed - inside)}"
assert not any(n.startswith("docs/_build") for n in inside), "the sdist holds a built site"
print(f"{len(names)} files in the wheel, {len(inside)} in the sdist")
