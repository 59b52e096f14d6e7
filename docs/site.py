"""Build the site from this folder, the benchmarks' pages and what is generated, into one folder that opens from a file.

`python -m docs build` and `python -m docs serve`. The source that Sphinx reads is put together beside the site, with
docs/ at its top, so that nothing generated lies among the pages that people write.
"""

from __future__ import annotations

import shutil
import time
from pathlib import Path

from docs import dot_plots, gallery, reference

HERE = Path(__file__).parent
ROOT = HERE.parent
BUILT = HERE / "_build"
PAGES = ("*.md", "*.ipynb", "*.py", "*.toml", "*.csv", "*.svg", "*.png", "*.webp", "*.css")


def build(out: Path = BUILT / "html", *, quick: bool = False) -> int:
    """Write the site; 1 when Sphinx warns. A quick one leaves the gallery's identifications out."""
    from sphinx.cmd.build import build_main

    began = time.monotonic()
    source = out.parent / "source"
    shutil.rmtree(source, ignore_errors=True)
    _collect(source)
    reference.write(source / "reference")
    gallery.write(source / "gallery", out / "gallery", quick=quick)
    made = time.monotonic()
    status = build_main(
        ["-b", "html", "-W", "--keep-going", "-q", "-c", str(HERE), str(source), str(out)]
    )
    ended = time.monotonic()
    print(f"{out}: generated in {made - began:.0f} s, built in {ended - made:.0f} s")
    return int(status != 0)


def serve(port: int, *, quick: bool = False) -> int:
    """Build and serve on this machine until Ctrl-C."""
    from functools import partial
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    out = BUILT / "html"
    if build(out, quick=quick):
        return 1
    with ThreadingHTTPServer(
        ("127.0.0.1", port), partial(SimpleHTTPRequestHandler, directory=str(out))
    ) as server:
        print(f"http://127.0.0.1:{server.server_address[1]}/  (Ctrl-C ends it)", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()
    return 0


def _collect(source: Path) -> None:
    """Pages of docs/ at the top, the others in folders of their names; links between them follow."""
    for path in sorted(p for pattern in PAGES for p in HERE.rglob(pattern)):
        if BUILT not in path.parents and not (path.parent == HERE and path.suffix == ".py"):
            _put(path, source / path.relative_to(HERE))
    for path in [
        *ROOT.glob("benchmarks/*.md"),
        *ROOT.glob("examples/*/*"),
        *ROOT.glob("examples/*.py"),
    ]:
        if path.is_file():
            _put(path, source / path.relative_to(ROOT))
    for name in ("CHANGELOG.md", "CONTRIBUTING.md", "LICENSE"):
        _put(ROOT / name, source / name)


def _put(path: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix not in (".md", ".ipynb"):
        shutil.copyfile(path, target)
        return
    text = path.read_text(encoding="utf-8")
    if HERE in path.parents:
        text = (
            text.replace("](../../", "](../")
            if path.parent != HERE
            else text.replace("](../", "](")
        )
    else:
        text = text.replace("](../docs/", "](../").replace("](docs/", "](")
    if path.parent == ROOT / "benchmarks":
        text = dot_plots.with_picture(path.stem, text, target.parent / "pictures")
    target.write_text(text, encoding="utf-8")
