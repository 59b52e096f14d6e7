"""Logs as the programs of the laboratory write them, made here from known numbers."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import numpy as np
import pytest

FOLDER = os.environ.get("UPRIGHT_REAL_DATA", "")


def real(name: str) -> Path:
    path = Path(FOLDER) / name
    if not path.exists():
        pytest.skip(f"{name} is not in UPRIGHT_REAL_DATA")
    return path


def ecp_export(n: int = 60, period: float = 0.008854, newline: str = "\r\n", columns: tuple[str, ...] = ()) -> bytes:
    """Layout of "Export Raw Data": widths %6d %9.3f %16d %16.4f, brackets, semicolons."""
    columns = columns or ("Commanded Pos", "Encoder 1 Pos", "Encoder 2 Pos", "Control Effort")
    rows = []
    for i in range(n):
        cells = f"{'[' if i == 0 else ' '}{i:5d}{i * period:9.3f}"
        for j, name in enumerate(columns):
            cells += f"{0.5:16.4f}" if "Effort" in name else f"{round(300 * np.sin(0.1 * i + j)):16d}"
        rows.append(cells + (";" if i < n - 1 else "]"))
    head = " Sample   Time     " + "   ".join(columns)
    return newline.join([head, "", *rows, ""]).encode()


def tab_export(n: int = 60) -> bytes:
    rows = [f"{i + 1}\t{round((i + 1) * 1.1275) / 1000:g}\t{round(50 * np.sin(0.2 * i))}\t{i}\t573" for i in range(n)]
    return "\n".join(["Sample\tTime\tEncoder 1 Pos\tEncoder 2 Pos\tControl Effort", *rows, ""]).encode()


def named_csv(n: int = 60) -> bytes:
    rows = [f"{i * 0.002:.17e}, {np.sin(0.1 * i):.17e}, {-1.0:.17e}" for i in range(n)]
    return "\n".join(["t, theta, plant_input", *rows, ""]).encode()


def bare_csv(n: int = 60) -> bytes:
    return "".join(f"{i * 0.00667:.5f}, {np.sin(0.1 * i):.5f}, {np.cos(0.1 * i):.5f}\n" for i in range(n)).encode()


def hash_text(n: int = 60) -> bytes:
    rows = [f"{i * 0.002:g}\t{i}\t{100 * (i > 5)}\t{-i}\t{i // 2}\t1" for i in range(n)]
    return "\n".join(["#RTP test", "#t\tn\tu\tv\t$\\theta$\ta", *rows, ""]).encode()


def ros_bag(n: int = 60) -> bytes:
    """Joint states at 500 Hz on their own rows, a command between them every tenth message."""
    lines = ["__time,/effort_control/data.0,/joint_states/header/stamp,/joint_states/joint1/position"]
    for i in range(n):
        stamp = 1707681595547459602 + 2_000_123 * i
        lines.append(f"{(stamp + 400_000) / 1e9:.6f},,{stamp // 10**9}.{stamp % 10**9:09d},{0.01 * i:.9f}")
        if i % 10 == 9:
            lines.append(f"{(stamp + 900_000) / 1e9:.6f},{i:.9f},,")
    return ("\n".join(lines) + "\n").encode()


def mat_vectors(n: int = 60, **more: object) -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    t = 0.028 + np.arange(n) * 1e-3
    content = {"t": t, "theta": np.sin(t), "enc": np.arange(n, dtype=np.int16)} | more
    savemat(file, content, do_compression=n % 2 == 0)
    return file.getvalue()


def run() -> bytes:
    """Log of a run, a chunk every 20 rows, as its writer left it when it was stopped."""
    from tests.logs.runs import written

    return written(60, every=20, finish=False)


def parquet(n: int = 60) -> bytes:
    import pandas as pd

    file = io.BytesIO()
    pd.DataFrame({"t": 0.01 * np.arange(n), "theta": np.sin(np.arange(n))}).to_parquet(file)
    return file.getvalue()


def objects(n: int = 60) -> bytes:
    return json.dumps({"log": [{"t": 0.01 * i, "theta": float(np.sin(i))} for i in range(n)]}).encode()


SYNTHETIC = {
    "ecp.csv": ecp_export,
    "front end.txt": tab_export,
    "named.csv": named_csv,
    "bare.csv": bare_csv,
    "hash.txt": hash_text,
    "bag.csv": ros_bag,
    "plain.mat": mat_vectors,
    "run.mcap": run,
    "frame.parquet": parquet,
    "objects.json": objects,
}
